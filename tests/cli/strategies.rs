//! Strategies, solvers, declared effects, and comparisons.

use serde_json::{Value, json};

use crate::common::program::{Folder, assert_contains, items, named, number, texts};

/// Runs a command on the arm, which succeeds, and returns its JSON.
fn json(folder: &Folder, arguments: &str) -> Value {
    folder.flexcal(&format!("{arguments} --json")).success().json()
}

fn held_out_rms(estimate: &Value) -> f64 {
    number(&estimate["held_out"]["rms_mm"]["norm"])
}

#[test]
fn strategies_and_solvers_are_what_they_say() {
    let folder = Folder::with_lunar_sampler();
    let identify =
        |arguments: &str| folder.flexcal(&format!("identify . --json {arguments}")).json();
    let joint = held_out_rms(&identify(""));
    let geometry = identify("--strategy geometry-only");
    assert_eq!(geometry["strategy"], "geometry-only");
    assert!(held_out_rms(&geometry) > 2.0 * joint, "{} {joint}", held_out_rms(&geometry));
    let bounded = identify("--solver bounded");
    assert_eq!(bounded["solver"], "bounded");
    assert!((held_out_rms(&bounded) - joint).abs() < 1e-6);
    folder.edit(
        "problem.toml",
        "\"A.*\" = { sigma_relative = 0.5 }",
        "\"A.*\" = { min_relative = 0.9, max_relative = 1.1 }",
    );
    let held = identify("");
    assert_eq!(
        (&held["solver"], &held["solver_reason"]),
        (&json!("bounded"), &json!("bounds to keep"))
    );
    let printed = folder.flexcal("identify . -v").stdout;
    assert_contains(&printed, &["\n  –: no standard error, because "]);
    let stiff = named(&held["parameters"], "A.EI");
    assert_eq!((&stiff["at_bound"], &stiff["std_error"]), (&json!("upper"), &Value::Null));
    assert!((number(&stiff["estimate"]) - 1.1 * 2.6e4).abs() < 1e-6);
    let run = folder.flexcal("identify . --solver levenberg-marquardt").code(2);
    assert_contains(&run.stderr, &["does not keep the bounds"]);
}

#[test]
fn a_comparison_without_held_out_rows_has_left_out_errors() {
    let folder = Folder::new();
    folder.copy("problems/service-arm/problem.toml", "problem.toml");
    folder.copy("problems/service-arm/measurements.csv", "measurements.csv");
    folder.map("problem.toml", |text| {
        let held_out = text.lines().find(|line| line.starts_with("held_out")).unwrap().to_owned();
        text.replace(&held_out, "held_out = \"none\"")
    });
    let compared = json(&folder, "compare .");
    let rows = items(&compared["rows"]);
    assert!(rows.len() > 3);
    for row in rows {
        assert!(row.get("held_out").is_none_or(Value::is_null), "{row}");
        assert!(number(&row["left_out"]["rms_mm"]["norm"]) > 0.0, "{row}");
    }
}

/// Returns the lunar sampler with declared effects and few other free parameters.
fn arm_with_effects() -> Folder {
    let folder = Folder::with_lunar_sampler();
    let effects = "[[effect]]\ngear-ratio = { joint = 3 }\n\n[[effect]]\njoint-harmonic = { joint = 2, orders = [1] }\n";
    let rules = "[parameters]\n\"joint*.theta\" = { sigma_deg = 1 }\n\"joint*.stiffness\" = { sigma_relative = 0.5 }\n\
                 \"joint-harmonic.*\" = { sigma_deg = 0.3 }\n";
    folder.map("problem.toml", |text| {
        let (arm, rest) = text.split_once("[parameters]\n").unwrap();
        let (_, data) = rest.split_once("[data]\n").unwrap();
        // The geometry that is held leaves 9 mm.
        let data = data.replace("position_sigma_mm = 0.05", "position_sigma_mm = 5.0");
        format!("{arm}{effects}\n{rules}\n[data]\n{data}")
    });
    folder
}

#[test]
fn declared_effects_are_in_the_results() {
    let folder = arm_with_effects();
    let printed = folder.flexcal("identify . -v").success().stdout;
    let result = json(&folder, "identify .");
    for (name, unit, shown) in
        [("gear-ratio[3].error", "1", '‰'), ("joint-harmonic[2].sin1", "rad", '°')]
    {
        assert_eq!(named(&result["parameters"], name)["unit"], unit, "{name}");
        let line = printed.lines().find(|line| line.contains(name)).unwrap();
        assert!(line.contains(shown), "{line}");
    }
    let compared = folder.flexcal("compare .").success().stdout;
    assert_contains(
        &compared,
        &["paper: the closed forms of [Chen2021], without the declared effects"],
    );
    let estimate = "--estimate out/lunar-sampler/estimate.json";
    folder.flexcal(&format!("compensate . {estimate} --data a-none.csv")).success();
}

#[test]
fn effects_that_cannot_act_are_bad_input() {
    let folder = arm_with_effects();
    folder.edit("problem.toml", "gear-ratio = { joint = 3 }", "deflected-equilibrium = true");
    let run = folder.flexcal("identify .").code(2);
    assert_contains(&run.stderr, &["effect[1].deflected-equilibrium", "[statics]"]);
}

