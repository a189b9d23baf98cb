//! Command `next`: choice from a pool, stops, explanations and refusals.

use std::fmt::Write as _;

use flexcal::design::{self, Candidates, NextOptions, Purpose};
use flexcal::fit::{Options, Stop};
use flexcal::measurement::Dataset;
use flexcal::problem::{PoseRanges, Problem};
use serde_json::{Value, json};

use crate::common::arms::path;
use crate::common::program::{Folder, Run, assert_contains, items, number, run};

/// Problem of an arm with four joints.
const PROBLEM: &str = r#"
name = "elbow"
joint = [
  { d_m = 0.45, min_deg = -150, max_deg = 150 },
  { alpha_deg = 90, a_m = 0.05, min_deg = 0, max_deg = 120 },
  { a_m = 0.60, min_deg = -130, max_deg = -10 },
  { a_m = 0.50, min_deg = -100, max_deg = 100 },
]
tool.target_m = [0.15, 0.02, 0.0]
data = { files = ["measurements.csv"], position_sigma_mm = 0.03, held_out = "none" }

[parameters]
"joint*.*" = { sigma_deg = 0.2, sigma_mm = 1 }
"tool.*" = { sigma_mm = 2 }
"base.*" = { free = true }
"#;

/// Truth of the arm, with ranges of its poses.
const TRUTH: &str = r#"
[random]
"joint*.*" = { sigma_deg = 0.1, sigma_mm = 0.5 }

[noise]
position_sigma_mm = 0.03

[poses]
q1_deg = [-150, 150]
q2_deg = [0, 120]
q3_deg = [-130, -10]
q4_deg = [-100, 100]
"#;

/// Returns a folder with the arm in `arm`, measured in some poses.
fn measured(poses: usize) -> Folder {
    let folder = Folder::with([("arm/problem.toml", PROBLEM), ("TRUTH.toml", TRUTH)]);
    let simulate = format!("simulate arm --truth TRUTH.toml --seed 1 --poses {poses} --out arm");
    folder.flexcal(&simulate).success();
    folder
}

fn next(folder: &Folder, arguments: &str) -> Run {
    folder.flexcal(&format!("next arm --out out --json {arguments}"))
}

#[test]
fn poses_come_from_the_pool_and_lower_the_error() {
    let folder = measured(60);
    // The first 14 rows are measured, all are the pool.
    let table = folder.read("arm/measurements.csv");
    let some: String = table.split_inclusive('\n').take(15).collect();
    folder.write("some.csv", some.clone());
    let result = next(&folder, "--data some.csv --pool arm/measurements.csv --poses 6").success();
    let json = result.json();
    assert_eq!([&json["measured"], &json["candidates"]], [&json!(14), &json!(46)]);
    let steps = items(&json["poses"]);
    let mut expected = number(&json["now"]["expected_mm"]);
    assert!((0.05..0.2).contains(&expected) && steps.len() == 6 && json["stop"].is_null());
    for step in steps {
        let after = number(&step["after"]["expected_mm"]);
        assert!(after < expected && number(&step["gain"]) > 0.0, "{step}");
        assert!((0.0..=1.0).contains(&number(&step["travel"])));
        expected = after;
    }
    let angles = |line: &str| line.split(',').map(|cell| cell.parse().unwrap_or(0.0)).collect();
    let all: Vec<Vec<f64>> = table.lines().skip(15).map(angles).collect();
    for line in folder.read("out/next.csv").lines().skip(1) {
        let pose: Vec<f64> = angles(line);
        let is_same = |row: &Vec<f64>| {
            pose[1..5].iter().all(|q| row.iter().any(|value| (value - q).abs() < 1e-6))
        };
        assert!(all.iter().any(is_same), "{line}");
    }
    // The same request gives the same poses.
    let again = next(&folder, "--data some.csv --pool arm/measurements.csv --poses 6").json();
    assert_eq!(again, json);
}

#[test]
fn noise_is_the_declared_one_if_the_earlier_fit_assumed_more() {
    let folder = measured(40);
    let table = folder.read("arm/measurements.csv");
    let lines: Vec<&str> = table.split_inclusive('\n').collect();
    folder.write("first.csv", lines[..31].concat());
    folder.write("new.csv", [&lines[..1], &lines[31..]].concat().concat());
    folder.write(
        "arm/problem.toml",
        PROBLEM.replace("position_sigma_mm = 0.03", "position_sigma_mm = 0.015"),
    );
    folder.flexcal("identify arm --data first.csv --out first");
    assert!(number(&folder.json("first/estimate.json")["sigma_taken_mm"]) > 0.02);
    let prior = "--data new.csv --prior first/estimate.json --poses 1";
    assert!((number(&next(&folder, prior).json()["noise_mm"]) - 0.015).abs() < 1e-9);
}

#[test]
fn it_says_when_there_are_enough() {
    let folder = measured(40);
    let wide = next(&folder, "--tolerance-mm 1").success().json();
    assert_eq!((&wide["stop"], items(&wide["poses"]).len()), (&json!("enough"), 0));
    assert!(!folder.has("out/next.csv"));
    let told = folder.flexcal("next arm --out out --tolerance-mm 1").success();
    assert_contains(&told.stdout, &["Enough: the bound is below the tolerance of 1.000 mm."]);
    let narrow = next(&folder, "--tolerance-mm 0.001 --poses 2");
    // The noise alone is larger: either more poses are named, or they are said to be of no use.
    let stop = &narrow.json()["stop"];
    assert!(stop.is_null() || *stop == "gain-below-noise", "{stop}");
    assert_eq!(
        (&narrow.json()["out_of_reach"], &wide["out_of_reach"]),
        (&json!(true), &json!(false))
    );
    let told = folder.flexcal("next arm --out out --tolerance-mm 0.001 --poses 2");
    assert_contains(&told.stdout, &["better instrument is"]);
}

