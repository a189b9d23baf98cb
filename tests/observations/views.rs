//! Views of boards: errors of the lens, the order of corners, and simulated images.

use std::path::Path;

use flexcal::fit::{FindingCode, Identification, Options, identify};
use flexcal::measurement::Measurements;
use flexcal::problem::Problem;
use flexcal::select::close;
use serde_json::Value;

use crate::cameras::{measured_with, split};
use crate::common::arms::parse;
use crate::common::made::model_of;
use crate::common::program::{Folder, items, number};
use crate::common::reading::{assert_says, read_table, table_error};

/// Arm with a camera, and its identified parameters, from which images are simulated.
struct CameraBench {
    /// The problem with a held camera.
    text: String,
    problem: Problem,
    rows: Measurements,
    fitted: Identification,
}

impl CameraBench {
    fn new() -> Self {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/observations/camera");
        let text = std::fs::read_to_string(folder.join("problem.toml")).unwrap();
        let text = text.replace("\"camera*\" = { free = true }\n", "");
        let table = std::fs::read_to_string(folder.join("data.csv")).unwrap();
        let problem = parse(&text);
        let rows = read_table(&problem, &table);
        let fitted =
            identify(&problem, &split(&problem, rows.clone()), &Options::default()).unwrap();
        Self { text, problem, rows, fitted }
    }

    /// Returns the finding about the lens of a fit to rows of the true arm, with the true lens or
    /// with the declaration `from` replaced by `to` in the problem; and whether χ² / ν is within
    /// chance.
    fn lens_finding(&self, from: &str, to: &str, seed: u64) -> (Option<String>, bool) {
        let held = parse(&self.text.replace(from, to));
        let model = model_of(&self.problem, &self.rows);
        let rows = measured_with(&model, &self.rows, &self.fitted.x, (1.0, seed));
        let found = identify(&held, &split(&held, rows), &Options::default()).unwrap();
        let is_within =
            found.reduced_chi2.zip(found.chance).is_some_and(|(chi2, (_, most))| chi2 < most);
        (found.finding(FindingCode::LensContradicted).map(ToString::to_string), is_within)
    }
}

#[test]
fn a_lens_is_contradicted_only_if_it_is_wrong() {
    let bench = CameraBench::new();
    let mut within = 0;
    let focal = "focal_px = [900, 900]";
    let lens = "distortion = [0, 0, 0, 0, 0]";
    for (seed, (from, to, names)) in [
        (focal, "focal_px = [901.2, 901.2]", ["fx", "fy"]),
        ("centre_px = [640, 360]", "centre_px = [641, 360.7]", ["cx", "cy"]),
        (lens, "distortion = [0.006, 0, 0, 0, 0]", ["k1", "k1"]),
        (lens, "distortion = [0, 0, 0.0005, 0, 0]", ["p1", "cy"]),
    ]
    .into_iter()
    .enumerate()
    {
        let (said, is_within) = bench.lens_finding(from, to, seed as u64);
        println!("{to}: {said:?}, within chance: {is_within}");
        let said = said.unwrap();
        let is_named = |name: &&str| said.contains(&format!("camera[hand].{name}"));
        // The true lens has no distortion, which is the reading of undistorted pixels.
        let is_read = from == lens && said.contains("with distortion = [0, 0, 0, 0, 0]");
        assert!(is_read || names.iter().any(is_named), "{said}");
        within += usize::from(is_within);
    }
    assert!(within > 0);
    for seed in 0..20 {
        let (said, _) = bench.lens_finding("", "", 100 + seed);
        assert_eq!(said, None, "seed {seed}");
    }
}

/// A joint that errs leaves more than a wrong lens, but only the lens distorts an image.
#[test]
fn a_wrong_lens_is_named_beside_an_error_of_the_arm() {
    let bench = CameraBench::new();
    let found = |to: &str| {
        let held = parse(&bench.text.replace("distortion = [0, 0, 0, 0, 0]", to));
        let model = model_of(&bench.problem, &bench.rows);
        let mut rows = measured_with(&model, &bench.rows, &bench.fitted.x, (1.0, 9));
        for configuration in rows.configurations.chunks_mut(rows.joints) {
            configuration[1] += 0.004 * (2.0 * configuration[1]).sin();
        }
        identify(&held, &split(&held, rows), &Options::default()).unwrap()
    };
    let right = found("distortion = [0, 0, 0, 0, 0]");
    assert!(right.reduced_chi2.unwrap() > 1.5 && !right.has(FindingCode::LensContradicted));
    let wrong = found("distortion = [0.02, 0, 0, 0, 0]");
    assert!(wrong.has(FindingCode::LensContradicted), "{:?}", wrong.findings);
}

