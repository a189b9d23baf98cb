//! Commands `trace` and `loop`: their results, key by key, and the closed problem as input.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use assert_cmd::assert::Assert;
use serde_json::Value;

/// Case with a link that bends with temperature.
const THERMAL: &str = "c-link-thermal-bending.csv";
/// Case without an effect.
const NONE: &str = "a-none.csv";
/// Case with two effects.
const TWO: &str = "f-two.csv";
/// Case with an effect outside the catalogue.
const OUTSIDE: &str = "g-not-in-catalogue.csv";

/// Temporary folder with the lunar sampler's problem and the data of one case.
struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    fn new(case: &str) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
        fs::create_dir(folder.path().join("arm")).unwrap();
        let problem = fs::read_to_string(cases.join("problem.toml")).unwrap();
        fs::write(
            folder.path().join("arm/problem.toml"),
            problem.replace("a-none.csv", "data.csv"),
        )
        .unwrap();
        fs::copy(cases.join(case), folder.path().join("arm/data.csv")).unwrap();
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn edit(&self, name: &str, map: impl Fn(&str) -> String) {
        let text = fs::read_to_string(self.path(name)).unwrap();
        let changed = map(&text);
        assert_ne!(text, changed, "nothing to change in {name}");
        fs::write(self.path(name), changed).unwrap();
    }

    fn run(&self, arguments: &[&str]) -> Assert {
        Command::new(assert_cmd::cargo::cargo_bin!("flexcal"))
            .current_dir(self.folder.path())
            .args(arguments)
            .assert()
    }

    /// Returns the JSON of a run that succeeds.
    fn json(&self, arguments: &[&str]) -> Value {
        let assert = self.run(&[arguments, &["--json"]].concat()).success();
        serde_json::from_slice(&assert.get_output().stdout).unwrap()
    }

    /// Returns the printed output of a run that succeeds.
    fn told(&self, arguments: &[&str]) -> String {
        text(&self.run(arguments).success().get_output().stdout)
    }
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// Asserts that every key exists.
fn has(value: &Value, keys: &[&str]) {
    for key in keys {
        assert!(value.get(key).is_some(), "{key} missing in {value:#}");
    }
}

fn is_summary(value: &Value, poses: u64) {
    assert_eq!(value["n"], poses, "{value:#}");
    for kind in ["mean_mm", "max_mm", "rms_mm"] {
        for axis in ["x", "y", "z", "norm"] {
            assert!(
                value[kind][axis].as_f64().is_some_and(|value| value > 0.0),
                "{kind} {axis} in {value:#}"
            );
        }
    }
}

/// Asserts that two results agree within the solver's tolerance, far below any noise.
fn are_alike(one: &Value, other: &Value) {
    if let (Value::Object(one), Value::Object(other)) = (one, other) {
        assert!(one.keys().eq(other.keys()), "{one:?} {other:?}");
        one.iter().for_each(|(key, value)| are_alike(value, &other[key]));
        return;
    }
    let (one, other) = (one.as_f64().unwrap(), other.as_f64().unwrap());
    assert!((one - other).abs() < 1e-6, "{one} {other}");
}

fn held_out_rms(value: &Value) -> f64 {
    value["held_out"]["rms_mm"]["norm"].as_f64().unwrap()
}

