//! What commands and predictions state of their errors.

use crate::common::program::{Folder, assert_contains};

/// A rigid arm of three joints, whose base and last length are free, and what its poses look like.
const THREE_JOINTS: [&str; 2] = [
    "name = 'three'\n[[joint]]\nd_m = 0.4\n[[joint]]\nalpha_deg = -90\n[[joint]]\na_m = 0.6\n\
     [tool]\ntarget_m = [0.5, 0, 0.1]\n[parameters]\n'*' = { fixed = true }\n\
     'base.*' = { sigma_mm = 5, sigma_deg = 1 }\n'joint3.a' = { sigma_mm = 1 }\n[data]\nfiles = ['rows.csv']\n\
     position_sigma_mm = 0.02\nheld_out = 'none'\nreference_temperature_C = 20\n",
    "[noise]\nposition_sigma_mm = 0.02\n[poses]\nq1_deg = [-150, 150]\nq2_deg = [-60, 60]\nq3_deg = [30, 100]\n\
     temperature_C = [20, 40]\ntime_step_s = 60\n",
];

/// Reading of a position \[mm\] at a temperature above the reference \[K\] and a time \[s\].
type Error = fn([f64; 3], f64, f64) -> [f64; 3];

#[test]
fn errors_of_the_instrument_are_named_and_bounded_in_commands() {
    let folder = Folder::with([("problem.toml", THREE_JOINTS[0]), ("truth.toml", THREE_JOINTS[1])]);
    folder.simulate(".", "truth.toml", 24, 1, "plain.csv");
    let table = folder.table("plain.csv");
    let places = ["x_mm", "y_mm", "z_mm"].map(|name| table.place(name));
    let law = |at: &str| format!("law = {{ name = 'l', at = '{at}', terms = ['T'] }}");
    let (settling, shift) =
        ("tracker-settling = { time_constant_s = 300 }", "station-shift = { at_time_s = 700 }");
    let move_ = "station-move = { at_time_s = 700 }";
    // Each effect with its name on the screen, what to do if the arm moves by it, and how readings
    // err.
    let along_z: Error = |[x, y, z], kelvin, _| [x, y, z + 0.02 * kelvin];
    let from_700: Error = |[x, y, z], _, t| [x, y, z + if t < 700.0 { 0.0 } else { 0.3 }];
    let cases: [(String, &str, &str, Error); 8] = [
        (law("base.z"), "", "", along_z),
        (law("measurement.z"), "the law l at measurement.z", "declare it at base.z", along_z),
        (law("measurement.range"), "the law l at measurement.range", "where the arm errs", {
            |p, kelvin, _| {
                p.map(|x| x * (1.0 + 2e-2 * kelvin / p.map(|x| x * x).iter().sum::<f64>().sqrt()))
            }
        }),
        ("tracker-scale = true".into(), "tracker-scale", "a certified length", |p, _, _| {
            p.map(|x| 1.0005 * x)
        }),
        ("tracker-drift = true".into(), "tracker-drift", "declare laws of t at base.x", {
            |[x, y, z], _, t| [x, y, z + 3e-4 * t]
        }),
        (settling.into(), "tracker-settling", "declare laws of exp(-t/τ)", |[x, y, z], _, t| {
            [x, y, z + 0.5 * (1.0 - (-t / 300.0).exp())]
        }),
        (shift.into(), "station-shift", "a session of their own", from_700),
        (move_.into(), "station-move", "a session of their own", |[x, y, z], _, t| {
            if t < 700.0 { [x, y, z] } else { [x - 4e-4 * y, y + 4e-4 * x, z + 0.2] }
        }),
    ];
    for (effect, name, instead, reads) in cases {
        let kind = effect.split(' ').next().unwrap_or_default();
        let free = format!("'{kind}*' = {{ free = true }}\n[data]");
        let arm = THREE_JOINTS[0].replace("[data]", &free);
        folder.write("problem.toml", format!("{arm}\n[[effect]]\n{effect}\n"));
        let [kelvin, time] = ["temperature_C", "time_s"].map(|column| table.numbers(column));
        let rows = table.rows.iter().enumerate().map(|(k, row)| {
            let mut row = row.clone();
            let position = places.map(|place| row[place].parse().unwrap());
            let read = reads(position, kelvin[k] - 20.0, time[k]);
            places.iter().zip(read).for_each(|(&place, x)| row[place] = x.to_string());
            row.join(",") + "\n"
        });
        let text = table.columns.join(",") + "\n" + &rows.collect::<String>();
        folder.write("rows.csv", text);
        folder.flexcal("identify . --out out").success();
        let commands = folder
            .flexcal("compensate . --estimate out/estimate.json --data plain.csv --out out --json");
        let predict = "predict . --estimate out/estimate.json --data out/commands.csv --out p";
        let predicted = folder.flexcal(predict).success();
        assert!(!predicted.words().contains("contradict the estimate"), "{effect}: {predicted:?}");
        let result = commands.json();
        let miss = folder.json("p/errors.json")["all"]["rms_mm"]["norm"].as_f64().unwrap();
        if name.is_empty() {
            assert!(miss < 1e-3 && result["uncorrected"] == serde_json::json!([]), "{miss} mm");
            assert!(!commands.stderr.contains("true positions"), "{commands:?}");
            continue;
        }
        // A scale is told from the lengths of the arm, which the problem holds.
        let is_scale = name == "tracker-scale";
        let cover =
            if is_scale { "the bound does not cover that" } else { "the bound covers both" };
        let said = [&format!("true positions: {name} ("), instead, cover];
        assert_contains(&commands.stderr, &said);
        assert_contains(&predicted.stderr, &["true positions of the model itself"]);
        let stated = result["uncorrected"][0]["rms_mm"].as_f64().unwrap();
        assert!(miss > 0.1 && (stated - miss).abs() < 1e-3, "{effect}: {stated} and {miss} mm");
        if is_scale {
            continue;
        }
        let bounds = folder.table("out/commands.csv").numbers("bound95_mm");
        let residuals = folder.table("p/residuals.csv");
        let along = ["x", "y", "z"].map(|axis| residuals.numbers(&format!("residual_{axis}_mm")));
        let miss = |row: usize| along.iter().map(|of| of[row] * of[row]).sum::<f64>().sqrt();
        assert!(bounds.iter().enumerate().all(|(row, bound)| *bound > miss(row)), "{effect}");
        assert!(result["expected_error_mm"].as_f64().unwrap() > stated, "{effect}");
    }
}

