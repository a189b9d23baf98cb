//! Compensated commands, checked on the virtual rig.

use std::fs;
use std::path::PathBuf;

use flexcal::fit::{Options, Placement, compensate, identify};
use flexcal::measurement::Measurements;
use flexcal::mechanics::{Arm, StaticState, Workspace};
use flexcal::problem::{PoseView, Problem};
use flexcal::results::{commands_csv, poses_csv};
use flexcal::rig::{Truth, simulate};
use nalgebra::Vector3;

use crate::common::arms::{parse, path};
use crate::common::made::model_of;
use crate::common::program::{Folder, Run, assert_contains};
use crate::common::reading::{read_dataset, read_table};

fn case(name: &str) -> PathBuf {
    path("tests/cases").join(name)
}

/// Reads the lunar sampler and its data without an effect.
fn lunar_sampler() -> (Problem, Measurements) {
    let problem = Problem::read(&case("problem.toml")).unwrap();
    let rows = Measurements::read(&[case("a-none.csv")], &problem).unwrap().0;
    (problem, rows)
}

#[test]
fn fifty_targets_are_reached_after_twenty_eight_noisy_poses() {
    let problem = Problem::read(&case("problem.toml")).unwrap();
    let truth = Truth::read(&case("truth.toml"), &problem).unwrap();
    let simulation = simulate(&problem, &truth, 78, 7).unwrap();
    let data = read_dataset(&problem, &simulation.csv());
    let rows = &data.measurements;
    let found = identify(&problem, &data, &Options::default()).unwrap();

    // The true arm should reach the positions that the nominal arm predicts in the held-out
    // configurations.
    let nominal = Arm::nominal(&problem);
    let (mut ws, mut rest) = (Workspace::default(), StaticState::default());
    let mut targets = rows.clone();
    for row in 0..rows.len() {
        let set = &simulation.rows[row].conditions;
        let setup = PoseView {
            payload: set.payload.as_ref(),
            hoist: set.hoist.as_ref(),
            ..PoseView::from_configuration(&set.configuration)
        };
        nominal.equilibrate(&setup, &mut ws, &mut rest).unwrap();
        targets.positions[row] = rest.frame.point(&problem.tool.target);
    }
    let commands = compensate(&problem, &model_of(&problem, rows), &found.x, &targets).unwrap();
    let mut misses = Vec::new();
    for &row in &data.split.held_out {
        let command = &commands[row];
        assert!(command.is_reached(), "row {row}");
        let miss = |configuration: &[f64]| {
            let mut set = simulation.rows[row].conditions.clone();
            set.configuration = configuration.to_vec();
            (simulation.rig.position(&set).unwrap() - targets.positions[row]).norm() * 1e3
        };
        misses.push([miss(rows.configuration(row)), miss(&command.configuration)]);
    }
    let mean = |k: usize| misses.iter().map(|miss| miss[k]).sum::<f64>() / misses.len() as f64;
    println!("{} targets: {:.3} mm before, {:.4} mm after", misses.len(), mean(0), mean(1));
    assert_eq!(misses.len(), 50);
    assert!(mean(0) > 10.0 && mean(1) < 0.2);
}

/// Returns the case's problem with one piece of its text replaced.
fn changed(from: &str, to: &str) -> String {
    let text = fs::read_to_string(case("problem.toml")).unwrap();
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1)
}

