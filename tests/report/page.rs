//! HTML report: complete, self-contained, reproducible, with all findings.

use crate::common::arms::lunar_case;
use crate::common::made::part;
use flexcal::fit::{ErrorSummary, Options, identify};
use flexcal::measurement::Dataset;
use flexcal::problem::{Problem, Robust, RobustLoss};
use flexcal::report::{self, Report};
use flexcal::results::PlotData;
use flexcal::select::close;
use nalgebra::Vector3;
use serde_json::Value;

/// Elements without an end tag.
const VOID: [&str; 4] = ["meta", "link", "input", "!DOCTYPE"];

/// Returns the first element that is not closed in order.
fn badly_nested(text: &str) -> Option<String> {
    let mut open: Vec<&str> = Vec::new();
    let mut rest = text;
    while let Some((_, after)) = rest.split_once('<') {
        let (tag, next) = after.split_once('>')?;
        rest = next;
        let name = tag.trim_start_matches('/').split([' ', '\n', '/']).next().unwrap_or_default();
        if tag.starts_with('/') {
            if open.pop() != Some(name) {
                return Some(tag.to_owned());
            }
        } else if !tag.ends_with('/') && !VOID.contains(&name) {
            open.push(name);
            if name == "style" || name == "script" {
                rest = &rest[rest.find(&format!("</{name}>"))?..];
            }
        }
    }
    open.pop().map(str::to_owned)
}

/// Returns the pose data of a page.
fn poses(page: &Report) -> Vec<Value> {
    let (_, after) = page.html.split_once("id=\"poses\">").unwrap();
    let store: Value = serde_json::from_str(after.split_once("</script>").unwrap().0).unwrap();
    store["poses"].as_array().unwrap().clone()
}

/// Checks the properties of every page and figure.
fn check(page: &Report) {
    assert_eq!(badly_nested(&page.html), None);
    // Names of regions differ, and no header cell is empty.
    let labels = page.html.split(" role=\"region\" aria-label=\"").skip(1);
    let mut labels: Vec<&str> = labels.map(|text| text.split('"').next().unwrap()).collect();
    let count = labels.len();
    labels.sort_unstable();
    labels.dedup();
    assert_eq!(labels.len(), count);
    assert!(!page.html.contains("></th>"), "an empty header");
    let namespace = "http://www.w3.org/2000/svg";
    for (name, text) in page.figures.iter().chain([&("report.html".to_owned(), page.html.clone())])
    {
        let outside = text.replace(namespace, "");
        for reference in ["http:", "https:", "//", " src=", "@import", "url(", "NaN", "inf\""] {
            assert!(!outside.contains(reference), "{name} has {reference}");
        }
    }
    // The scripts of a page are its script and its data; figures have none.
    let scripts: Vec<&str> =
        page.html.split("<script").skip(1).map(|text| text.split('>').next().unwrap()).collect();
    assert_eq!(scripts, [" type=\"application/json\" id=\"poses\"", ""]);
    assert!(page.figures.iter().all(|(_, figure)| !figure.contains("<script")));
    assert!(page.figures.len() >= 5);
    for (name, figure) in &page.figures {
        assert!(report::is_figure(name), "{name}");
        assert_eq!(badly_nested(figure), None, "{name}");
        assert!(figure.starts_with("<svg ") && figure.contains("aria-label=\""), "{name}");
        // A figure file does not depend on the page: it has a background and explicit colours for
        // light and dark themes.
        assert!(!figure.contains("var(") && figure.contains("fill=\"#ffffff\""), "{name}");
        assert!(figure.contains("prefers-color-scheme:dark"), "{name}");
        // The colours of poses are the same in every legend.
        for (kind, colour) in [(">fitted pose<", "\"#A3ADB8\""), (">held-out pose<", "\"#1F2328\"")]
        {
            for (before, _) in figure.match_indices(kind).map(|(at, _)| figure.split_at(at)) {
                let mark = before.rsplit('<').nth(1).unwrap();
                let is_mark = mark.starts_with("circle") || mark.starts_with("rect");
                assert!(!is_mark || mark.contains(colour), "{name}: {mark} for {kind}");
            }
        }
        // Labels have units in brackets, except labels of dimensionless numbers.
        let labelled = figure.matches('[').count()
            - figure.matches("[fill=").count()
            - figure.matches("[stroke=").count();
        let units = ["correlations", "misprints", "ranking", "residual-joints", "singular-values"];
        let without = units.iter().any(|unit| name.starts_with(unit));
        assert!((labelled >= 1) != without, "{name} has no axis with a unit");
        assert!(!figure.contains("[1]") && !figure.contains("−0 "), "{name}");
    }
    // Data of each figure in the page.
    for data in page
        .html
        .split("href=\"data:text/csv;charset=utf-8,")
        .skip(1)
        .map(|text| text.split('"').next().unwrap())
    {
        let lines: Vec<&str> = data.trim_end_matches("%0A").split("%0A").collect();
        assert!(lines.len() > 1 && lines[0].contains(','), "{data}");
    }
    assert_eq!(page.html.matches(".csv\" href=\"data:text/csv").count(), page.figures.len());
    // Every dot of a pose refers to a pose in the data of the page.
    let poses = poses(page);
    let known: Vec<u64> = poses.iter().map(|pose| pose["row"].as_u64().unwrap()).collect();
    let dots = page
        .html
        .split(" data-p=\"")
        .skip(1)
        .map(|text| text.split('"').next().unwrap().parse().unwrap());
    let dots: Vec<u64> = dots.collect();
    assert!(dots.len() > 50 && dots.iter().all(|row| known.contains(row)), "{} dots", dots.len());
    assert_eq!(page.html.matches("<figure ").count(), page.figures.len());
    assert_eq!(page.html.matches("<figcaption>").count(), page.figures.len());
}