#[test]
fn poses_for_causes_tell_open_effects_apart() {
    let folder = measured(20);
    let missing = next(&folder, "--for causes");
    assert_contains(&missing.stderr, &["loop.json", "flexcal loop writes it"]);
    let effect = |status: &str, declaration: &str, alternatives: &[&str]| {
        let alternatives: Vec<Value> =
            alternatives.iter().map(|of| json!({ "declaration": of })).collect();
        json!({ "declaration": declaration, "status": status, "alternatives": alternatives })
    };
    let document = |effects: Vec<Value>| json!({ "problem": "elbow", "effects": effects });
    let found = effect("found", "gear-ratio = { joint = 2 }", &[]);
    folder.write("loop.json", document(vec![found.clone()]).to_string());
    let none = next(&folder, "--for causes --explanations loop.json");
    assert_contains(&none.stderr, &["there is nothing to tell apart"]);
    let harmonic = "joint-harmonic = { joint = 3, orders = [1] }";
    let open = effect("probable", "gear-ratio = { joint = 3 }", &[harmonic]);
    folder.write("loop.json", document(vec![found, open]).to_string());
    // A loop of other measurements says nothing about these.
    let mut other: Value = serde_json::from_str(&folder.read("loop.json")).unwrap();
    other["fitted_rows"] = json!(["0123456789abcdef"]);
    folder.write("other.json", other.to_string());
    let refused = next(&folder, "--for causes --explanations other.json");
    assert_contains(&refused.stderr, &["loop.json was made from other measurements"]);
    for purpose in ["causes", "both"] {
        let arguments = format!("--for {purpose} --explanations loop.json --poses 4");
        let json = next(&folder, &arguments).success().json();
        let names: Vec<&Value> = items(&json["effects"]).iter().map(|of| &of["effect"]).collect();
        assert_eq!(names, [&json!("gear-ratio"), &json!("joint-harmonic")]);
        assert_eq!(items(&json["poses"]).len(), 4);
    }
}

#[test]
fn a_pool_of_measured_poses_alone_is_refused_in_words() {
    let folder = measured(12);
    let refused = next(&folder, "--pool arm/measurements.csv");
    assert_contains(&refused.stderr, &["all candidates are measured and fitted already"]);
}

#[test]
fn requests_that_are_too_large_are_refused_in_words() {
    let folder = measured(12);
    let refused = next(&folder, "--poses 10000");
    assert_contains(&refused.stderr, &["10000 poses out of", "are too many"]);
}

/// Plans by the criterion I keep the error of predictions at least as low as those by S.
#[test]
fn a_plan_by_the_mean_variance_of_predictions_lowers_it() {
    let (folder, cases) = (Folder::new(), path("tests/cases").display().to_string());
    let mut told = String::new();
    let rms = |criterion: &str| {
        let out = folder.path(criterion).display().to_string();
        let truth = format!("--truth {cases}/truth.toml");
        let plan = format!("plan {cases} {truth} --poses 10 --criterion {criterion} --out {out}");
        run(path(""), &plan).success();
        let check = format!("check {cases} {truth} --candidates {out}/plan.csv --json --out {out}");
        number(&run(path(""), &check).json()["prediction"]["rms_mm"])
    };
    let [by_mean, by_determinant] = ["I", "D"].map(rms);
    writeln!(told, "I {by_mean}, D {by_determinant}").unwrap();
    assert!(by_mean < by_determinant, "{told}");
}

#[test]
fn a_choice_ends_when_it_is_interrupted() {
    let folder = measured(20);
    let problem = Problem::read(&folder.path("arm")).unwrap();
    let (data, _) = Dataset::read(&problem).unwrap();
    let candidates = Candidates::Within(PoseRanges::of(&problem).unwrap());
    let chosen = |fit: Options| {
        let options = NextOptions {
            poses: 5,
            purpose: Purpose::Accuracy,
            tolerance: None,
            level: 0.95,
            seed: 1,
            workspace: None,
            explanations: None,
            remainder: false,
            fit,
            update: None,
        };
        design::next(&problem, &data, &candidates, &options).map(|next| next.poses.len())
    };
    assert_eq!(chosen(Options::default()).unwrap(), 5);
    let stop = Stop::default();
    stop.request();
    assert!(chosen(Options::default().with_stop(stop)).unwrap_err().is_interrupted());
}

#[test]
fn after_a_loop_poses_are_for_the_closed_problem() {
    let folder = Folder::with_cases(&["problem.toml", "c-link-thermal-bending.csv"]);
    folder.edit("problem.toml", "a-none.csv", "c-link-thermal-bending.csv");
    let advice = || folder.flexcal("next .").success().words();
    assert_contains(&advice(), &["Next: flexcal loop . looks for what the model lacks"]);
    folder.flexcal("loop .").success();
    let closed = "flexcal next out/lunar-sampler/problem.closed.toml";
    assert_contains(&advice(), &[&format!("Next: {closed} chooses poses for the problem")]);
    folder.flexcal(closed.strip_prefix("flexcal ").unwrap()).success();
}