#[test]
fn targets_in_another_unit_are_asked_about() {
    let folder = Folder::with_lunar_sampler();
    folder.flexcal("identify . --out out");
    let table = folder.table("a-none.csv");
    let places = ["x_mm", "y_mm", "z_mm"].map(|name| table.place(name));
    let warned = |change: &dyn Fn(usize, f64) -> f64| {
        let rows = table.rows.iter().take(4).map(|row| {
            let mut row = row.clone();
            for (axis, place) in places.into_iter().enumerate() {
                row[place] = change(axis, row[place].parse().unwrap()).to_string();
            }
            row.join(",") + "\n"
        });
        let text = table.columns.join(",") + "\n" + &rows.collect::<String>();
        folder.write("targets.csv", text);
        folder
            .flexcal("compensate . --estimate out/estimate.json --data targets.csv --out c")
            .stderr
    };
    assert!(warned(&|_, x| x / 1e3).contains("with metres instead of the declared millimetres"));
    assert!(!warned(&|_, x| x).contains("where their joint columns lead"));
    // Positions under names that are not read do not turn silently into those of the joints.
    let renamed = |unit: &str| {
        let name = |of: &str| match places.iter().position(|&place| table.columns[place] == of) {
            Some(axis) => format!("{}{unit}", ["X", "Y", "Z"][axis]),
            None => of.to_owned(),
        };
        let header: Vec<String> = table.columns.iter().map(|of| name(of)).collect();
        let rows = table.rows.iter().take(2).map(|row| row.join(",") + "\n");
        folder.write("targets.csv", header.join(",") + "\n" + &rows.collect::<String>());
        folder.flexcal("compensate . --estimate out/estimate.json --data targets.csv --out c")
    };
    let said = renamed(" (in)");
    let map = "write columns = { \"X (in)\" = \"x_in\", \"Y (in)\" = \"y_in\", \"Z (in)\" = \"z_in\" } in [data]";
    assert!(said.stderr.contains(map), "{}", said.stderr);
    assert!(said.stdout.contains("Next: correct the table as the warning says"), "{}", said.stdout);
    assert!(renamed("").stderr.contains("no positions are read"));
    let said = renamed(" (cm)").code(2).stderr;
    assert!(said.contains("convert the numbers: 1 cm is 10 mm"), "{said}");
    assert!(!warned(&|_, x| x).contains("no positions are read"));
    // The estimate had payloads and hoist forces, which an elastic arm needs.
    let kept = |names: &[&str]| {
        let places: Vec<usize> = (0..table.columns.len())
            .filter(|&place| !names.contains(&table.columns[place].as_str()))
            .collect();
        let line = |cells: &Vec<String>| {
            places.iter().map(|&place| cells[place].as_str()).collect::<Vec<_>>().join(",") + "\n"
        };
        let rows: String = table.rows.iter().take(2).map(line).collect();
        folder.write("targets.csv", line(&table.columns) + &rows);
        let command = "compensate . --estimate out/estimate.json --data targets.csv --out c";
        folder.flexcal(command).message()
    };
    let lacks = |names: &[&str]| {
        let message = kept(names);
        ["payload_kg", "hoist_N"].map(|name| message.contains(&format!("has no column {name}")))
    };
    assert_eq!(lacks(&[]), [false, false]);
    assert_eq!(lacks(&["payload_kg"]), [true, false]);
    assert_eq!(lacks(&["payload_kg", "hoist_N"]), [true, true]);
}

#[test]
fn the_digest_is_of_what_predictions_depend_on() {
    let digest = |from, to| parse(&changed(from, to)).digest();
    let unchanged = digest("", "");
    // The digest does not depend on the machine.
    assert_eq!(unchanged, "843194ed2f0f49648c76b13cbc088316658d12dbee573d3f7cbb8807d2c1078b");
    for (from, to) in [
        ("name = \"elbow\"", "name = \"knee\"\nmax_deg = 300"),
        ("a_m = 1.95", "a_mm = 1950"),
        ("position_sigma_mm = 0.05", "position_sigma_mm = 0.5"),
        ("\"tool.*\" = { sigma_mm = 5.0 }", "\"tool.*\" = { sigma_mm = 6.0 }"),
        ("reference_temperature_C = 20.0", "reference_temperature_C = 25.0"),
        ("a-none.csv", "other.csv"),
    ] {
        assert_eq!(digest(from, to), unchanged, "{to}");
    }
    let drift = "[[effect]]\njoint-thermal-drift = { joint = 2 }\n[parameters]";
    let mut seen = vec![unchanged];
    for (from, to) in [
        ("a_m = 1.95", "a_m = 1.950001"),
        ("stiffness_N_m_per_rad = 5.2e4", ""),
        ("mass_kg = 4.2", "mass_kg = 4.3"),
        // Exchanged names exchange the estimates.
        ("name = \"A\"", "name = \"C\""),
        ("beam_elements = 1", "beam_elements = 2"),
        ("-9.80665", "-9.81"),
        ("[tool]\n", "[tool]\npayload_kg = 1\n"),
        ("[parameters]", drift),
    ] {
        seen.push(digest(from, to));
    }
    let warm = changed("[parameters]", drift)
        .replace("reference_temperature_C = 20.0", "reference_temperature_C = 25.0");
    seen.push(parse(&warm).digest());
    let count = seen.len();
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), count);
}