/// The points of an image determine no more than the pose of the board, whatever their number.
#[test]
fn a_few_images_are_not_judged_by_the_number_of_their_points() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/observations/camera");
    let problem = parse(&std::fs::read_to_string(folder.join("problem.toml")).unwrap());
    let table = std::fs::read_to_string(folder.join("data.csv")).unwrap();
    for (images, is_judged) in [(3, false), (20, true)] {
        let joints = |line: &str| line.split(',').take(7).map(str::to_owned).collect::<Vec<_>>();
        let mut fitted: Vec<Vec<String>> = Vec::new();
        let is_kept = |line: &&str| {
            let is_fitted = line.starts_with("identification");
            if is_fitted && fitted.last() != Some(&joints(line)) {
                fitted.push(joints(line));
            }
            !is_fitted || fitted.len() <= images
        };
        let table: Vec<&str> = table.lines().filter(is_kept).collect();
        let rows = read_table(&problem, &(table.join("\n") + "\n"));
        let found = identify(&problem, &split(&problem, rows), &Options::default()).unwrap();
        assert_eq!(found.finding(FindingCode::PriorsDecide).is_none(), is_judged, "{images}");
        let open = found.findings.iter().filter(|of| of.code == FindingCode::NotToldApart);
        assert!(open.into_iter().all(|of| of.word("what") != Some("scale")), "{images}");
    }
}

#[test]
fn pixels_beyond_any_sensor_are_refused() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/observations/camera");
    let problem = parse(&std::fs::read_to_string(folder.join("problem.toml")).unwrap());
    let table = std::fs::read_to_string(folder.join("data.csv")).unwrap();
    let absurd = table.replacen("784.4718", "1e9", 1);
    let error = table_error(&problem, &absurd);
    assert_says(&error, &["rows.csv:2", "1000000000.0 px is no place in an image"]);
}

/// Truth of the bench arm with a camera on its tip and a board in front of it.
const TRUTH: &str = r#"
[parameters]
"camera[camera].x" = { mm = 20 }
"camera[camera].y" = { mm = -10 }
"camera[camera].z" = { mm = 15 }
"camera[camera].rx" = { deg = 2 }
"camera[camera].ry" = { deg = -3 }
"camera[camera].rz" = { deg = 30 }
"camera[camera].k1" = { relative = -0.08 }
"marker[board].x" = { mm = 380 }
"marker[board].y" = { mm = -60 }
"marker[board].z" = { mm = 50 }
"marker[board].rx" = { deg = 1 }
"marker[board].ry" = { deg = 2 }
"marker[board].rz" = { deg = 3 }
[random]
"joint*.*" = { sigma_deg = 0.2, sigma_mm = 1 }
[noise]
pixel_sigma_px = 0.3
[poses]
q1_deg = [-40, 40]
q2_deg = [-30, 60]
q3_deg = [-60, 40]
q4_deg = [-60, 60]
q5_deg = [20, 105]
q6_deg = [-120, 120]
held_out = 0.3
"#;