#[test]
fn the_loop_writes_what_the_format_says() {
    let bench = Bench::new(THERMAL);
    let json = bench.json(&["loop", "arm"]);
    assert_eq!(json["problem"], "lunar-sampler");
    assert_eq!(json["verdict"], "explained");
    for fit in ["registered", "before", "after"] {
        is_summary(&json[fit]["identification"], 28);
        is_summary(&json[fit]["held_out"], 50);
    }
    assert!(
        json["before"]["reduced_chi2"].as_f64().unwrap()
            > json["after"]["reduced_chi2"].as_f64().unwrap()
    );
    assert!(held_out_rms(&json["registered"]) > held_out_rms(&json["before"]));
    assert!(held_out_rms(&json["before"]) > 1.5 * held_out_rms(&json["after"]));
    let effects = json["effects"].as_array().unwrap();
    assert_eq!(effects.len(), 1);
    let found = &effects[0];
    assert_eq!((&found["effect"], &found["link"]), (&"link-thermal-bending".into(), &"B".into()));
    assert!(found["p_value"].as_f64().unwrap() < 1e-6 && found["alternatives"].is_array());
    is_summary(&found["held_out_after"], 50);
    let names: Vec<&str> = found["parameters"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row["name"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["link-thermal-bending[B].about_y", "link-thermal-bending[B].about_z"]);
    assert_eq!(found["parameters"][0]["unit"], "1/(m·K)");
    assert!(
        found["parameters"][0]["estimate"].is_f64() && found["parameters"][0]["std_error"].is_f64()
    );
    assert!(json["unexplained"].is_null());
    let [low, high] =
        [0, 1].map(|end| json["held_out_gain_mm"]["interval_95"][end].as_f64().unwrap());
    assert!(0.0 < low && low < json["held_out_gain_mm"]["mean"].as_f64().unwrap() && high > low);
    has(&json["steps"][0], &["effects", "identification", "held_out"]);
    for name in ["loop.json", "problem.closed.toml", "report.md"] {
        assert!(bench.path("out/lunar-sampler").join(name).exists(), "{name}");
    }
}

#[test]
fn the_closed_problem_is_input_again() {
    let bench = Bench::new(THERMAL);
    bench.edit("arm/problem.toml", |text| format!("# Measured in May\n{text}\n# The end\n"));
    let before = bench.json(&["loop", "arm", "--out", "results/of/may"]);
    let text = fs::read_to_string(bench.path("results/of/may/problem.closed.toml")).unwrap();
    let original = fs::read_to_string(bench.path("arm/problem.toml")).unwrap();
    let expected = original.replace("\"data.csv\"", "\"../../../arm/data.csv\"");
    assert!(text.starts_with(&expected), "{text}");
    assert!(text.ends_with("[[effect]]\nlink-thermal-bending = { link = \"B\" }\n"), "{text}");
    assert!(
        text.contains("# link-thermal-bending[B].about_y = ") && text.contains(" ± "),
        "{text}"
    );
    let again = bench.json(&["identify", "results/of/may/problem.closed.toml"]);
    for part in ["identification", "held_out", "reduced_chi2"] {
        are_alike(&again[part], &before["after"][part]);
    }
    let closed = bench.json(&["loop", "results/of/may/problem.closed.toml"]);
    assert_eq!(
        (&closed["verdict"], &closed["effects"]),
        (&"nothing-found".into(), &Value::Array(Vec::new()))
    );
}

#[test]
fn a_declared_compensator_stays_as_it_is_and_is_not_looked_for() {
    let bench = Bench::new(NONE);
    let spring = "gravity-compensator = { joint = 2, anchor_mm = [100, -250], lever_m = [0.3, 0.15], free_length_m = 0.2 }";
    let cases = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases");
    let truth = fs::read_to_string(cases.join("truth.toml")).unwrap();
    let strengths = "rate_N_per_m = 900\npreload_N = 80\n[[effect]]\ngear-ratio = { joint = 3 }\nerror_relative = 1e-3";
    fs::write(bench.path("truth.toml"), format!("{truth}\n[[effect]]\n{spring}\n{strengths}\n"))
        .unwrap();
    bench
        .run(&[
            "simulate",
            "arm",
            "--truth",
            "truth.toml",
            "--poses",
            "78",
            "--seed",
            "5",
            "--out",
            "sim",
        ])
        .success();
    fs::copy(bench.path("sim/measurements.csv"), bench.path("arm/data.csv")).unwrap();
    let untried = bench.json(&["trace", "arm"]);
    assert!(!untried.to_string().contains("gravity-compensator"), "{untried:#}");
    bench.edit("arm/problem.toml", |text| format!("{text}\n[[effect]]\n{spring}\n"));
    let closed = bench.json(&["loop", "arm", "--out", "closed"]);
    let added = closed["effects"].to_string();
    assert!(added.contains("gear-ratio") && !added.contains("gravity-compensator"), "{added}");
    let written = fs::read_to_string(bench.path("closed/problem.closed.toml")).unwrap();
    assert!(written.contains(spring), "{written}");
    let again = bench.json(&["identify", "closed/problem.closed.toml"]);
    let estimates = again["parameters"].as_array().unwrap();
    for (name, truth) in [("rate", 900.0), ("preload", 80.0)] {
        let name = format!("gravity-compensator[2].{name}");
        let parameter =
            estimates.iter().find(|parameter| parameter["name"] == name.as_str()).unwrap();
        let (value, error) =
            (parameter["estimate"].as_f64().unwrap(), parameter["std_error"].as_f64().unwrap());
        assert!((value - truth).abs() < 4.0 * error, "{name}: {value} ± {error}");
    }
}

#[test]
fn orientations_that_are_fitted_take_no_part_in_the_loop() {
    let bench = Bench::new(NONE);
    bench.edit("arm/problem.toml", |text| {
        let free = text.replace(
            "sigma_mm = 5.0 }",
            "sigma_mm = 5.0, sigma_deg = 90 }\n\"tool.r*\" = { free = true }",
        );
        free.replace(
            "position_sigma_mm = 0.05",
            "position_sigma_mm = 0.05\norientation_sigma_deg = 0.01",
        )
    });
    let truth = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases/truth.toml");
    let truth = truth.to_str().unwrap();
    bench
        .run(&["simulate", "arm", "--truth", truth, "--poses", "78", "--seed", "5", "--out", "sim"])
        .success();
    fs::copy(bench.path("sim/measurements.csv"), bench.path("arm/data.csv")).unwrap();
    bench.run(&["identify", "arm"]).success();
    let closed = bench.json(&["loop", "arm"]);
    assert_eq!(closed["verdict"], "nothing-found", "{closed:#}");
}

#[test]
fn other_data_go_into_the_closed_problem() {
    let bench = Bench::new(THERMAL);
    fs::rename(bench.path("arm/data.csv"), bench.path("other data.csv")).unwrap();
    let before = bench.json(&["loop", "arm", "--data", "other data.csv"]);
    let again = bench.json(&["identify", "out/lunar-sampler/problem.closed.toml"]);
    are_alike(&again["held_out"], &before["after"]["held_out"]);
    let text = fs::read_to_string(bench.path("out/lunar-sampler/problem.closed.toml")).unwrap();
    assert!(text.contains("files = [\"../../other data.csv\"]"), "{text}");
}

#[test]
fn structure_without_a_name_is_said_to_be_left() {
    let bench = Bench::new(OUTSIDE);
    let json = bench.json(&["loop", "arm"]);
    assert_eq!(json["verdict"], "unexplained");
    let left = &json["unexplained"];
    has(left, &["where", "depends_on", "p_value", "held_out_with_empirical_correction"]);
    assert!(
        left["where"].is_string() && left["depends_on"][0].is_string() && left["p_value"].is_f64()
    );
    is_summary(&left["held_out_with_empirical_correction"], 50);
    // The output is compared without line breaks.
    let told = bench.told(&["loop", "arm", "-v"]).split_whitespace().collect::<Vec<_>>().join(" ");
    for words in
        ["Unexplained", "What remains", left["where"].as_str().unwrap(), "it keeps its last value"]
    {
        assert!(told.contains(words), "{words:?} missing in:\n{told}");
    }
}

#[test]
fn the_loop_tells_its_story() {
    let bench = Bench::new(THERMAL);
    let told = bench.told(&["loop", "arm", "-v"]);
    let report = fs::read_to_string(bench.path("out/lunar-sampler/report.md")).unwrap();
    for words in [
        "Explained",
        "link B bows with temperature",
        "(gain 0.",
        "link-thermal-bending = { link = \"B\" }",
    ] {
        assert!(told.contains(words), "{words:?} missing in:\n{told}");
        assert!(report.contains(words), "{words:?} missing in:\n{report}");
    }
    assert!(told.contains("µrad/(m·K)") && told.contains("problem.closed.toml"), "{told}");
    for words in [
        "# Surface sampling arm",
        "| joint2.stiffness |",
        "## Rounds",
        "## What remains",
        "| :-- |",
    ] {
        assert!(report.contains(words), "{words:?} missing in:\n{report}");
    }
    let bench = Bench::new(NONE);
    let told = bench.told(&["loop", "arm", "-v"]);
    assert!(told.contains("Nothing found") && !told.contains("What was found"), "{told}");
}

#[test]
fn what_keeps_the_loop_from_finding_is_said() {
    let bench = Bench::new(NONE);
    bench.edit("arm/problem.toml", |text| text.replace("reference_temperature_C = 20.0", ""));
    let told = bench.told(&["loop", "arm", "--out", "cold"]);
    assert!(
        told.contains("no law\nof the measured temperatures")
            && told.contains("reference_temperature_C"),
        "{told}"
    );
    bench.edit("arm/problem.toml", |text| {
        text.replace("[parameters]\n", "[parameters]\n\"*thermal*\" = { fixed = true }\n")
    });
    let told = bench.told(&["loop", "arm", "--out", "held"]);
    assert!(!told.contains("reference_temperature_C"), "{told}");
    bench.edit("arm/problem.toml", |text| text.replace("\"*thermal*\" = { fixed = true }\n", ""));
    bench.edit("arm/problem.toml", |text| {
        text.replace("position_sigma_mm = 0.05", "position_sigma_mm = 50")
    });
    let told = bench.told(&["loop", "arm", "--out", "coarse"]);
    assert!(
        told.contains("× the declared σ, which is too large;")
            && !told.contains("looks like noise"),
        "{told}"
    );
    bench.edit("arm/problem.toml", |text| {
        let text = text.replace("[data]", "[data]\nreference_temperature_C = 20.0");
        format!(
            "{text}\n[[effect]]\njoint-thermal-drift-lag = {{ joint = 1, time_constant_s = 600 }}\n"
        )
    });
    bench.edit("arm/data.csv", |text| text.replace("time_s", "note"));
    let refused = bench.run(&["identify", "arm", "--out", "untimed"]).code(2);
    assert!(text(&refused.get_output().stderr).contains("a column time_s"), "{refused}");
    assert!(!bench.path("untimed").exists());
    let refused = bench.run(&["predict", "arm", "--out", "untimed"]).code(2);
    assert!(text(&refused.get_output().stderr).contains("a column time_s"), "{refused}");
    assert!(!bench.path("untimed").exists());
}

#[test]
fn a_declared_sigma_that_is_too_large_hides_no_cause() {
    let bench = Bench::new(TWO);
    let effects = |json: &Value| -> BTreeSet<String> {
        json["effects"]
            .as_array()
            .unwrap()
            .iter()
            .map(|effects| effects["effect"].to_string())
            .collect()
    };
    let expected = effects(&bench.json(&["loop", "arm", "--out", "right"]));
    bench.edit("arm/problem.toml", |text| {
        text.replace("position_sigma_mm = 0.05", "position_sigma_mm = 1.0")
    });
    let json = bench.json(&["loop", "arm", "--out", "large"]);
    assert_eq!((effects(&json), &json["verdict"]), (expected, &"explained".into()));
    let told = bench.told(&["loop", "arm", "--out", "told"]);
    let told = told.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(told.contains("if only noise is left. The declared σ is too large."), "{told}");
}

#[test]
fn laws_that_were_not_tried_for_want_of_a_reference_are_said() {
    let bench = Bench::new(THERMAL);
    bench.edit("arm/problem.toml", |text| text.replace("reference_temperature_C = 20.0", ""));
    let told = bench.told(&["loop", "arm", "-v"]);
    let told = told.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        told.contains("were not tried because the problem declares no reference_temperature_C"),
        "{told}"
    );
}