/// Waypoints contain only joint coordinates; effects of other conditions are omitted, with a
/// warning.
#[test]
fn targets_without_what_an_effect_follows_are_reached_without_it() {
    let folder = Folder::with_cases(&["a-none.csv"]);
    let drift = |joint: u32| format!("[[effect]]\njoint-thermal-drift = {{ joint = {joint} }}\n\n");
    let effects = drift(2) + &drift(3) + "[parameters]";
    folder.write("problem.toml", changed("[parameters]", &effects));
    folder.flexcal("identify . --quiet --out .").success();
    folder.write("targets.csv", "q1_deg,q2_deg,q3_deg,q4_deg\n0,10,-40,5\n");
    let run = folder
        .flexcal("compensate . --estimate estimate.json --data targets.csv --out there")
        .success();
    // There is one warning for each of the two effects.
    assert_eq!(
        run.stderr.matches("the commands neglect the effects that depend on it").count(),
        2,
        "{run:?}"
    );
    assert!(folder.has("there/commands.csv"), "{run:?}");
}

#[test]
fn an_estimate_of_another_arm_is_refused() {
    let folder = Folder::with_lunar_sampler();
    folder.flexcal("identify . --quiet --out .").success();
    let few: Vec<String> =
        folder.read("a-none.csv").lines().take(4).map(|line| format!("{line}\n")).collect();
    folder.write("targets.csv", few.concat());
    let compensate =
        || folder.flexcal("compensate . --estimate estimate.json --data targets.csv --out there");
    compensate().success();
    folder.edit("problem.toml", "mass_kg = 4.2", "mass_kg = 4.3");
    let run = compensate().code(2);
    assert_contains(&run.stderr, &["estimate.json: was identified with another declared arm"]);
    // A digest that was removed is missed, but estimates of older versions contain none.
    let mut old = folder.json("estimate.json");
    for key in ["arm_digest", "digest"] {
        assert!(old.as_object_mut().unwrap().remove(key).is_some());
    }
    folder.write("estimate.json", old.to_string());
    assert_contains(&compensate().code(2).stderr, &["estimate.json", "digest"]);
    old["format"]["version"] = 1.into();
    folder.write("estimate.json", old.to_string());
    compensate().success();
}

#[test]
fn limits_are_kept_and_targets_out_of_reach_are_named() {
    let (mut problem, rows) = lunar_sampler();
    problem.joints[1].limits = (-0.2, 0.3);
    let arm = model_of(&problem, &rows);
    let mut targets = rows.clone();
    targets.positions[0] = Vector3::new(9.0, 0.0, 0.0);
    let x = nalgebra::DVector::zeros(arm.parameters.len());
    let commands = compensate(&problem, &arm, &x, &targets).unwrap();
    assert!(!commands[0].is_reached() && commands[0].miss.norm() > 4.0);
    assert!(commands.iter().all(|command| (-0.2..=0.3).contains(&command.configuration[1])));
    // A correction suffices where the shoulder starts well inside its range.
    let inside = commands
        .iter()
        .skip(1)
        .filter(|command| (-0.15..=0.25).contains(&rows.configuration(command.row)[1]));
    let inside: Vec<bool> = inside.map(flexcal::fit::Command::is_reached).collect();
    assert!(inside.len() > 10 && inside.iter().all(|reached| *reached));
}

#[test]
fn redundancy_stays_near_the_seed() {
    let (problem, rows) = lunar_sampler();
    let arm = model_of(&problem, &rows);
    let x = nalgebra::DVector::zeros(arm.parameters.len());
    for command in compensate(&problem, &arm, &x, &rows).unwrap() {
        // With four joints and three coordinates the result is a correction, not another posture.
        let seed = rows.configuration(command.row);
        let step: f64 = command
            .configuration
            .iter()
            .zip(seed)
            .map(|(a, b)| (a - b).powi(2))
            .sum::<f64>()
            .sqrt();
        assert!(command.is_reached() && step < 0.2, "row {}: {step} rad", command.row);
    }
}

