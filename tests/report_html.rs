//! The report for people: whole, self-contained, the same every time, and with everything in it that was found.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

mod common;

use common::arms::{measured, path};
use common::made::part;
use flexcal::diagnose::close;
use flexcal::identify::{ErrorSummary, Options, identify};
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use flexcal::report::{self, PlotData, Report};
use nalgebra::Vector3;

/// Elements without an end.
const VOID: [&str; 3] = ["meta", "link", "!DOCTYPE"];

fn case(file: &str) -> (Problem, Dataset) {
    let problem = Problem::read(&path("tests/cases")).unwrap();
    let measurements = measured(&problem, &[file]);
    let data = Dataset::of(&problem, measurements).unwrap();
    (problem, data)
}

/// The first element that is not closed in its turn.
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
            if name == "style" {
                rest = &rest[rest.find("</style>")?..];
            }
        }
    }
    open.pop().map(str::to_owned)
}

/// What every page and figure must be.
fn check(page: &Report) {
    assert_eq!(badly_nested(&page.html), None);
    let namespace = "http://www.w3.org/2000/svg";
    for (name, text) in page.figures.iter().chain([&("report.html".to_owned(), page.html.clone())]) {
        let outside = text.replace(namespace, "");
        for reference in ["http:", "https:", "//", "<script", "@import", "url(", "NaN", "inf\""] {
            assert!(!outside.contains(reference), "{name} has {reference}");
        }
    }
    assert!(page.figures.len() >= 5);
    for (name, figure) in &page.figures {
        assert!(report::is_figure(name), "{name}");
        assert_eq!(badly_nested(figure), None, "{name}");
        assert!(figure.starts_with("<svg ") && figure.contains("aria-label=\""), "{name}");
        // The file needs nothing of the page: paper of its own, colours written out, others where it is dark.
        assert!(!figure.contains("var(") && figure.contains("fill=\"#ffffff\""), "{name}");
        assert!(figure.contains("prefers-color-scheme:dark"), "{name}");
        // The same poses have the same colour in every legend.
        for (kind, colour) in [("\nfitted pose", "\"#A3ADB8\""), ("\nheld-out pose", "\"#1F2328\"")] {
            for (before, _) in figure.match_indices(kind).map(|(at, _)| figure.split_at(at)) {
                let mark = before.rsplit('<').nth(1).unwrap();
                let is_mark = mark.starts_with("circle") || mark.starts_with("rect");
                assert!(!is_mark || mark.contains(colour), "{name}: {mark} for {kind}");
            }
        }
        // Labels carry their units; places on a map of residuals and states are words.
        let labelled =
            figure.matches('[').count() - figure.matches("[fill=").count() - figure.matches("[stroke=").count();
        assert!(labelled >= 1, "{name} has no axis with a unit");
    }
    assert_eq!(page.html.matches("<figure ").count(), page.figures.len());
    assert_eq!(page.html.matches("<figcaption>").count(), page.figures.len());
}

#[test]
fn a_closed_loop_shows_what_it_found() {
    let (problem, mut data) = case("tests/cases/a-none.csv");
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
    // Each pose's own measurement of the drift lies about the fitted line.
    let cause = &shown.causes[0];
    let (first, last) = (cause.curve[0], cause.curve[cause.curve.len() - 1]);
    let slope = (last.1 - first.1) / (last.0 - first.0);
    assert!((slope * 3600.0 / 0.707e-3 - 1.0).abs() < 0.25, "{slope}");
    let off: f64 = cause.points.iter().map(|point| (point.y - slope * point.x).powi(2)).sum();
    assert!((off / cause.points.len() as f64).sqrt() < 0.2e-3);
    let again = report::loop_report(&problem, &closure, &shown);
    assert_eq!(page, again);
    let other = PlotData::of_loop(&problem, &data, &closure).unwrap();
    assert_eq!(report::loop_report(&problem, &closure, &other).html, page.html);
}