#[test]
fn a_closed_loop_shows_what_it_found() {
    let (problem, mut data) = lunar_case("a-none.csv");
    for row in 0..data.measurements.len() {
        let hours = data.measurements.time[row] / 3600.0;
        data.measurements.positions[row] += Vector3::new(0.4e-3, -0.3e-3, 0.5e-3) * hours;
    }
    let closure = close(&problem, &data, &Options::default()).unwrap();
    let shown = PlotData::of_loop(&problem, &data, &closure).unwrap();
    let page = report::loop_report(&problem, &closure, &shown);
    check(&page);
    assert!(closure.effects.iter().any(|found| found.effect.name() == "tracker-drift"));
    assert_eq!(shown.causes.len(), closure.effects.len());
    for found in &closure.effects {
        assert!(page.html.contains(found.effect.name()));
        for estimate in &found.estimates {
            assert!(page.html.contains(&estimate.name), "{}", estimate.name);
        }
    }
    // The partial residuals of the drift scatter about the fitted line.
    let cause = &shown.causes[0];
    let (first, last) = (cause.curve[0], cause.curve[cause.curve.len() - 1]);
    let slope = (last.1 - first.1) / (last.0 - first.0);
    assert!((slope * 3600.0 / 0.707e-3 - 1.0).abs() < 0.25, "{slope}");
    let off: f64 = cause.points.iter().map(|point| (point.y - slope * point.x).powi(2)).sum();
    assert!((off / cause.points.len() as f64).sqrt() < 0.2e-3);
    // The headline shows all stages.
    let states = ["nominal arm", "as declared, fitted", "with what was added"];
    assert!(states.iter().all(|state| page.html.contains(&format!("class=\"label\">{state}<"))));
    // Each effect contributes millimetres over the workspace.
    let drift = shown
        .contributions
        .iter()
        .find(|contribution| contribution.name.starts_with("tracker-drift"))
        .unwrap();
    assert!(drift.is_effect && (0.2e-3..3e-3).contains(&drift.moved), "{drift:?}");
    let again = report::loop_report(&problem, &closure, &shown);
    assert_eq!(page, again);
    let other = PlotData::of_loop(&problem, &data, &closure).unwrap();
    assert_eq!(report::loop_report(&problem, &closure, &other).html, page.html);
}