#[test]
fn a_joint_that_follows_moves_with_its_leader() {
    // In this palletiser the plate stays level, and one more joint slides as the shoulder turns.
    let text = "name = 'level'\n[[joint]]\nd_m = 0.4\n[[joint]]\nalpha_deg = 90\ntheta_deg = 60\nmin_deg = -60\nmax_deg = 60\n\
                [[joint]]\na_m = 0.6\ntheta_deg = -90\n[[joint]]\na_m = 0.5\nmimic = { joint = 2, ratio = -1 }\n\
                [[joint]]\nkind = 'prismatic'\nmimic = { joint = 3, ratio = 0.1 }\n[tool]\ntarget_m = [0.1, 0.02, 0.05]\n\
                [[effect]]\ngear-ratio = { joint = 2 }\n[parameters]\n'*gear-ratio*' = { free = true }\n";
    let problem = parse(text);
    let rows = read_table(
        &problem,
        "q1_deg,q2_deg,q3_deg,x_m,y_m,z_m\n10,20,-15,0,0,0\n-80,-30,25,0,0,0\n45,55,0,0,0,0\n",
    );
    let arm = model_of(&problem, &rows);
    let all: Vec<usize> = (0..rows.len()).collect();
    let x = nalgebra::DVector::from_element(arm.parameters.len(), 2e-3);
    let mut wanted = rows.clone();
    for configuration in wanted.configurations.chunks_exact_mut(problem.joints.len()) {
        configuration.iter_mut().take(3).for_each(|q| *q += 0.07);
    }
    let mut targets = rows.clone();
    targets.positions = arm.predict(Placement::of(&wanted).poses(&wanted, &all, 1.0), &x);
    for command in compensate(&problem, &arm, &x, &targets).unwrap() {
        assert!(command.is_reached() && command.seed_miss > 0.01, "{command:?}");
        let off = command
            .configuration
            .iter()
            .zip(wanted.configuration(command.row))
            .map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-8, "{command:?}");
    }
    let commands = compensate(&problem, &arm, &x, &targets).unwrap();
    assert!(
        commands_csv(&problem, &targets, &commands, None).starts_with("q1_deg,q2_deg,q3_deg,x_mm")
    );
}

#[test]
fn words_with_a_comma_stay_one_cell() {
    let (problem, rows) = lunar_sampler();
    let mut targets = rows.select(&[0, 1, 2]);
    targets.session.names = vec!["bench \"A\", east".to_owned()];
    let arm = model_of(&problem, &targets);
    let x = nalgebra::DVector::zeros(arm.parameters.len());
    let commands = compensate(&problem, &arm, &x, &targets).unwrap();
    for text in [commands_csv(&problem, &targets, &commands, None), poses_csv(&problem, &targets)] {
        let mut table = csv::Reader::from_reader(text.as_bytes());
        let place = table.headers().unwrap().iter().position(|name| name == "session").unwrap();
        let words: Vec<String> =
            table.records().map(|row| row.unwrap()[place].to_owned()).collect();
        assert_eq!(words, ["bench \"A\", east"; 3], "{text}");
    }
}

#[test]
fn errors_of_the_instrument_are_no_errors_of_the_arm() {
    let text = fs::read_to_string(case("problem.toml")).unwrap();
    let text = text + "\n[[effect]]\ntracker-scale = true\n\n[[effect]]\ntracker-drift = true\n";
    let problem = parse(&text);
    let rows = Measurements::read(&[case("a-none.csv")], &problem).unwrap().0.select(&[3, 40]);
    let model = model_of(&problem, &rows);
    let mut x = nalgebra::DVector::zeros(model.parameters.len());
    let seen =
        |name: &str| model.parameters.iter().position(|parameter| parameter.name == name).unwrap();
    x[seen("joint2.theta")] = 2e-3;
    let arm = x.clone();
    (x[seen("tracker-scale.error")], x[seen("tracker-drift.z")]) = (1e-3, 1e-6);
    let mut reached = rows.clone();
    for command in compensate(&problem, &model, &x, &rows).unwrap() {
        assert!(command.is_reached());
        let n = rows.joints;
        reached.configurations[command.row * n..(command.row + 1) * n]
            .copy_from_slice(&command.configuration);
    }
    let placement = Placement::of(&rows);
    for (target, there) in
        rows.positions.iter().zip(model.predict(placement.poses(&reached, &[0, 1], 1.0), &arm))
    {
        assert!((target - there).norm() < 1e-8, "{} m off", (target - there).norm());
    }
}