#[test]
fn the_picture_holds_the_errors_that_the_tables_sum_up() {
    let (problem, data) = case("tests/cases/a-none.csv");
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let shown = PlotData::of_identification(&problem, &data, &found).unwrap();
    let close = |errors: &[Vector3<f64>], summary: &ErrorSummary| {
        let ratio = ErrorSummary::of(errors).rms.norm / summary.rms.norm;
        assert!((ratio - 1.0).abs() < 1e-6, "{ratio}");
    };
    close(&shown.stages[0].errors, &found.registered.held_out);
    close(&shown.stages[shown.stages.len() - 1].errors, &found.fitted.held_out);
    let fitted: Vec<Vector3<f64>> = shown.residuals.iter().filter(|r| !r.held_out).map(|r| r.error).collect();
    close(&fitted, &found.fitted.identification);
    // Strong correlations are those of the estimate.
    let name = |name: &String| shown.correlations.names.iter().position(|own| own == name).unwrap();
    for (a, b, rho) in found.strong_correlations() {
        let shown = shown.correlations.matrix[(name(&a), name(&b))];
        assert_eq!(shown.to_bits(), rho.to_bits(), "{a} {b}: {shown} {rho}");
    }
    let page = report::identification_report(&problem, &found, &shown);
    check(&page);
    // Every check with its verdict, on the page and in Markdown.
    assert!(shown.findings.tests.len() > 5);
    for check in &shown.findings.tests {
        let verdict = match (&check.outcome, check.failed()) {
            (Err(_), _) => "",
            (Ok(_), true) => "failed: ",
            (Ok(_), false) => "passed: ",
        };
        assert!(page.html.contains(&format!(">{verdict}{check}<").replace('&', "&amp;")), "{check}");
    }
    let told = report::identification_report(&problem, &found, &shown).markdown;
    assert!(told.contains("- passed: ") && told.contains("## What the poses can tell"), "{told}");
    assert!(found.estimates.iter().all(|estimate| told.contains(&estimate.name)));
    assert!(shown.correlations.names.iter().all(|name| page.html.contains(name.as_str())));
    // A title can switch nothing off.
    let titled = Problem { title: "A ` <b> & *\u{1}\u{1b}[31m".to_owned(), ..problem };
    let report = report::identification_report(&titled, &found, &shown);
    check(&report);
    assert!(report.markdown.starts_with("# A \\` \\<b> & \\*[31m\n"), "{}", report.markdown);
    let all = report::estimate_text(&titled, &found) + &report.markdown + &report.html;
    assert!(!all.contains(['\u{1}', '\u{1b}']));
}

#[test]
fn poses_without_an_equilibrium_are_counted_and_left_out() {
    let (problem, data) = case("tests/cases/a-none.csv");
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
    assert!(page.html.contains(&words) && page.html.contains("3 poses without an equilibrium are left out"));
    let dots = |page: &Report| {
        page.figures.iter().find(|(name, _)| name == "held-out-errors.svg").unwrap().1.matches("<circle").count()
    };
    let whole = PlotData::of_identification(&problem, &data, &found).unwrap();
    // One dot fewer in each of the four panels for each of the three poses.
    assert_eq!(dots(&page) + 12, dots(&report::identification_report(&problem, &found, &whole)));
    for text in
        [report::identification_report(&problem, &found, &shown).markdown, report::estimate_text(&problem, &found)]
    {
        assert!(text.contains(&words) && !text.contains("NaN"), "{text}");
    }
}

#[test]
fn thousands_of_poses_make_no_large_page() {
    let (problem, few) = case("tests/cases/h-none-large.csv");
    let found = identify(&problem, &few, &Options::default()).unwrap();
    let many = part(&few.measurements, (0..6600).map(|k| k % few.measurements.len()));
    let many = Dataset::of(&problem, many).unwrap();
    let shown = PlotData::of_identification(&problem, &many, &found).unwrap();
    let page = report::identification_report(&problem, &found, &shown);
    check(&page);
    assert!(page.html.len() < 1_000_000, "{} bytes", page.html.len());
    assert!(page.html.contains("is drawn."), "what is left out is said");
}