#[test]
fn the_picture_holds_the_errors_that_the_tables_sum_up() {
    let (problem, data) = lunar_case("a-none.csv");
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let shown = PlotData::of_identification(&problem, &data, &found).unwrap();
    let close = |errors: &[Vector3<f64>], summary: &ErrorSummary| {
        let ratio = ErrorSummary::of(errors).rms.norm / summary.rms.norm;
        assert!((ratio - 1.0).abs() < 1e-6, "{ratio}");
    };
    close(&shown.stages[0].errors, &found.registered.held_out);
    close(&shown.stages[shown.stages.len() - 1].errors, &found.fitted.held_out);
    let fitted: Vec<Vector3<f64>> =
        shown.residuals.iter().filter(|r| !r.held_out).map(|r| r.error).collect();
    close(&fitted, &found.fitted.identification);
    // Strong correlations are those of the estimate.
    let name =
        |name: &String| shown.correlations.names.iter().position(|other| other == name).unwrap();
    for (a, b, rho) in found.strong_correlations() {
        let shown = shown.correlations.matrix[(name(&a), name(&b))];
        assert_eq!(shown.to_bits(), rho.to_bits(), "{a} {b}: {shown} {rho}");
    }
    let page = report::identification_report(&problem, &found, &shown);
    check(&page);
    // Every test appears with its verdict on the page and in Markdown.
    assert!(shown.residual_tests.tests.len() > 5);
    for check in &shown.residual_tests.tests {
        let verdict = match (&check.outcome, check.failed()) {
            (Err(_), _) => "",
            (Ok(_), true) => "failed: ",
            (Ok(_), false) => "passed: ",
        };
        assert!(
            page.html.contains(&format!(">{verdict}{check}<").replace('&', "&amp;")),
            "{check}"
        );
    }
    let told = report::identification_report(&problem, &found, &shown).markdown;
    assert!(told.contains("- passed: ") && told.contains("## Identifiability"), "{told}");
    assert!(found.estimates.iter().all(|estimate| told.contains(&estimate.name)));
    assert!(shown.correlations.names.iter().all(|name| page.html.contains(name.as_str())));
    // Markup in a title has no effect.
    let titled = Problem { title: "A ` <b> & *\u{1}\u{1b}[31m".to_owned(), ..problem };
    let report = report::identification_report(&titled, &found, &shown);
    check(&report);
    assert!(report.markdown.starts_with("# A \\` \\<b> & \\*[31m\n"), "{}", report.markdown);
    let all = report::estimate_text(&titled, &found, None) + &report.markdown + &report.html;
    assert!(!all.contains(['\u{1}', '\u{1b}']));
}

#[test]
fn poses_without_an_equilibrium_are_counted_and_left_out() {
    let (problem, data) = lunar_case("a-none.csv");
    let mut found = identify(&problem, &data, &Options::default()).unwrap();
    let mut shown = PlotData::of_identification(&problem, &data, &found).unwrap();
    let last = shown.stages.len() - 1;
    let errors = &mut shown.stages[last].errors;
    for error in errors.iter_mut().take(3) {
        *error = Vector3::repeat(f64::NAN);
    }
    found.fitted.held_out = ErrorSummary::of(errors);
    let count = errors.len();
    let words = format!("3 of {count} held-out poses have no equilibrium");
    let page = report::identification_report(&problem, &found, &shown);
    check(&page);
    assert!(
        page.html.contains(&words)
            && page.html.contains("3 poses without an equilibrium are omitted")
    );
    let dots = |page: &Report| {
        page.figures
            .iter()
            .find(|(name, _)| name == "held-out-errors.svg")
            .unwrap()
            .1
            .matches("<circle")
            .count()
    };
    let whole = PlotData::of_identification(&problem, &data, &found).unwrap();
    // Each of the three poses removes one dot from each of the four panels.
    assert_eq!(dots(&page) + 12, dots(&report::identification_report(&problem, &found, &whole)));
    for text in [
        report::identification_report(&problem, &found, &shown).markdown,
        report::estimate_text(&problem, &found, None),
    ] {
        assert!(text.contains(&words) && !text.contains("NaN"), "{text}");
    }
}

