//! Commands `trace` and `loop`: their results, key by key, and the closed problem as input.

use std::collections::BTreeSet;

use serde_json::{Value, json};

use crate::common::program::{
    Folder, assert_contains, entry, findings, items, named, number, texts,
};

/// Case with a link that bends with temperature.
const THERMAL: &str = "c-link-thermal-bending.csv";
/// Case without an effect.
const NONE: &str = "a-none.csv";
/// Case with two effects.
const TWO: &str = "f-two.csv";
/// Case with an effect outside the catalogue.
const OUTSIDE: &str = "g-not-in-catalogue.csv";

const PROBLEM: &str = "arm/problem.toml";
const DATA: &str = "arm/data.csv";
const REFERENCE: &str = "reference_temperature_C = 20.0";
const SIGMA: &str = "position_sigma_mm = 0.05";

/// Returns a folder with the lunar sampler's problem and the data of one case.
fn bench(case: &str) -> Folder {
    let folder = Folder::new();
    folder.copy("tests/cases/problem.toml", PROBLEM);
    folder.edit(PROBLEM, "a-none.csv", "data.csv");
    folder.copy(&format!("tests/cases/{case}"), DATA);
    folder
}

/// Returns the JSON of a command that succeeds.
#[track_caller]
fn json(folder: &Folder, arguments: &str) -> Value {
    folder.flexcal(&format!("{arguments} --json")).success().json()
}

/// Returns what a command that succeeds prints, without line breaks.
#[track_caller]
fn printed(folder: &Folder, arguments: &str) -> String {
    folder.flexcal(arguments).success().words()
}

/// Asserts that every key exists.
#[track_caller]
fn assert_has(value: &Value, keys: &[&str]) {
    for key in keys {
        assert!(value.get(key).is_some(), "{key} missing in {value:#}");
    }
}

#[track_caller]
fn assert_summary(value: &Value, poses: u64) {
    assert_eq!(value["n"], poses, "{value:#}");
    for kind in ["mean_mm", "max_mm", "rms_mm"] {
        for axis in ["x", "y", "z", "norm"] {
            let positive = value[kind][axis].as_f64().is_some_and(|value| value > 0.0);
            assert!(positive, "{kind} {axis} in {value:#}");
        }
    }
}

/// Asserts that two results agree within the solver's tolerance, far below any noise.
fn assert_alike(one: &Value, other: &Value) {
    if let (Value::Object(one), Value::Object(other)) = (one, other) {
        assert!(one.keys().eq(other.keys()), "{one:?} {other:?}");
        one.iter().for_each(|(key, value)| assert_alike(value, &other[key]));
        return;
    }
    let (one, other) = (number(one), number(other));
    assert!((one - other).abs() < 1e-6, "{one} {other}");
}

fn held_out_rms(value: &Value) -> f64 {
    number(&value["held_out"]["rms_mm"]["norm"])
}

#[test]
fn the_loop_writes_what_the_format_says() {
    let folder = bench(THERMAL);
    let json = json(&folder, "loop arm");
    assert_eq!(
        (&json["problem"], &json["verdict"]),
        (&json!("lunar-sampler"), &json!("explained"))
    );
    for fit in ["registered", "before", "after"] {
        assert_summary(&json[fit]["identification"], 28);
        assert_summary(&json[fit]["held_out"], 50);
    }
    let [before, after] = ["before", "after"].map(|fit| number(&json[fit]["reduced_chi2"]));
    assert!(before > after, "{before} {after}");
    assert!(held_out_rms(&json["registered"]) > held_out_rms(&json["before"]));
    assert!(held_out_rms(&json["before"]) > 1.5 * held_out_rms(&json["after"]));
    let [found] = items(&json["effects"]) else { panic!("{json:#}") };
    assert_eq!((&found["effect"], &found["link"]), (&json!("link-thermal-bending"), &json!("B")));
    assert!(number(&found["p_value"]) < 1e-6 && found["alternatives"].is_array());
    assert_summary(&found["held_out_after"], 50);
    let parameters = &found["parameters"];
    assert_eq!(
        texts(parameters, "name"),
        ["link-thermal-bending[B].about_y", "link-thermal-bending[B].about_z"]
    );
    assert_eq!(parameters[0]["unit"], "1/(m·K)");
    assert!(parameters[0]["estimate"].is_f64() && parameters[0]["std_error"].is_f64());
    assert!(json["unexplained"].is_null());
    let gain = &json["held_out_gain_mm"];
    let [low, high] = [0, 1].map(|end| number(&gain["interval_95"][end]));
    assert!(0.0 < low && low < number(&gain["mean"]) && high > low, "{gain}");
    assert_has(&json["steps"][0], &["effects", "identification", "held_out"]);
    for name in ["loop.json", "problem.closed.toml", "report.md"] {
        assert!(folder.path("out/lunar-sampler").join(name).exists(), "{name}");
    }
}