#[test]
fn compare_has_the_papers_tables_from_each_procedure_of_its_arm() {
    let folder = Folder::with_lunar_sampler();
    let compared = json(&folder, "compare . --out out");
    let procedures = &compared["procedures"];
    let papers = ["nominal-stiffness", "from-positions"].map(|stage| format!("paper-{stage}"));
    let printed = papers.clone().map(|name| name + "-as-printed");
    assert_eq!(
        texts(procedures, "procedure"),
        [&["joint".to_owned()], &papers[..], &printed].concat()
    );
    let rows = texts(&compared["rows"], "strategy");
    for strategy in ["paper-rigid", "rigid", "geometry-only"] {
        assert!(rows.contains(&strategy), "{strategy} is none of {rows:?}");
    }
    for procedure in items(procedures) {
        let (table_2, table_3) = (&procedure["table_2"], &procedure["table_3"]);
        assert_eq!((items(table_2).len(), &table_3["before_registered"]), (4, &json!(false)));
        for seen in [&table_2[0]["beta_deg"]["seen"], &table_2[1]["theta_deg"]["seen"]] {
            assert!(number(seen) < 0.6, "{procedure}");
        }
        for key in ["before", "after", "ignoring_elasticity"] {
            let poses = items(&procedure["figure_13"][format!("{key}_mm")]);
            let norm = |pose: &Value| (0..3).map(|k| number(&pose[k]).powi(2)).sum::<f64>().sqrt();
            let mean = poses.iter().map(norm).sum::<f64>() / 50.0;
            assert_eq!(poses.len(), 50);
            assert!((number(&table_3[key]["mean_mm"]["norm"]) - mean).abs() < 1e-9, "{key}");
        }
        let name = procedure["procedure"].as_str().unwrap();
        let figure = if name == "joint" { String::new() } else { format!("-{name}") };
        assert!(folder.has(format!("out/figures/held-out-errors{figure}.svg")), "{name}");
    }
    assert_contains(
        &folder.read("out/report.md"),
        &["paper: before", "48.9644", "85.44", "(0.", "before: nominal arm without elasticity"],
    );
}

/// Arm of two joints without elasticity.
const RIGID: &str = "name = \"own\"\ntitle = \"Two joints\"\n[[joint]]\nd_m = 0.3\n[[joint]]\nalpha_deg = 90\na_m = 0.1\n\
    [tool]\ntarget_m = [0.5, 0.05, 0.0]\n[parameters]\n\"joint*.theta\" = { sigma_deg = 0.5 }\n\
    [data]\nfiles = [\"measurements.csv\"]\nposition_sigma_mm = 0.1\nheld_out = { column = \"split\" }\n";
const TRUTH: &str = "[random]\n\"*\" = { sigma_deg = 0.1, sigma_mm = 1 }\n[noise]\nposition_sigma_mm = 0.1\n\
    [poses]\nq1_deg = [-120, 120]\nq2_deg = [-40, 80]\nidentification = 12\n";

#[test]
fn compare_on_an_arm_of_ones_own_leaves_the_paper_out_unless_asked() {
    let folder = Folder::with([("problem.toml", RIGID), ("TRUTH.toml", TRUTH)]);
    folder.simulate(".", "TRUTH.toml", 20, 1, "measurements.csv");
    let compare = |arguments: &str| json(&folder, &format!("compare . {arguments}"));
    let procedures = |compared: &Value| texts(&compared["procedures"], "procedure").join(" ");
    let compared = compare("--out out");
    assert_eq!(procedures(&compared), "joint");
    assert!(!texts(&compared["rows"], "strategy").contains(&"rigid"), "nothing to ignore");
    let page = folder.read("out/report.md");
    assert!(!page.contains("lasticity") && !page.contains("paper"), "{page}");
    assert_contains(&page, &["combinations of strategy and solver agree: mean error of the"]);
    assert_eq!(procedures(&compare("--paper --out asked")), "joint paper-rigid");
    // A free base without a prior has to be registered first.
    folder.edit("problem.toml", "[parameters]\n", "[parameters]\n\"base.*\" = { free = true }\n");
    let placed = &compare("--out out")["procedures"][0];
    assert_eq!(placed["table_3"]["before_registered"], true);
    assert!(placed["table_2"][0]["a_mm"]["seen"].is_null(), "fixed");
    // A fixed joint has none of these parameters and no approach side.
    let fixed = "[[joint]]\nkind = \"fixed\"\nxyz_mm = [1, 0, 0]\n[tool]\n";
    folder.edit("problem.toml", "[tool]\n", fixed);
    let held = compare("--out out");
    let joints = items(&held["procedures"][0]["table_2"]).iter().map(|row| &row["joint"]);
    assert_eq!(joints.collect::<Vec<_>>(), [1, 2]);
    let trace = json(&folder, "trace . --out out");
    assert!(items(&trace["checks"]).iter().all(|check| check["about"] != "approach3"), "{trace}");
}

#[test]
fn an_arm_identified_as_rigid_is_used_as_rigid() {
    let folder = Folder::with_lunar_sampler();
    // Without elasticity the residual is 2.6 mm: the declared σ is of that size here.
    folder.edit("problem.toml", "position_sigma_mm = 0.05", "position_sigma_mm = 2.0");
    let found = json(&folder, "identify . --strategy rigid --out out");
    let names = texts(&found["parameters"], "name");
    assert!(
        names.iter().all(|name| !name.ends_with("stiffness") && !name.ends_with("EI")),
        "{names:?}"
    );
    let geometry = json(&folder, "identify . --strategy geometry-only --out geometry");
    let (rigid, nominal) = (held_out_rms(&found), held_out_rms(&geometry));
    assert!(rigid > 3.0 * nominal, "{rigid} {nominal}");
    // The commands bring the arm to the positions predicted by the rigid model.
    let commands = folder
        .flexcal("compensate . --estimate out/estimate.json --data a-none.csv --out out --json");
    let before = number(&commands.json()["mean_miss_before_mm"]);
    assert!((0.5..20.0).contains(&before), "{before} mm, what the rigid fit leaves");
}