/// The arm with an effect at joint 3, and the truth with the same.
fn with_effect(effect: &str, truth: &str) -> [String; 2] {
    let kind = effect.split(' ').next().unwrap_or_default();
    let arm = THREE_JOINTS[0].replace("[data]", &format!("'{kind}*' = {{ free = true }}\n[data]"));
    [format!("{arm}[[effect]]\n{effect}\n"), format!("{}{truth}\n", THREE_JOINTS[1])]
}

#[test]
fn targets_without_directions_of_approach_have_wider_bounds() {
    let play = "backlash = { joint = 3 }";
    let friction = "joint-hysteresis = { joint = 3, distance_rad = 0.2 }";
    let law = "law = { name = 'l', at = 'joint3', terms = ['approach3'], sigma_deg = 0.1 }";
    // Each effect with the table of the truth, and whether rows to fit have the columns.
    let cases = [
        (play, "[[effect]]\nbacklash = { joint = 3 }\nwidth_deg = 0.1", true),
        (law, "[[effect]]\nbacklash = { joint = 3 }\nwidth_deg = 0.1", true),
        (
            friction,
            "[[effect]]\njoint-hysteresis = { joint = 3, distance_rad = 0.2 }\namplitude_deg = 0.05",
            false,
        ),
    ];
    for (effect, truth, has_sides) in cases {
        let [arm, truth] = with_effect(effect, truth);
        let truth =
            if has_sides { truth } else { truth.replace("[poses]", "[poses]\napproach = false") };
        let folder = Folder::with([("problem.toml", arm.as_str()), ("truth.toml", truth.as_str())]);
        folder.simulate(".", "truth.toml", 60, 1, "rows.csv");
        let without = |name: &str, columns: &[&str]| {
            let table = folder.table("rows.csv");
            let kept: Vec<usize> = (0..table.columns.len())
                .filter(|&k| !columns.contains(&&*table.columns[k]))
                .collect();
            let line = |row: &[String]| {
                kept.iter().map(|&k| row[k].clone()).collect::<Vec<_>>().join(",") + "\n"
            };
            let rows: String = table.rows.iter().map(|row| line(row)).collect();
            folder.write(name, line(&table.columns) + &rows);
        };
        let sides = ["approach1", "approach2", "approach3"];
        without("targets.csv", &[sides.as_slice(), &["time_s"]].concat());
        folder.flexcal("identify . --out out").success();
        let run = "compensate . --estimate out/estimate.json --data targets.csv --out out --json";
        let commands = folder.flexcal(run);
        let said = ["approach3", "1 or -1", "the bound covers both"];
        assert_contains(&commands.stderr, &said);
        let result = commands.json();
        let half = result["uncorrected"][0]["rms_mm"].as_f64().unwrap();
        assert!((0.3..1.1).contains(&half), "{effect}: {half} mm");
        // What the half widths are is covered, and nothing is said where the column states it.
        let bounds = folder.table("out/commands.csv").numbers("bound95_mm");
        let table = folder.table("targets.csv");
        let header = table.columns.join(",") + ",approach1,approach2,approach3\n";
        let rows = table.rows.iter().map(|row| row.join(",") + ",1,1,-1\n");
        folder.write("sides.csv", header + &rows.collect::<String>());
        let run = "compensate . --estimate out/estimate.json --data sides.csv --out known --json";
        let known = folder.flexcal(run);
        assert!(!known.stderr.contains("the middle"), "{effect}: {known:?}");
        let narrow = folder.table("known/commands.csv").numbers("bound95_mm");
        let mean = |of: &[f64]| of.iter().sum::<f64>() / of.len() as f64;
        assert!(mean(&bounds) > mean(&narrow) + 0.9 * half, "{effect}: {bounds:?}");
        let predict = "predict . --estimate out/estimate.json --data targets.csv --out p";
        let predicted = folder.flexcal(predict).success();
        if has_sides {
            // A test for changes takes the unknown sides for no change.
            let watch = "watch . --estimate out/estimate.json --data targets.csv --out w";
            let watched = folder.flexcal(watch).success();
            assert_contains(&watched.stderr, &["approach3", "the test allows for both"]);
            let code = "export . --estimate out/estimate.json --format c --out code --force";
            folder.flexcal(code).success();
            let model = folder.read("code/flexcal_model.c");
            assert_contains(&model, &["#define HAS_APPROACH 1", "has_approach = HAS_APPROACH;"]);
            assert_contains(&predicted.stderr, &said);
            let bounds = folder.table("p/predictions.csv").numbers("bound95_mm");
            assert!(mean(&bounds) > mean(&narrow) + 0.9 * half, "{effect}: {bounds:?}");
        }
    }
}