#[test]
fn the_closed_problem_is_input_again() {
    let folder = bench(THERMAL);
    folder.map(PROBLEM, |text| format!("# Measured in May\n{text}\n# The end\n"));
    let before = json(&folder, "loop arm --out results/of/may");
    let text = folder.read("results/of/may/problem.closed.toml");
    let expected = folder.read(PROBLEM).replace("\"data.csv\"", "\"../../../arm/data.csv\"");
    assert!(text.starts_with(&expected), "{text}");
    assert!(text.ends_with("[[effect]]\nlink-thermal-bending = { link = \"B\" }\n"), "{text}");
    assert_contains(&text, &["# link-thermal-bending[B].about_y = ", " ± "]);
    let again = json(&folder, "identify results/of/may/problem.closed.toml");
    for part in ["identification", "held_out", "reduced_chi2"] {
        assert_alike(&again[part], &before["after"][part]);
    }
    let closed = json(&folder, "loop results/of/may/problem.closed.toml");
    assert_eq!((&closed["verdict"], &closed["effects"]), (&json!("nothing-found"), &json!([])));
}

#[test]
fn a_declared_compensator_stays_as_it_is_and_is_not_looked_for() {
    let folder = bench(NONE);
    let spring = "gravity-compensator = { joint = 2, anchor_mm = [100, -250], lever_m = [0.3, 0.15], free_length_m = 0.2 }";
    let strengths = "rate_N_per_m = 900\npreload_N = 80\n[[effect]]\ngear-ratio = { joint = 3 }\nerror_relative = 1e-3";
    folder.copy("tests/cases/truth.toml", "truth.toml");
    folder.map("truth.toml", |text| format!("{text}\n[[effect]]\n{spring}\n{strengths}\n"));
    folder.simulate("arm", "truth.toml", 78, 5, DATA);
    let untried = json(&folder, "trace arm");
    assert!(!untried.to_string().contains("gravity-compensator"), "{untried:#}");
    folder.map(PROBLEM, |text| format!("{text}\n[[effect]]\n{spring}\n"));
    let closed = json(&folder, "loop arm --out closed");
    let added = texts(&closed["effects"], "effect");
    assert!(added.contains(&"gear-ratio") && !added.contains(&"gravity-compensator"), "{added:?}");
    assert_contains(&folder.read("closed/problem.closed.toml"), &[spring]);
    let again = json(&folder, "identify closed/problem.closed.toml");
    for (name, truth) in [("rate", 900.0), ("preload", 80.0)] {
        let parameter = named(&again["parameters"], &format!("gravity-compensator[2].{name}"));
        let [value, error] = ["estimate", "std_error"].map(|key| number(&parameter[key]));
        assert!((value - truth).abs() < 4.0 * error, "{name}: {value} ± {error}");
    }
}

