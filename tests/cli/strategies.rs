//! Strategies, solvers, declared effects, and comparisons.

use std::fs;

use assert_cmd::Command;
use serde_json::Value;

use super::{Bench, text};

#[test]
fn strategies_and_solvers_are_what_they_say() {
    let bench = Bench::new();
    let rms = |arguments: &[&str]| {
        let json: Value = serde_json::from_slice(
            &bench.identify(&[&["--json"], arguments].concat()).get_output().stdout,
        )
        .unwrap();
        (json["held_out"]["rms_mm"]["norm"].as_f64().unwrap(), json)
    };
    let (joint, _) = rms(&[]);
    let (geometry, json) = rms(&["--strategy", "geometry-only"]);
    assert_eq!(json["strategy"], "geometry-only");
    assert!(geometry > 2.0 * joint, "{geometry} against {joint}");
    let (bounded, json) = rms(&["--solver", "bounded"]);
    assert_eq!(json["solver"], "bounded");
    assert!((bounded - joint).abs() < 1e-6);
    bench.edit(
        "problem.toml",
        "\"A.*\" = { sigma_relative = 0.5 }",
        "\"A.*\" = { min_relative = 0.9, max_relative = 1.1 }",
    );
    let (_, json) = rms(&[]);
    assert_eq!(
        (&json["solver"], &json["solver_reason"]),
        (&"bounded".into(), &"bounds to keep".into())
    );
    let told = text(&bench.identify(&["-v"]).get_output().stdout);
    assert!(told.contains("\n  –: no standard error, because "), "{told}");
    let parameters = json["parameters"].as_array().unwrap();
    let stiff = parameters.iter().find(|p| p["name"] == "A.EI").unwrap();
    assert_eq!(stiff["at_bound"], "upper");
    assert!((stiff["estimate"].as_f64().unwrap() - 1.1 * 2.6e4).abs() < 1e-6);
    assert!(stiff["std_error"].is_null());
    let assert = bench.identify(&["--solver", "levenberg-marquardt"]).code(2);
    assert!(text(&assert.get_output().stderr).contains("does not keep the bounds"));
}

/// Returns a bench whose problem declares effects and frees few other parameters.
fn bench_with_effects() -> Bench {
    let bench = Bench::new();
    let text = fs::read_to_string(bench.path("problem.toml")).unwrap();
    let (arm, rest) = text.split_once("[parameters]\n").unwrap();
    let (_, data) = rest.split_once("[data]\n").unwrap();
    // The geometry that is held leaves 9 mm.
    let data = data.replace("position_sigma_mm = 0.05", "position_sigma_mm = 5.0");
    let effects = "[[effect]]\ngear-ratio = { joint = 3 }\n\n[[effect]]\njoint-harmonic = { joint = 2, orders = [1] }\n";
    let rules = "[parameters]\n\"joint*.theta\" = { sigma_deg = 1 }\n\"joint*.stiffness\" = { sigma_relative = 0.5 }\n\
                 \"joint-harmonic.*\" = { sigma_deg = 0.3 }\n";
    fs::write(bench.path("problem.toml"), format!("{arm}{effects}\n{rules}\n[data]\n{data}"))
        .unwrap();
    bench
}

#[test]
fn declared_effects_are_in_the_results() {
    let bench = bench_with_effects();
    let told = text(&bench.identify(&["-v"]).success().get_output().stdout);
    let line = |name: &str| told.lines().find(|line| line.contains(name)).unwrap().to_owned();
    assert!(
        line("gear-ratio[3].error").contains('‰') && line("joint-harmonic[2].cos1").contains('°'),
        "{told}"
    );
    let json = text(&bench.identify(&["--json"]).success().get_output().stdout);
    let result: Value = serde_json::from_str(&json).unwrap();
    let entries = result["parameters"].as_array().unwrap();
    let unit =
        |name: &str| entries.iter().find(|entry| entry["name"] == name).unwrap()["unit"].clone();
    assert_eq!(
        (unit("gear-ratio[3].error"), unit("joint-harmonic[2].sin1")),
        ("1".into(), "rad".into())
    );
    let out = |arguments: &[&str]| {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
        let done = command.current_dir(bench.folder.path()).args(arguments).assert().success();
        text(&done.get_output().stdout)
    };
    let compared = out(&["compare", "."]);
    assert!(
        compared.contains("paper: the closed forms of [Chen2021], without the declared effects"),
        "{compared}"
    );
    let file = format!("out/{}/estimate.json", result["problem"].as_str().unwrap());
    out(&["compensate", ".", "--estimate", &file, "--data", "a-none.csv"]);
}