#[test]
fn estimates_that_do_not_state_directions_of_approach_are_named() {
    let truth = "[[effect]]\nbacklash = { joint = 3 }\nwidth_deg = 0.1";
    let [arm, truth] = with_effect("backlash = { joint = 3 }", truth);
    let truth = truth.replace("[poses]", "[poses]\napproach = false");
    let arm =
        arm.replace("a_m = 0.6\n", "a_m = 0.6\nbody = [{ mass_kg = 5, com_m = [0.2, 0, 0] }]\n");
    let folder = Folder::with([("problem.toml", arm.as_str()), ("truth.toml", truth.as_str())]);
    folder.simulate(".", "truth.toml", 40, 1, "rows.csv");
    folder.flexcal("identify . --out out");
    for command in ["compensate", "predict", "watch"] {
        let run = format!("{command} . --estimate out/estimate.json --data rows.csv --trust");
        let said =
            |out: &str| folder.flexcal(&format!("{run} --out {command}{out} --force")).stderr;
        let stated = said("1");
        assert!(!stated.contains("an older version"), "{command}: {stated}");
        folder.edit("out/estimate.json", "\"has_approach\": false,", "");
        let older = said("2");
        assert_eq!(older.matches("an older version").count(), 1, "{command}: {older}");
        assert_contains(&older, &["backlash 3", "identify again"]);
        folder.map("out/estimate.json", |text| text.replacen('{', "{\"has_approach\": false,", 1));
    }
}

#[test]
fn held_out_rows_widen_bounds_that_they_contradict() {
    let held_out = "held_out = { fraction = 0.4, seed = 2 }";
    let arm = THREE_JOINTS[0].replace("held_out = 'none'", held_out);
    let folder = Folder::with([("problem.toml", arm.as_str()), ("truth.toml", THREE_JOINTS[1])]);
    folder.simulate(".", "truth.toml", 40, 3, "rows.csv");
    let targets = folder.read("rows.csv");
    folder.write("targets.csv", targets);
    let fit = || {
        let run = folder.flexcal("identify . --out out --force");
        let applied = "compensate . --estimate out/estimate.json --data targets.csv --out out";
        let commands = folder.flexcal(&format!("{applied} --force")).words();
        let bounds = folder.table("out/commands.csv").numbers("bound95_mm");
        (run.words(), commands, bounds.iter().sum::<f64>() / bounds.len() as f64)
    };
    let (sound, commands, bound) = fit();
    assert!(bound < 0.1 && !sound.contains("widened"), "{bound} mm: {sound}");
    assert!(!commands.contains("Structure remains"), "{commands}");
    // The rows that are held out err by ten times as much as the fitted ones.
    let residuals = folder.table("out/residuals.csv");
    let is_held_out = residuals.column("held_out");
    let z = folder.table("rows.csv").place("z_mm");
    folder.map_rows("rows.csv", |row, line| {
        let mut cells: Vec<String> = line.split(',').map(str::to_owned).collect();
        if is_held_out[row - 2] == "true" {
            let sign = if row % 2 == 0 { 0.3 } else { -0.3 };
            cells[z] = (cells[z].parse::<f64>().unwrap() + sign).to_string();
        }
        Some(cells.join(","))
    });
    let (said, _, bound) = fit();
    assert!(bound > 0.3, "{bound} mm");
    assert_contains(&said, &["exceed their own bound", "widened by the factor"]);
}

#[test]
fn a_misfit_beyond_the_declared_noise_is_said_beside_the_bound() {
    let arm = THREE_JOINTS[0].replace("position_sigma_mm = 0.02", "position_sigma_mm = 0.012");
    let folder = Folder::with([("problem.toml", arm.as_str()), ("truth.toml", THREE_JOINTS[1])]);
    folder.simulate(".", "truth.toml", 40, 3, "rows.csv");
    folder.flexcal("identify . --out out");
    let applied = "compensate . --estimate out/estimate.json --data rows.csv --out out";
    let said = folder.flexcal(applied).words();
    assert_contains(
        &said,
        &["Structure remains", "the bound does not hold for what the model lacks"],
    );
}