#[test]
fn orientations_that_are_fitted_take_no_part_in_the_loop() {
    let folder = bench(NONE);
    let free = "sigma_mm = 5.0, sigma_deg = 90 }\n\"tool.r*\" = { free = true }";
    folder.edit(PROBLEM, "sigma_mm = 5.0 }", free);
    folder.edit(PROBLEM, SIGMA, &format!("{SIGMA}\norientation_sigma_deg = 0.01"));
    folder.copy("tests/cases/truth.toml", "truth.toml");
    folder.simulate("arm", "truth.toml", 78, 5, DATA);
    folder.flexcal("identify arm").success();
    assert_eq!(json(&folder, "loop arm")["verdict"], "nothing-found");
    folder.flexcal("trace arm").success();

    // Two columns in each other's place: positions are as before, but the table is misread.
    folder.edit(DATA, "rx_deg,ry_deg", "ry_deg,rx_deg");
    for command in ["identify", "loop"] {
        let run = folder.flexcal(&format!("{command} arm --json"));
        assert_eq!(run.status, 1, "{command}");
        assert_contains(&run.stdout, &["orientation-misfit"]);
    }
}

#[test]
fn other_data_go_into_the_closed_problem() {
    let folder = bench(THERMAL);
    std::fs::rename(folder.path(DATA), folder.path("other data.csv")).unwrap();
    let before = json(&folder, "loop arm --data 'other data.csv'");
    let again = json(&folder, "identify out/lunar-sampler/problem.closed.toml");
    assert_alike(&again["held_out"], &before["after"]["held_out"]);
    let text = folder.read("out/lunar-sampler/problem.closed.toml");
    assert_contains(&text, &["files = [\"../../other data.csv\"]"]);
}

#[test]
fn structure_without_a_name_is_said_to_be_left() {
    let folder = bench(OUTSIDE);
    let json = json(&folder, "loop arm");
    assert_eq!(json["verdict"], "unexplained");
    let left = &json["unexplained"];
    assert!(
        left["where"].is_string() && left["depends_on"][0].is_string() && left["p_value"].is_f64(),
        "{left:#}"
    );
    assert_summary(&left["held_out_with_empirical_correction"], 50);
    assert_contains(
        &printed(&folder, "loop arm -v"),
        &[
            "Unexplained",
            "Remaining residual",
            left["where"].as_str().unwrap(),
            "it keeps its last value",
        ],
    );
}

#[test]
fn the_loop_tells_its_story() {
    let folder = bench(THERMAL);
    let told = folder.flexcal("loop arm -v").success().stdout;
    let report = folder.read("out/lunar-sampler/report.md");
    let found = [
        "Explained",
        "link B bows with temperature",
        "falls by 0.",
        "link-thermal-bending = { link = \"B\" }",
    ];
    assert_contains(&told, &found);
    assert_contains(&told, &["µrad/(m·K)", "problem.closed.toml"]);
    assert_contains(&report, &found);
    assert_contains(
        &report,
        &[
            "# Surface sampling arm",
            "| joint2.stiffness |",
            "## Rounds",
            "## Remaining residual",
            "| :-- |",
        ],
    );
    let told = printed(&bench(NONE), "loop arm -v");
    assert!(told.contains("Nothing found") && !told.contains("What was found"), "{told}");
}

#[test]
fn what_keeps_the_loop_from_finding_is_said() {
    let folder = bench(NONE);
    folder.edit(PROBLEM, REFERENCE, "");
    let told = printed(&folder, "loop arm --out cold");
    assert_contains(&told, &["no law of the measured temperatures", "reference_temperature_C"]);
    let fixed = "\"*thermal*\" = { fixed = true }\n";
    folder.edit(PROBLEM, "[parameters]\n", &format!("[parameters]\n{fixed}"));
    let told = printed(&folder, "loop arm --out held");
    assert!(!told.contains("reference_temperature_C"), "{told}");
    folder.edit(PROBLEM, fixed, "");
    folder.edit(PROBLEM, SIGMA, "position_sigma_mm = 50");
    let told = printed(&folder, "loop arm --out coarse");
    assert!(!told.contains("looks like noise"), "{told}");
    assert_contains(&told, &["× the declared σ, which is too large;"]);
    folder.map(PROBLEM, |text| {
        let text = text.replace("[data]", &format!("[data]\n{REFERENCE}"));
        format!(
            "{text}\n[[effect]]\njoint-thermal-drift-lag = {{ joint = 1, time_constant_s = 600 }}\n"
        )
    });
    folder.edit(DATA, "time_s", "note");
    for command in ["identify", "predict"] {
        let run = folder.flexcal(&format!("{command} arm --out untimed")).code(2);
        assert_contains(&run.stderr, &["a column time_s"]);
        assert!(!folder.has("untimed"));
    }
}