#[test]
fn the_pose_behind_the_largest_residual_is_named_and_flattens_nothing() {
    let (problem, mut data) = lunar_case("a-none.csv");
    let row = data.split.identification[9];
    data.measurements.positions[row] += Vector3::new(0.3, 0.0, 0.0);
    let problem =
        Problem { robust: Some(Robust { loss: RobustLoss::Huber, threshold: None }), ..problem };
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let shown = PlotData::of_identification(&problem, &data, &found).unwrap();
    let page = report::identification_report(&problem, &found, &shown);
    check(&page);
    // The arm ends one tool length before the predicted target, and is deflected.
    let tool = problem.tool.target.norm();
    for (&row, arm) in shown.shown.iter().zip(&shown.arms) {
        let (pose, arm) = (&shown.residuals[row], arm.as_ref().unwrap());
        let [.., joint, tip] = arm.bent.as_slice() else { panic!("a line has two ends") };
        assert!((tip - (pose.position - pose.error)).norm() < 1e-9, "{row}");
        assert!(
            ((tip - joint).norm() - tool).abs() < 0.02,
            "{row}: {} {tool}",
            (tip - joint).norm()
        );
        assert!(
            arm.rigid.len() == arm.bent.len()
                && (tip - arm.rigid[arm.rigid.len() - 1]).norm() > 1e-3
        );
    }
    // The pose is in the first row of the table, and in the data of every figure that contains it.
    let place = shown.residuals[row].place.clone();
    assert_eq!(place, format!("a-none.csv:{}", data.measurements.location(row).line.unwrap()));
    let first = page.html.split("<tr data-row=\"").nth(1).unwrap();
    assert!(
        first.starts_with(&row.to_string()) && first[..80].contains(&place),
        "{}",
        &first[..80]
    );
    let pose = poses(&page).into_iter().find(|pose| pose["row"] == row).unwrap();
    assert!((pose["after"][0].as_f64().unwrap() - shown.residuals[row].error.x * 1e3).abs() < 1e-3);
    assert_eq!(pose["q"].as_array().unwrap().len(), 4);
    // It is at the edge with a note, and the other residuals keep their space: their mean length
    // exceeds a tenth of the panel.
    let order = &page.figures.iter().find(|(name, _)| name == "residual-order.svg").unwrap().1;
    assert!(order.contains("1 beyond"), "{order}");
    let tagged = order.split("<circle data-p=\"").skip(1).take(28);
    let height = |text: &str| -> f64 {
        text.split("cy=\"").nth(1).unwrap().split('"').next().unwrap().parse().unwrap()
    };
    let heights: Vec<f64> = tagged.map(height).collect();
    let middle = heights.iter().sum::<f64>() / heights.len() as f64;
    let spread =
        (heights.iter().map(|at| (at - middle).powi(2)).sum::<f64>() / heights.len() as f64).sqrt();
    assert!(spread > 0.1 * 80.0, "{spread}");
}

#[test]
fn thousands_of_poses_make_no_large_page() {
    let (problem, few) = lunar_case("h-none-large.csv");
    let found = identify(&problem, &few, &Options::default()).unwrap();
    let many = part(&few.measurements, (0..6600).map(|k| k % few.measurements.len()));
    let many = Dataset::from_measurements(&problem, many).unwrap();
    let shown = PlotData::of_identification(&problem, &many, &found).unwrap();
    let page = report::identification_report(&problem, &found, &shown);
    check(&page);
    assert!(page.html.len() < 1_000_000, "{} bytes", page.html.len());
    assert!(
        page.html.contains("rows are drawn, including those with the largest residuals."),
        "what is left out is said"
    );
}