#[test]
fn the_trace_ranks_and_says_why_not() {
    let bench = Bench::new(THERMAL);
    let json = bench.json(&["trace", "arm"]);
    assert_eq!((&json["problem"], &json["structured"]), (&"lunar-sampler".into(), &true.into()));
    is_summary(&json["held_out"], 50);
    has(
        &json["checks"][0],
        &["check", "about", "statistic", "bounds", "p_value", "failed", "words"],
    );
    let best = &json["ranking"][0];
    assert_eq!((&best["effect"], &best["link"]), (&"link-thermal-bending".into(), &"B".into()));
    has(best, &["p_value", "f", "freedom", "expected_gain_mm", "cross_validated_gain_mm", "alike"]);
    let alike = json["ranking"]
        .as_array()
        .unwrap()
        .iter()
        .flat_map(|ranked| ranked["alike"].as_array().unwrap());
    for other in alike {
        assert!(
            other["effect"].is_string()
                && other["angle_deg"].as_f64().is_some_and(|a| (0.0..=90.0).contains(&a))
        );
    }
    let told = bench.told(&["trace", "arm"]);
    for words in
        ["1. link B bows with temperature", "failed: residuals", "passed: ", "p below 1e-16"]
    {
        assert!(told.contains(words), "{words:?} missing in:\n{told}");
    }
    assert!(!bench.path("out/lunar-sampler/problem.closed.toml").exists());
    bench.edit("arm/problem.toml", |text| text.replace("reference_temperature_C = 20.0", ""));
    let json = bench.json(&["trace", "arm"]);
    let untestable = json["untestable"].as_array().unwrap();
    assert!(
        untestable
            .iter()
            .any(|other| other["effect"] == "link-thermal-bending" && other["reason"].is_string())
    );
    let told = bench.told(&["trace", "arm"]);
    assert!(
        told.contains(
            "- joint-thermal-drift of joints 1, 2, 3, 4: the problem declares no reference_temp"
        ),
        "{told}"
    );
    let told = Bench::new(NONE).told(&["trace", "arm"]);
    assert!(told.contains("None of 486 candidates is significant"), "{told}");
    let told = Bench::new(TWO).told(&["trace", "arm"]);
    assert!(
        told.contains("more significant ones are left out here; trace.json holds\nthem all."),
        "{told}"
    );
}