#[test]
fn a_declared_sigma_that_is_too_large_hides_no_cause() {
    let folder = bench(TWO);
    let effects = |json: &Value| -> BTreeSet<String> {
        texts(&json["effects"], "effect").into_iter().map(str::to_owned).collect()
    };
    let expected = effects(&json(&folder, "loop arm --out right"));
    folder.edit(PROBLEM, SIGMA, "position_sigma_mm = 1.0");
    let found = json(&folder, "loop arm --out large");
    assert_eq!((effects(&found), &found["verdict"]), (expected, &json!("explained")));
    let told = printed(&folder, "loop arm --out told");
    assert_contains(&told, &["if only noise is left. The declared σ is too large."]);
}

#[test]
fn laws_that_were_not_tried_for_want_of_a_reference_are_said() {
    let folder = bench(THERMAL);
    folder.edit(PROBLEM, REFERENCE, "");
    assert_contains(
        &printed(&folder, "loop arm -v"),
        &["were not tried because the problem declares no reference_temperature_C"],
    );
}

#[test]
fn the_trace_ranks_and_says_why_not() {
    let folder = bench(THERMAL);
    let trace = json(&folder, "trace arm");
    assert_eq!((&trace["problem"], &trace["structured"]), (&json!("lunar-sampler"), &json!(true)));
    assert_summary(&trace["held_out"], 50);
    assert_has(
        &trace["checks"][0],
        &["check", "about", "statistic", "bounds", "p_value", "failed", "words"],
    );
    let failed = |failed: bool| items(&trace["checks"]).iter().any(|c| c["failed"] == failed);
    assert!(failed(true) && failed(false), "{trace:#}");
    let best = &trace["ranking"][0];
    assert_eq!((&best["effect"], &best["link"]), (&json!("link-thermal-bending"), &json!("B")));
    assert_eq!(best["description"], "link B bows with temperature");
    assert_has(best, &["f", "freedom", "expected_gain_mm", "cross_validated_gain_mm"]);
    assert!(number(&best["p_value"]) < 1e-16);
    for alike in items(&trace["ranking"]).iter().flat_map(|ranked| items(&ranked["alike"])) {
        let angle = number(&alike["angle_deg"]);
        assert!(alike["effect"].is_string() && (0.0..=90.0).contains(&angle), "{alike}");
    }
    assert_contains(
        &printed(&folder, "trace arm"),
        &["1. link B bows with temperature", "failed: residuals", "passed: ", "p below 1e-16"],
    );
    assert!(!folder.has("out/lunar-sampler/problem.closed.toml"));
    folder.edit(PROBLEM, REFERENCE, "");
    let trace = json(&folder, "trace arm");
    for effect in ["link-thermal-bending", "joint-thermal-drift"] {
        let untestable = entry(&trace["untestable"], |law| law["effect"] == effect);
        assert_eq!(untestable["reason"], "the problem declares no reference_temperature_C");
    }
    assert_contains(
        &printed(&folder, "trace arm"),
        &["- joint-thermal-drift of joints 1, 2, 3, 4: the problem declares no reference_temp"],
    );
    let none = bench(NONE);
    assert_eq!(json(&none, "trace arm")["tried"], 490);
    assert_contains(&printed(&none, "trace arm"), &["None of 490 candidates is significant"]);
    assert_contains(
        &printed(&bench(TWO), "trace arm"),
        &["more significant ones are left out here; trace.json holds them all."],
    );
}