#[test]
fn poses_without_a_time_are_taken_at_the_start_of_the_measurements() {
    let folder = Folder::with_lunar_sampler();
    folder.map("problem.toml", |text| format!("{text}\n[[effect]]\ntracker-drift = true\n"));
    let table = folder.table("a-none.csv");
    let place = table.place("time_s");
    let with_dates = |row: &Vec<String>| {
        let mut row = row.clone();
        row[place] = (1_773_219_600.0 + row[place].parse::<f64>().unwrap()).to_string();
        row.join(",")
    };
    let timed: Vec<String> = table.rows.iter().map(with_dates).collect();
    let header = folder.read("a-none.csv").lines().next().unwrap().to_owned();
    folder.write("a-none.csv", format!("{header}\n{}\n", timed.join("\n")));
    folder.flexcal("identify . --out out");
    let header = header.replace("time_s", "note");
    folder.write("poses.csv", format!("{header}\n{}\n", timed.join("\n")));
    let run = folder.flexcal("predict . --estimate out/estimate.json --data poses.csv --out p");
    assert_contains(&run.stderr, &["no column time, and tracker-drift depends on it"]);
    let [found, table] = ["p/predictions.csv", "poses.csv"].map(|name| folder.table(name));
    let [predicted, measured] = [found.numbers("predicted_x_mm"), table.numbers("x_mm")];
    assert!(predicted.iter().zip(&measured).all(|(x, there)| (x - there).abs() < 10.0));
}

#[test]
fn bounds_of_commands_hold_whichever_effect_acts() {
    let folder = Folder::with_lunar_sampler();
    let text = folder.read("problem.toml") + "\n[[effect]]\ntracker-scale = true\n";
    folder.write("problem.toml", text);
    folder.flexcal("identify . --out out");
    let command = "compensate . --estimate out/estimate.json --data a-none.csv --frame measuring --out c --json";
    let alone = folder.flexcal(command);
    assert_contains(&alone.stderr, &["targets are true positions"]);
    let name = alone.json()["problem"].clone();
    let side = |declaration: &str, description: &str, parameter: &str, value: f64| {
        serde_json::json!({
            "declaration": declaration, "description": description, "status": "probable",
            "claims": { "law": { "probability": 0.8 } }, "probability": 0.2,
            "parameters": [{ "name": parameter, "estimate": value }],
        })
    };
    let mut found = side("tracker-scale = true", "the scale is off", "tracker-scale.error", 1e-3);
    let ratio = "gear-ratio = { joint = 1 }";
    found["alternatives"] =
        serde_json::json!([side(ratio, "joint 1 is off", "gear-ratio[1].error", 1e-3)]);
    let written = serde_json::json!({ "problem": name, "effects": [found] });
    folder.write("loop.json", written.to_string());
    let both = folder.flexcal(command);
    let said = "did not decide whether the scale is off or, with 20 %, joint 1 is off: by";
    assert_contains(&both.stderr, &[said]);
    let bound = |run: &Run| run.json()["mean_bound_mm"].as_f64().unwrap();
    // The targets are some metres from the instrument, whose readings err by 1 mm per metre.
    let more = bound(&both) - bound(&alone);
    assert!(more > 0.5, "{more} mm");
    // With a scale that is known to be right, there is nothing to decide.
    let text = folder.read("problem.toml") + "\n[parameters.\"tracker-scale*\"]\nfixed = true\n";
    folder.write("problem.toml", text);
    folder.flexcal("identify . --out out");
    assert!(!folder.flexcal(command).stderr.contains("did not decide"));
}

#[test]
fn without_bounds_no_error_is_promised() {
    let folder = Folder::with_lunar_sampler();
    // Few poses give no bound of predictions.
    folder.keep_marked("a-none.csv", ",identification,", 8);
    folder.flexcal("identify . --out out");
    let run = folder.flexcal(
        "compensate . --estimate out/estimate.json --data a-none.csv --frame measuring --out c",
    );
    assert!(run.status < 2, "{run:?}");
    let unknown = "The expected error of the commands is not known, because the estimate states no uncertainty";
    assert_contains(&run.words(), &[unknown]);
    assert!(!run.stdout.contains(" 0.0000 mm"), "{run:?}");
}