#[test]
fn effects_that_cannot_act_are_bad_input() {
    let bench = bench_with_effects();
    bench.edit("problem.toml", "gear-ratio = { joint = 3 }", "deflected-equilibrium = true");
    let error = text(&bench.identify(&[]).code(2).get_output().stderr);
    assert!(
        error.contains("effect[1].deflected-equilibrium") && error.contains("[statics]"),
        "{error}"
    );
}

/// Returns the JSON of a command that succeeds.
fn json(bench: &Bench, arguments: &[&str]) -> Value {
    let mut flexcal = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
    let done =
        flexcal.current_dir(bench.folder.path()).args(arguments).arg("--json").assert().success();
    serde_json::from_slice(&done.get_output().stdout).unwrap()
}

/// Returns the names of the procedures in a comparison.
fn procedures(comparison: &Value) -> Vec<&str> {
    comparison["procedures"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row["procedure"].as_str().unwrap())
        .collect()
}

#[test]
fn compare_has_the_papers_tables_from_each_procedure_of_its_arm() {
    let bench = Bench::new();
    let compared = json(&bench, &["compare", ".", "--out", "out"]);
    let papers = ["nominal-stiffness", "from-positions"].map(|stage| format!("paper-{stage}"));
    let expected =
        [&["joint".to_owned()], &papers[..], &papers.clone().map(|name| name + "-as-printed")]
            .concat();
    assert_eq!(procedures(&compared), expected);
    let rows: Vec<&str> = compared["rows"]
        .as_array()
        .unwrap()
        .iter()
        .map(|row| row["strategy"].as_str().unwrap())
        .collect();
    assert!(
        rows.contains(&"paper-rigid") && rows.contains(&"rigid") && rows.contains(&"geometry-only"),
        "{rows:?}"
    );
    for procedure in compared["procedures"].as_array().unwrap() {
        let (table_2, table_3, figure) =
            (&procedure["table_2"], &procedure["table_3"], &procedure["figure_13"]);
        assert_eq!(
            (table_2.as_array().unwrap().len(), &table_3["before_registered"]),
            (4, &false.into())
        );
        let (beta, theta) = (&table_2[0]["beta_deg"], &table_2[1]["theta_deg"]);
        assert!(
            beta["seen"].as_f64().unwrap() < 0.6 && theta["seen"].as_f64().unwrap() < 0.6,
            "{procedure}"
        );
        for (key, kind) in [
            ("before", "before_mm"),
            ("after", "after_mm"),
            ("ignoring_elasticity", "ignoring_elasticity_mm"),
        ] {
            let poses = figure[kind].as_array().unwrap();
            let norm = |pose: &Value| {
                (0..3).map(|k| pose[k].as_f64().unwrap().powi(2)).sum::<f64>().sqrt()
            };
            let mean = poses.iter().map(norm).sum::<f64>() / 50.0;
            assert_eq!(poses.len(), 50);
            assert!(
                (table_3[key]["mean_mm"]["norm"].as_f64().unwrap() - mean).abs() < 1e-9,
                "{key}"
            );
        }
        let name = procedure["procedure"].as_str().unwrap();
        let figure = if name == "joint" { String::new() } else { format!("-{name}") };
        assert!(bench.path(&format!("out/figures/held-out-errors{figure}.svg")).exists(), "{name}");
    }
    let page = fs::read_to_string(bench.path("out/report.md")).unwrap();
    for words in
        ["paper: before", "48.9644", "85.44", "(0.", "before: nominal arm without elasticity"]
    {
        assert!(page.contains(words), "{words} missing in:\n{page}");
    }
}