#[test]
fn a_camera_problem_begins_with_a_urdf_alone() {
    let folder = Folder::with([("TRUTH.toml", TRUTH)]);
    folder.copy("problems/bench-arm/arm.urdf", "arm.urdf");
    folder.flexcal("init arm.urdf --board 9x6x25 --out arm").success();
    folder.flexcal("simulate arm --truth TRUTH.toml --poses 50 --seed 1 --out arm").success();
    let truth = folder.json("arm/truth.json");
    assert_eq!(truth["poses"], 50);
    let table = folder.table("arm/measurements.csv");
    assert!(table.rows.len() > 500, "{}", table.rows.len());
    let result = folder.flexcal("identify arm --out fit").success();
    println!("{}", result.stdout);
    let estimate = folder.json("fit/estimate.json");
    let mut worst = 0.0_f64;
    for parameter in items(&estimate["parameters"]) {
        let name = parameter["name"].as_str().unwrap();
        let known = items(&truth["parameters"]).iter().find(|of| of["name"] == name).unwrap();
        let field = name.strip_prefix("camera[camera].").unwrap_or_default();
        if !["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"].contains(&field) {
            continue;
        }
        let deviation = number(&parameter["estimate"]) - number(&known["true"]);
        worst = worst.max((deviation / number(&parameter["std_error"])).abs());
    }
    assert!(worst < 4.5, "{worst}");

    // The detector begins at the other end in two images.
    let (pose, point) = (table.place("pose"), table.place("point"));
    let whole = table.rows.iter().filter(|cells| cells[point] == "0");
    let is_whole = |cells: &&Vec<String>| {
        table.rows.iter().filter(|other| other[pose] == cells[pose]).count() == 54
    };
    let turned: Vec<&String> = whole.filter(is_whole).map(|cells| &cells[pose]).take(2).collect();
    let reversed = |cells: &[String]| {
        let mut cells = cells.to_vec();
        if turned.contains(&&cells[pose]) {
            cells[point] = (53 - cells[point].parse::<usize>().unwrap()).to_string();
        }
        cells.join(",") + "\n"
    };
    let rows: String = table.rows.iter().map(|cells| reversed(cells)).collect();
    folder.write("turned.csv", table.columns.join(",") + "\n" + &rows);
    let result = folder.flexcal("identify arm --data turned.csv --out turned");
    println!("{}{}", result.stdout, result.stderr);
    let findings = folder.json("turned/estimate.json");
    let findings = items(&findings["findings"]);
    let finding = findings.iter().find(|finding| finding["code"] == "views-reversed").unwrap();
    assert_eq!(finding["numbers"]["views"], 2);

    // Further images show the board.
    let next = folder.flexcal("next arm --poses 3 --truth TRUTH.toml --out next --json").success();
    let steps = next.json();
    let steps = items(&steps["poses"]);
    assert!(steps.len() == 3 && steps.iter().all(|step| number(&step["gain"]) > 0.0));
    folder
        .flexcal("simulate arm --truth TRUTH.toml --data next/next.csv --seed 2 --out seen")
        .success();
    let seen = folder.table("seen/measurements.csv");
    let poses: std::collections::BTreeSet<&String> = seen.rows.iter().map(|row| &row[0]).collect();
    assert_eq!(poses.len(), 3);
}

#[test]
fn an_error_of_the_lens_is_not_called_one_of_the_arm() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/observations/camera");
    let free = std::fs::read_to_string(folder.join("problem.toml")).unwrap();
    // The distortion of the true lens is held at 0.
    let held = parse(&free.replace("\"camera*\" = { free = true }\n", ""));
    let table = std::fs::read_to_string(folder.join("data.csv")).unwrap();
    let data = split(&held, read_table(&held, &table));
    let closed = close(&held, &data, &Options::default()).unwrap();
    let finding = closed.before.fit.finding(FindingCode::LensContradicted).unwrap();
    let names = finding.value("parameters").unwrap().as_array().unwrap();
    assert!(names.contains(&Value::from("camera[hand].k1")), "{finding}");
    assert!(closed.effects.is_empty(), "{:?}", closed.effects);
    let found = identify(&parse(&free), &data, &Options::default()).unwrap();
    assert!(!found.has(FindingCode::LensContradicted) && found.is_trusted());
}

#[test]
fn a_view_with_the_joints_of_another_is_named() {
    let bench = CameraBench::new();
    let model = model_of(&bench.problem, &bench.rows);
    let mut rows = measured_with(&model, &bench.rows, &bench.fitted.x, (1.0, 5));
    let joints = rows.joints;
    let spoilt = rows.configuration(0).to_vec();
    let of_view: Vec<usize> =
        (0..rows.len()).filter(|&row| rows.configuration(row) == spoilt).collect();
    for &row in &of_view {
        rows.configurations[row * joints + 3] += 0.02;
    }
    let options = Options::default().with_influential_rows();
    let found = identify(&bench.problem, &split(&bench.problem, rows), &options).unwrap();
    let finding = found.finding(FindingCode::ViewsDoubted).unwrap();
    assert!(!found.is_trusted() && finding.to_string().contains("1 view"), "{finding}");
    let influential = found.influential_rows.unwrap();
    assert!(influential.rows.iter().all(|row| of_view.contains(&row.row)), "{influential:?}");
}