#[test]
fn rows_stand_for_times_that_nobody_measured() {
    let folder = bench(NONE);
    let moved = "[[effect]]\nstation-shift = { at_time_s = 3000 }\nx_mm = 2\ny_mm = 1\nz_mm = 0\n";
    folder.copy("tests/cases/truth.toml", "TRUTH.toml");
    folder.map("TRUTH.toml", |text| format!("{text}\n{moved}"));
    folder.simulate("arm", "TRUTH.toml", 78, 3, "measurements.csv");
    folder.edit("measurements.csv", ",time_s", ",seconds");
    let trace = json(&folder, "trace arm --data measurements.csv");
    let best = &trace["ranking"][0];
    assert_eq!(best["effect"], "station-shift");
    let description = best["description"].as_str().unwrap();
    assert!(
        description.starts_with("the measuring station or the arm's base moved after row "),
        "{description}"
    );
    let told = printed(&folder, "trace arm --data measurements.csv");
    assert_contains(&told, &[&format!("1. {description}")]);
}

#[test]
fn commands_beyond_the_limits_are_named_joint_by_joint() {
    let folder = bench(NONE);
    let limits = "name = \"shoulder\"\nmin_deg = -10\nmax_deg = 60\n";
    folder.edit(PROBLEM, "name = \"shoulder\"\n", limits);
    let angles = folder.table(DATA).numbers("q2_deg");
    let beyond = |angle: f64| (-10.0 - angle).max(angle - 60.0);
    let furthest = angles.iter().map(|&angle| beyond(angle)).fold(0.0, f64::max);
    let (line, worst) = (2..).zip(&angles).find(|(_, angle)| beyond(**angle) >= furthest).unwrap();
    let count = angles.iter().filter(|angle| beyond(**angle) > 0.0).count();
    assert!(count > 3);
    for command in ["identify", "trace"] {
        let warned = folder.flexcal(&format!("{command} arm")).success().stderr;
        let expected = format!(
            "data.csv:{line}: joint 2: commanded beyond its limits (min_deg = -10, max_deg = 60) in {count} rows, furthest here: \
             q2_deg = {worst}"
        );
        assert_contains(&warned, &[&expected]);
        assert_eq!(warned.matches("beyond").count(), 1, "{warned}");
    }
}

#[test]
fn quiet_is_quiet_and_bad_input_leaves_nothing() {
    let folder = bench(NONE);
    for command in ["trace", "loop"] {
        let run = folder.flexcal(&format!("{command} arm --quiet --out there")).success();
        assert!(run.is_silent(), "{run:?}");
        assert!(folder.has(format!("there/{command}.json")) && !folder.has("out"));
        folder.flexcal(&format!("{command} --help")).success();
        folder.flexcal(&format!("{command} arm --guess")).code(2);
        folder.flexcal(&format!("{command} elsewhere")).code(2);
    }
    folder.edit(PROBLEM, "beam_elements = 1", "beam_pieces = 1");
    for command in ["trace", "loop"] {
        let run = folder.flexcal(&format!("{command} arm")).code(2);
        assert!(run.stderr.contains("beam_pieces") && run.stdout.is_empty(), "{run:?}");
        assert!(!folder.has("out"));
    }
}

#[test]
fn fits_that_are_not_trusted_end_with_status_one() {
    let folder = bench(NONE);
    let free = "[parameters]\n\"*\" = { free = true }\n[data]\nfiles = [\"data.csv\"]\nposition_sigma_mm = 0.05\n\
                held_out = { column = \"split\" }\n";
    folder.map(PROBLEM, |text| format!("{}{free}", text.split_once("[parameters]").unwrap().0));
    folder.keep_marked(DATA, "identification", 5);
    for command in ["trace", "loop"] {
        folder.flexcal(&format!("{command} arm")).code(1);
        let json = folder.json(format!("out/lunar-sampler/{command}.json"));
        assert_eq!((&json["trusted"], findings(&json)[0]), (&json!(false), "too-few-equations"));
        assert_eq!(json["findings"][0]["numbers"]["coordinates"], 15);
    }
}