#[test]
fn rows_stand_for_times_that_nobody_measured() {
    let bench = Bench::new(NONE);
    let truth =
        fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases/truth.toml"))
            .unwrap();
    let moved = "[[effect]]\nstation-shift = { at_time_s = 3000 }\nx_mm = 2\ny_mm = 1\nz_mm = 0\n";
    fs::write(bench.path("TRUTH.toml"), format!("{truth}\n{moved}")).unwrap();
    bench.told(&[
        "simulate",
        "arm",
        "--truth",
        "TRUTH.toml",
        "--poses",
        "78",
        "--seed",
        "3",
        "--out",
        ".",
    ]);
    bench.edit("measurements.csv", |text| text.replace(",time_s", ",seconds"));
    let trace = ["trace", "arm", "--data", "measurements.csv"];
    let told = bench.told(&trace);
    assert!(told.contains("1. the measuring station moved after row "), "{told}");
    let json = bench.json(&trace);
    assert!(json["ranking"][0]["description"].as_str().unwrap().contains("after row "), "{json}");
}

#[test]
fn commands_beyond_the_limits_are_named_joint_by_joint() {
    let bench = Bench::new(NONE);
    let limits = "name = \"shoulder\"\nmin_deg = -10\nmax_deg = 60\n";
    bench.edit("arm/problem.toml", |text| text.replace("name = \"shoulder\"\n", limits));
    let data = fs::read_to_string(bench.path("arm/data.csv")).unwrap();
    let outside = |line: &str| {
        !(-10.0..=60.0).contains(&line.split(',').nth(3).unwrap().parse::<f64>().unwrap())
    };
    let angle = |line: &str| line.split(',').nth(3).unwrap().parse::<f64>().unwrap();
    let beyond = |line: &str| (-10.0 - angle(line)).max(angle(line) - 60.0);
    let furthest = data.lines().skip(1).map(beyond).fold(0.0, f64::max);
    let (first, worst) =
        (1..).zip(data.lines()).skip(1).find(|(_, line)| beyond(line) >= furthest).unwrap();
    let lines: Vec<usize> =
        data.lines().enumerate().skip(1).filter(|(_, l)| outside(l)).map(|(k, _)| k + 1).collect();
    assert!(lines.len() > 3);
    for command in ["identify", "trace"] {
        let warned = text(&bench.run(&[command, "arm"]).success().get_output().stderr);
        let expected = format!(
            "data.csv:{first}: joint 2: commanded beyond its limits (min_deg = -10, max_deg = 60) in {} rows, furthest here: \
             q2_deg = {}",
            lines.len(),
            angle(worst)
        );
        assert!(warned.contains(&expected) && warned.matches("beyond").count() == 1, "{warned}");
    }
}

