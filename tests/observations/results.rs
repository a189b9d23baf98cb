//! Error summaries of every kind of rows in all result files, compared with residuals.csv.

use std::collections::BTreeMap;

use flexcal::design::{self, Candidates, Criterion, PlanOptions};
use serde_json::Value;

use crate::bench::{ARM, AROUND, Bench, LINE, problem, true_arm};
use crate::common::program::{Folder, assert_contains, number};
use crate::common::reading::read_dataset;

/// Returns a folder with a problem of the bench and the text of its table.
fn with_table(around: &str, table: &str) -> Folder {
    let problem = format!("{ARM}{around}files = [\"rows.csv\"]\n");
    Folder::with([("problem.toml", &problem), ("rows.csv", table)])
}

/// Simulates a table with `rows` rows of each of `kinds`.
fn table(kinds: &[&str], rows: usize) -> String {
    let (arm, _) = true_arm(&problem(AROUND), 3);
    Bench::new(arm, 5).table(kinds, rows)
}

/// Returns a folder with a problem of the bench and `rows` rows of each of `kinds`.
fn bench(around: &str, kinds: &[&str], rows: usize) -> Folder {
    with_table(around, &table(kinds, rows))
}

/// Residual lengths of residuals.csv by kind of rows, part of the data and session \[mm\] or \[°\].
struct Residuals(Vec<(&'static str, String, String, f64)>);

impl Residuals {
    fn read(folder: &Folder, name: &str) -> Self {
        let mut rows = csv::Reader::from_path(folder.path(name)).unwrap();
        let of_row = |row: BTreeMap<String, String>| {
            let cell =
                |name: &str| row.get(name).map(String::as_str).unwrap_or_default().to_owned();
            let numbers: Vec<f64> = row
                .iter()
                .filter(|(name, _)| name.starts_with("residual_"))
                .filter_map(|column| column.1.parse().ok())
                .collect();
            let kind = match () {
                () if !cell("residual_tilt_x_deg").is_empty() => "tilt",
                () if !cell("residual_offset_mm").is_empty() => "surface",
                () if !cell("anchor").is_empty() => "distance",
                () if !cell("residual_distance_mm").is_empty() => "known distance",
                () if !cell("point").is_empty() => "point",
                () => "position",
            };
            let length = numbers.iter().map(|x| x * x).sum::<f64>().sqrt();
            (kind, cell("held_out"), cell("session"), length)
        };
        Self(rows.deserialize().map(|row| of_row(row.unwrap())).collect())
    }

    /// Asserts that the summary `err` is that of the rows of `kind` for which `part` holds, given
    /// part of the data and session.
    fn agree(&self, err: &Value, kind: &str, part: impl Fn(&str, &str) -> bool, what: &str) {
        let errors: Vec<f64> = self
            .0
            .iter()
            .filter(|row| row.0 == kind && part(&row.1, &row.2))
            .map(|row| row.3)
            .collect();
        let n = errors.len();
        assert_eq!(err["n"], n, "{what}: {err}");
        assert_eq!(err["kind"].as_str().unwrap_or("position"), kind, "{what}");
        let mean = errors.iter().sum::<f64>() / n.max(1) as f64;
        let rms = (errors.iter().map(|x| x * x).sum::<f64>() / n.max(1) as f64).sqrt();
        let max = errors.iter().copied().fold(0.0, f64::max);
        let (unit, other) = if kind == "tilt" { ("deg", "mm") } else { ("mm", "deg") };
        for (statistic, value) in [("mean", mean), ("max", max), ("rms", rms)] {
            let told = err[format!("{statistic}_{unit}")]["norm"].as_f64().unwrap();
            assert!((told - value).abs() < 5e-6, "{what}: {kind} {statistic} {told} {value}");
            assert!(err.get(format!("{statistic}_{other}")).is_none(), "{what}: {err}");
        }
    }

    /// Asserts that both parts of the data in `both` are of `kind`.
    fn both_agree(&self, both: &Value, kind: &str, what: &str) {
        self.agree(&both["identification"], kind, |held_out, _| held_out == "false", what);
        self.agree(&both["held_out"], kind, |held_out, _| held_out == "true", what);
    }
}

#[test]
fn predicted_image_rows_have_their_errors_in_mm_at_the_points() {
    let folder = Folder::new();
    for name in ["problem.toml", "data.csv"] {
        folder.copy(&format!("tests/observations/camera/{name}"), name);
    }
    folder.flexcal("identify . --out fit --quiet").success();
    folder.flexcal("predict . --estimate fit/estimate.json --out there --quiet").success();
    let (fitted, errors) = (folder.json("fit/estimate.json"), folder.json("there/errors.json"));
    let mean = |of: &Value| of["mean_mm"]["norm"].as_f64().unwrap();
    let [low, high] = ["identification", "held_out"].map(|part| mean(&fitted[part]));
    let all = mean(&errors["all"]);
    assert!(low.min(high) <= all && all <= low.max(high), "{low} {all} {high}");
    // Predictions carry the pixel with its standard error.
    let (predictions, residuals) =
        (folder.table("there/predictions.csv"), folder.table("there/residuals.csv"));
    for axis in ["u", "v"] {
        let column = format!("predicted_{axis}_px");
        assert_eq!(predictions.numbers(&column), residuals.numbers(&column));
        let errors = predictions.numbers(&format!("sigma_{axis}_px"));
        assert!(errors.iter().all(|error| *error > 0.0 && *error < 0.2), "{axis}");
    }
    // Poses alone, of an arm that no position identified.
    folder.write("poses.csv", "q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n10,-80,20,30,60,-40\n");
    folder
        .flexcal("predict . --estimate fit/estimate.json --data poses.csv --out poses --quiet")
        .success();
    let sigma = folder.table("poses/predictions.csv").numbers("sigma_z_mm");
    assert!(sigma.len() == 1 && sigma[0] > 0.0 && sigma[0] < 5.0, "{sigma:?}");
}

#[test]
fn error_summaries_are_of_the_rows_own_residuals_and_say_their_kind() {
    let mixed = ["position", "point", "distance", "surface", "tilt"];
    for (measured, kinds) in [
        (&["position"][..], &mixed[..1]),
        (&["point"], &mixed[1..2]),
        (&["distance"], &mixed[2..3]),
        (&["plane", "sphere"], &mixed[3..4]),
        (&["tilt"], &mixed[4..]),
        (&["position", "point", "distance", "plane", "sphere", "tilt"], &mixed[..]),
    ] {
        // Session B contains every second row, or only the tilts.
        let session = |(k, line): (usize, &str)| match k {
            0 => format!("{line},session\n"),
            _ if kinds.len() == 1 => format!("{line},{}\n", ["A", "B"][k % 2]),
            _ => format!("{line},{}\n", if line.contains("flange") { "B" } else { "A" }),
        };
        let table = table(measured, 120 / measured.len());
        let table: String = table.lines().enumerate().map(session).collect();
        let folder = with_table(AROUND, &table);

        let text = ["identify . --out fit", "trace . --out traced", "loop . --out closed -v"]
            .map(|arguments| folder.flexcal(arguments).success().stdout);
        let left = Residuals::read(&folder, "fit/residuals.csv");
        let estimate = folder.json("fit/estimate.json");
        left.both_agree(&estimate, kinds[0], "estimate.json");
        assert_eq!(estimate["registered"]["held_out"]["kind"], estimate["held_out"]["kind"]);

        let all = folder.json("closed/loop.json");
        let after = Residuals::read(&folder, "closed/residuals.csv");
        after.both_agree(&all["after"], kinds[0], "loop.json");
        for part in ["registered", "before"] {
            for rows in ["identification", "held_out"] {
                assert_eq!(all[part][rows]["kind"], estimate[rows]["kind"], "{part}");
                assert_eq!(all[part][rows]["n"], estimate[rows]["n"], "{part}");
            }
        }
        let is_angle = kinds == ["tilt"];
        assert_eq!(all["held_out_gain_deg"].is_object(), is_angle);
        assert_eq!(all["held_out_gain_mm"].is_object(), !is_angle);

        folder.flexcal("predict . --estimate fit/estimate.json --out there").success();
        let errors = folder.json("there/errors.json");
        let there = Residuals::read(&folder, "there/residuals.csv");
        there.agree(&errors["all"], kinds[0], |_, _| true, "errors.json");
        for (name, kind) in [("A", kinds[0]), ("B", kinds[kinds.len() - 1])] {
            there.agree(
                &errors["sessions"][name],
                kind,
                |_, session| session == name,
                &format!("session {name}"),
            );
        }

        // Every file contains all kinds; the printed output shows the first, with its unit.
        let kind_count = |file: &Value| file["kinds"].as_array().map_or(0, Vec::len);
        let expected = if kinds.len() > 1 { kinds.len() + 1 } else { 0 };
        let known = usize::from(kinds == ["point"]);
        assert_eq!(
            [kind_count(&estimate), kind_count(&all["after"])],
            [expected + 2 * known; 2],
            "{measured:?}"
        );
        assert_eq!(kind_count(&errors), if kinds.len() > 1 { kinds.len() } else { 0 });
        for (k, kind) in kinds.iter().enumerate().filter(|_| kinds.len() > 1) {
            left.both_agree(&estimate["kinds"][k], kind, "estimate.json");
            after.both_agree(&all["after"]["kinds"][k], kind, "loop.json");
            there.agree(&errors["kinds"][k], kind, |_, _| true, "errors.json");
        }
        let n = [&estimate["identification"]["n"], &estimate["held_out"]["n"]];
        for text in text {
            let noun = match kinds {
                ["point"] => "contacts with points",
                ["distance"] => "distances",
                ["surface"] => "contacts with surfaces",
                ["tilt"] => "rows of tilts",
                ["position"] => "poses",
                _ => "positions",
            };
            assert!(text.contains(&format!("{} {noun}", n[0])), "{text}");
            assert!(!is_angle || !text.contains(" mm"), "{text}");
        }
    }
}

/// Rows with an undeclared or underdetermined fixture end with exit status 2 and name their place.
#[test]
fn bad_references_end_with_status_2_and_write_nothing() {
    let q = "0.1,0.2,0.3,0.4,0.5,0.6";
    let header = "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,point,anchor,distance_mm,surface,frame,tilt_x_deg,tilt_y_deg";
    let contacts: Vec<String> = (0..40).map(|k| format!("0.{k},{},left,,,,,,", &q[4..])).collect();
    let contacts = contacts.join("\n");
    let at = |(name, _): &(&str, [f64; 3])| format!("[[anchor]]\nname = \"{name}\"\n");
    let around = LINE[2..].iter().map(at).collect::<String>() + AROUND;
    for (cells, words) in [
        (",D,800,,,,", "rows.csv:42: column anchor: no anchor is called \"D\""),
        (",,,wall,,,", "rows.csv:42: column surface: no surface is called \"wall\""),
        (",,,,wrist,1,1", "rows.csv:42: column frame: no frame is called \"wrist\""),
        ("top,,,,,,", "rows.csv:42: column point: the point \"top\" is measured by 1 row only"),
        (",C,800,,,,", "rows.csv:42: column anchor: the anchor \"C\" is measured by 1 row only"),
    ] {
        let folder = with_table(&around, &format!("{header}\n{contacts}\n{q},{cells}\n"));
        for command in ["identify", "loop", "trace", "predict"] {
            // For a prediction, too few rows leave the position of a point undetermined.
            let words = match cells {
                "top,,,,,," if command == "predict" => {
                    "the rows do not determine point[top].x, and there is no estimate to take it from"
                }
                ",C,800,,,," if command == "predict" => {
                    "the rows do not determine anchor[C].x, and there is no estimate to take it from"
                }
                _ => words,
            };
            let run = folder.flexcal(&format!("{command} . --out out")).code(2);
            assert_contains(&run.message(), &[words]);
            assert!(!folder.has("out"), "{command}");
        }
    }
}

/// A plan from contacts lists what to touch, together with all known distances.
#[test]
fn a_plan_of_contacts_says_what_to_touch() {
    let table = table(&["point", "distance", "plane", "tilt"], 40);
    let folder = with_table(AROUND, &table);
    folder.flexcal("plan . --candidates rows.csv --poses 60 --out plan").success();
    let planned = folder.json("plan/plan.json");
    assert_eq!(
        [&planned["poses"], &planned["candidates"], &planned["given"]],
        [60, 160, 0].map(Value::from).each_ref()
    );
    let mut plan = csv::Reader::from_path(folder.path("plan/plan.csv")).unwrap();
    let mut kinds: BTreeMap<&str, usize> = BTreeMap::new();
    for row in plan.deserialize::<BTreeMap<String, String>>() {
        let row = row.unwrap();
        let told: Vec<&str> = ["point", "anchor", "surface", "frame"]
            .into_iter()
            .filter(|kind| !row[*kind].is_empty())
            .collect();
        assert_eq!(told.len(), 1, "{row:?}");
        assert_eq!(row["sigma_mm"].is_empty(), told == ["frame"], "{row:?}");
        *kinds.entry(told[0]).or_default() += 1;
    }
    assert!(kinds["point"] >= 2 && kinds.values().sum::<usize>() == 60, "{kinds:?}");

    // A contact with a plane has one coordinate, a tilt has two.
    let problem = problem(AROUND);
    let rows = read_dataset(&problem, &table).measurements;
    let of_kind = |kind: &str| {
        (0..rows.len()).filter(|&row| rows.observation(row).kind() == kind).collect::<Vec<_>>()
    };
    for (kind, numbers) in [("surface", 30), ("tilt", 60)] {
        let candidates = Candidates::Rows(Box::new(rows.select(&of_kind(kind))));
        let criterion = Criterion::D;
        let options = PlanOptions {
            poses: 30,
            criterion: &criterion,
            seed: 1,
            workspace: None,
            progress: None,
        };
        assert_eq!(
            design::plan(&problem, &candidates, None, &options).unwrap().coordinates,
            numbers,
            "{kind}"
        );
    }
}

/// Pose accuracy uses positions only, and all of them.
#[test]
fn positions_alone_are_accepted() {
    let folder = bench(AROUND, &["point", "plane", "tilt"], 40);
    let run = folder.flexcal("accept . --out out").code(2);
    assert_contains(&run.message(), &["problem.toml:", "no held-out row measures a position"]);
    assert!(!folder.has("out"));

    let folder = bench(AROUND, &["position", "plane", "tilt"], 40);
    folder.flexcal("identify . --out fit").success();
    folder.flexcal("accept . --out signed").success();
    let (estimate, record) =
        (folder.json("fit/estimate.json"), folder.json("signed/acceptance.json"));
    let kinds = estimate["kinds"].as_array().unwrap();
    let all: u64 = kinds.iter().map(|kind| kind["identification"]["n"].as_u64().unwrap()).sum();
    assert_eq!(record["identification_rows"], all);
    assert_eq!([&record["poses"], &record["held_out_rows"]], [&estimate["held_out"]["n"]; 2]);
    let [accepted, fitted] =
        [&record["after"]["rms_mm"], &estimate["held_out"]["rms_mm"]["norm"]].map(Value::as_f64);
    assert!((accepted.unwrap() / fitted.unwrap() - 1.0).abs() < 1e-9, "{record}");
    let page = folder.read("signed/acceptance.html");
    assert_contains(&page, &[&format!("Rows that were fitted: {all}.")]);
}

/// The exported geometry is evaluated with the identified points, anchors and surfaces; for a rigid
/// arm it is the whole model, whatever is measured.
#[test]
fn an_exported_geometry_is_judged_by_what_rows_measure() {
    for kinds in
        [["point", "plane"], ["distance", "tilt"], ["plane", "distance"], ["tilt", "point"]]
    {
        let folder = bench(AROUND, &kinds, 60);
        assert!(folder.flexcal("identify . --strategy rigid --out fit").status < 2);
        let arguments = "--estimate fit/estimate.json --format ros-yaml --out k.yaml --json";
        let exported = folder.flexcal(&format!("export . {arguments}")).json();
        let estimate = folder.json("fit/estimate.json");
        for arm in ["whole", "rigid"] {
            let of = &exported["held_out"][arm];
            assert_eq!(
                (&of["n"], &of["kind"]),
                (&estimate["held_out"]["n"], &estimate["held_out"]["kind"]),
                "{kinds:?}"
            );
            let unit = if of["rms_deg"].is_object() { "rms_deg" } else { "rms_mm" };
            let [listed, fitted] =
                [of, &estimate["held_out"]].map(|of| of[unit]["norm"].as_f64().unwrap());
            assert!((listed / fitted - 1.0).abs() < 1e-6, "{kinds:?}, {arm}: {listed} {fitted}");
        }
    }
}

/// Sockets at unknown positions do not determine the base: targets in the measuring frame give a
/// warning.
#[test]
fn commands_from_sockets_alone_are_for_the_frame_of_the_base() {
    let around = AROUND.replace("[[anchor]]", "[[anchor]]\nat_m = [1, 1, 1]");
    let folder = bench(&format!("\"base.*\" = {{ free = true }}\n{around}"), &["point"], 90);
    folder.flexcal("identify . --out fit").success();
    folder.write(
        "targets.csv",
        "q1_rad,q2_rad,q3_rad,q4_rad,q5_rad,q6_rad,x_m,y_m,z_m\n0,0.5,0.5,0,0.5,0,0.9,0.1,0.6\n",
    );
    let compensate = "compensate . --estimate fit/estimate.json --data targets.csv";
    for (frame, is_said) in [("measuring", true), ("base", false)] {
        let run = folder.flexcal(&format!("{compensate} --frame {frame}")).success();
        assert_eq!(run.stderr.contains("--frame base"), is_said, "{run:?}");
    }
    // The missing option is reported before missing columns of the poses.
    let error = folder.flexcal("check . --poses 80 --out check").code(2).stderr;
    assert!(error.contains("write --candidates FILE.csv") || error.contains("min_deg"), "{error}");
}

/// Lengths and angles have no common σ, scalar rows have no axes, and rows without positions do not
/// appear in figures of positions.
#[test]
fn every_kind_is_told_in_its_own_terms() {
    let small = AROUND.replace("0.05", "0.01").replace("0.002", "0.0004");
    let folder = bench(&small, &["distance", "tilt"], 60);
    let printed = folder.flexcal("identify . --out fit -v").success().words();
    assert_contains(&printed, &["assume every declared σ times", "distance, mm mean rms max"]);
    assert!(!printed.contains("mean y"), "{printed}");
    let estimate = folder.json("fit/estimate.json");
    let taken = number(&estimate["sigma_taken_mm"]) / 0.01;
    assert!((taken / number(&estimate["noise_factor"]).sqrt() - 1.0).abs() < 1e-6, "{estimate}");
    assert_contains(
        &folder.read("fit/report.html"),
        &["no row measures a position", "The largest residuals of 60 rows"],
    );
    assert!(!folder.has("fit/figures/residual-vectors.svg"));

    // √3 of the σ of distances, without the tilts.
    let checked = folder.flexcal("check . --out check").success();
    let noise = number(&folder.json("check/check.json")["noise_mm"]);
    assert!((noise - 3.0_f64.sqrt() * 0.01).abs() < 1e-9, "{noise}");
    assert_contains(
        &checked.words(),
        &["One position measured with the σ of the distances would have 0.017 mm of noise (rms)."],
    );

    let folder = bench(AROUND, &["point"], 60);
    folder.flexcal("identify . --out fit").success();
    let page = folder.read("fit/report.html");
    // The target is at the points, not at the origin; the known distance is no pose.
    assert_eq!(page.matches(r#""kind":"point""#).count(), 60, "{page}");
    assert!(!page.contains("known distance\","), "{page}");
    assert!(page.contains(r#""position":[70"#) || page.contains(r#""position":[69"#), "{page}");

    // The tables of the paper are of positions.
    let compared = folder.flexcal("compare . --out compare").success().stdout;
    assert!(!compared.contains("max x"), "{compared}");
    assert_contains(&compared, &["contacts with points to identify"]);
}

#[test]
fn positions_beside_other_rows_have_error_bounds() {
    let folder = bench(AROUND, &["position", "distance", "plane", "tilt"], 30);
    folder.flexcal("identify . --out fit").success();
    folder.flexcal("predict . --estimate fit/estimate.json --out rows").success();
    let mut rows = csv::Reader::from_path(folder.path("rows/predictions.csv")).unwrap();
    let bounds: Vec<f64> = rows
        .deserialize()
        .map(|row| row.unwrap())
        .map(|row: BTreeMap<String, String>| row["bound95_mm"].parse().unwrap())
        .collect();
    assert!(bounds.iter().all(|bound| (0.05..1.0).contains(bound)), "{bounds:?}");
    // Only the rows of positions are compared with their bounds.
    let lengths = Residuals::read(&folder, "rows/residuals.csv").0;
    let positions = || lengths.iter().zip(&bounds).filter(|((kind, ..), _)| *kind == "position");
    let within = positions().filter(|((.., length), bound)| length <= *bound).count();
    let errors = folder.json("rows/errors.json");
    let coverage = within as f64 / positions().count() as f64;
    assert!((number(&errors["coverage"]) - coverage).abs() < 1e-9, "{coverage}: {errors}");
    assert!(coverage > 0.85, "{coverage}");
}