#[test]
fn compare_on_an_arm_of_ones_own_leaves_the_paper_out_unless_asked() {
    let bench = Bench::new();
    let problem = "name = \"own\"\ntitle = \"Two joints\"\n[[joint]]\nd_m = 0.3\n[[joint]]\nalpha_deg = 90\na_m = 0.1\n\
                   [tool]\ntarget_m = [0.5, 0.05, 0.0]\n[parameters]\n\"joint*.theta\" = { sigma_deg = 0.5 }\n\
                   [data]\nfiles = [\"made/measurements.csv\"]\nposition_sigma_mm = 0.1\nheld_out = { column = \"split\" }\n";
    let truth = "[random]\n\"*\" = { sigma_deg = 0.1, sigma_mm = 1 }\n[noise]\nposition_sigma_mm = 0.1\n\
                 [poses]\nq1_deg = [-120, 120]\nq2_deg = [-40, 80]\nidentification = 12\n";
    fs::write(bench.path("problem.toml"), problem).unwrap();
    fs::write(bench.path("TRUTH.toml"), truth).unwrap();
    json(
        &bench,
        &[
            "simulate",
            ".",
            "--truth",
            "TRUTH.toml",
            "--poses",
            "20",
            "--seed",
            "1",
            "--out",
            "made",
        ],
    );
    let compared = json(&bench, &["compare", ".", "--out", "out"]);
    assert_eq!(procedures(&compared), ["joint"]);
    assert!(
        compared["rows"].as_array().unwrap().iter().all(|row| row["strategy"] != "rigid"),
        "nothing to ignore"
    );
    let page = fs::read_to_string(bench.path("out/report.md")).unwrap();
    assert!(
        !page.contains("with elasticity")
            && !page.contains("paper:")
            && page.contains("identified"),
        "{page}"
    );
    for words in [
        "## From each procedure, as in tables 2 and 3 and figure 13 of the paper",
        "–: not identified, or fixed",
    ] {
        assert!(page.contains(words), "{words} missing in:\n{page}");
    }
    let asked = json(&bench, &["compare", ".", "--paper", "--out", "asked"]);
    assert_eq!(procedures(&asked), ["joint", "paper-rigid"]);
    // A free base without a prior has to be registered first.
    bench.edit("problem.toml", "[parameters]\n", "[parameters]\n\"base.*\" = { free = true }\n");
    let placed = json(&bench, &["compare", ".", "--out", "out"]);
    assert_eq!(placed["procedures"][0]["table_3"]["before_registered"], true);
    assert!(placed["procedures"][0]["table_2"][0]["a_mm"]["seen"].is_null(), "fixed");
    // A fixed joint has none of these parameters and no approach side.
    bench.edit(
        "problem.toml",
        "[tool]\n",
        "[[joint]]\nkind = \"fixed\"\nxyz_mm = [1, 0, 0]\n[tool]\n",
    );
    let held = json(&bench, &["compare", ".", "--out", "out"]);
    let joints = held["procedures"][0]["table_2"].as_array().unwrap();
    assert_eq!(joints.iter().map(|row| row["joint"].as_u64().unwrap()).collect::<Vec<_>>(), [1, 2]);
    let mut flexcal = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
    let traced = flexcal
        .current_dir(bench.folder.path())
        .args(["trace", ".", "--out", "out"])
        .output()
        .unwrap();
    assert!(
        traced.status.success() && !text(&traced.stdout).contains("approach3"),
        "{}",
        text(&traced.stdout)
    );
}

#[test]
fn an_arm_identified_as_rigid_is_used_as_rigid() {
    let bench = Bench::new();
    // Without elasticity the residual is 2.6 mm: the declared σ is of that size here.
    bench.edit("problem.toml", "position_sigma_mm = 0.05", "position_sigma_mm = 2.0");
    let found = json(&bench, &["identify", ".", "--strategy", "rigid", "--out", "out"]);
    let named = |row: &Value| row["name"].as_str().unwrap().to_owned();
    let names: Vec<String> = found["parameters"].as_array().unwrap().iter().map(named).collect();
    assert!(
        names.iter().all(|name| !name.ends_with("stiffness") && !name.ends_with("EI")),
        "{names:?}"
    );
    let geometry =
        json(&bench, &["identify", ".", "--strategy", "geometry-only", "--out", "geometry"]);
    let rms = |found: &Value| found["held_out"]["rms_mm"]["norm"].as_f64().unwrap();
    assert!(rms(&found) > 3.0 * rms(&geometry), "{} {}", rms(&found), rms(&geometry));
    // The commands bring the arm to the positions predicted by the rigid model.
    let mut flexcal = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
    let arguments = [
        "compensate",
        ".",
        "--estimate",
        "out/estimate.json",
        "--data",
        "a-none.csv",
        "--out",
        "out",
        "--json",
    ];
    let output = flexcal.current_dir(bench.folder.path()).args(arguments).output().unwrap();
    let commands: Value = serde_json::from_slice(&output.stdout).unwrap();
    let before = commands["mean_miss_before_mm"].as_f64().unwrap();
    assert!((0.5..20.0).contains(&before), "{before} mm, what the rigid fit leaves");
}