#[test]
fn quiet_is_quiet_and_bad_input_leaves_nothing() {
    let bench = Bench::new(NONE);
    for command in ["trace", "loop"] {
        let assert = bench.run(&[command, "arm", "--quiet", "--out", "there"]).success();
        assert!(assert.get_output().stdout.is_empty() && assert.get_output().stderr.is_empty());
        assert!(
            bench.path("there").join(format!("{command}.json")).exists()
                && !bench.path("out").exists()
        );
        bench.run(&[command, "--help"]).success();
        bench.run(&[command, "arm", "--guess"]).code(2);
        bench.run(&[command, "elsewhere"]).code(2);
    }
    bench.edit("arm/problem.toml", |text| text.replace("beam_elements = 1", "beam_pieces = 1"));
    for command in ["trace", "loop"] {
        let assert = bench.run(&[command, "arm"]).code(2);
        assert!(text(&assert.get_output().stderr).contains("beam_pieces"));
        assert!(assert.get_output().stdout.is_empty() && !bench.path("out").exists());
    }
}

#[test]
fn fits_that_are_not_trusted_end_with_status_one() {
    let bench = Bench::new(NONE);
    let free = "[parameters]\n\"*\" = { free = true }\n[data]\nfiles = [\"data.csv\"]\nposition_sigma_mm = 0.05\n\
                held_out = { column = \"split\" }\n";
    bench.edit("arm/problem.toml", |text| {
        format!("{}{free}", text.split_once("[parameters]").unwrap().0)
    });
    bench.edit("arm/data.csv", |text| {
        let (fitted, others): (Vec<&str>, Vec<&str>) =
            text.lines().partition(|line| line.contains("identification"));
        [&others[..], &fitted[..5]].concat().join("\n")
    });
    for command in ["trace", "loop"] {
        let assert = bench.run(&[command, "arm"]).code(1);
        assert!(text(&assert.get_output().stderr).contains("15 measured coordinates for"));
        let json =
            fs::read_to_string(bench.path("out/lunar-sampler").join(format!("{command}.json")))
                .unwrap();
        assert_eq!(serde_json::from_str::<Value>(&json).unwrap()["trusted"], false);
    }
}
