//! Two arms on one torso, measured on the virtual test rig: fit and loop.

use flexcal::fit::{Options, Placement, compensate, identify, seen_in_base, waypoints};
use flexcal::measurement::{Dataset, Split};
use flexcal::model::Model;
use flexcal::problem::{Observation, Problem};
use flexcal::results::commands_csv;
use flexcal::rig::{Simulation, Truth, simulate};
use flexcal::select::{Verdict, close};
use flexcal::study::table;
use std::path::Path;

use crate::common::arms::{parse, path};
use crate::common::program::assert_contains;
use crate::common::reading::{read_dataset, read_tables};

/// Number of arms that are drawn.
const SEEDS: u64 = 24;

/// Reads the problem and its truth, with a piece of each replaced.
fn two_arms(problem: (&str, &str), truth: (&str, &str)) -> (Problem, Truth) {
    let read = |name: &str, (old, new): (&str, &str)| {
        let text = std::fs::read_to_string(path("problems/two-arms").join(name)).unwrap();
        assert!(text.contains(old), "{old}");
        text.replacen(old, new, 1)
    };
    let declared = parse(&read("problem.toml", problem));
    let truth =
        Truth::parse(&read("TRUTH.toml", truth), Path::new("TRUTH.toml"), &declared).unwrap();
    (declared, truth)
}

fn dataset(simulation: &Simulation) -> Dataset {
    let rows = &simulation.rows;
    let (held_out, identification) = (0..rows.len()).partition(|&row| rows[row].held_out);
    Dataset::new(table(rows), Split { identification, held_out })
}

#[test]
fn the_truth_of_both_arms_comes_back_within_its_standard_errors() {
    let (problem, truth) = two_arms(("", ""), ("", ""));
    let (mut z, mut chi2) = (Vec::new(), Vec::new());
    for seed in 0..SEEDS {
        let simulation = simulate(&problem, &truth, 160, seed).unwrap();
        let found = identify(&problem, &dataset(&simulation), &Options::default()).unwrap();
        assert!(found.is_trusted(), "{:?}", found.findings);
        chi2.push(found.reduced_chi2.unwrap());
        for estimate in &found.estimates {
            let Some(true_value) =
                simulation.parameters.iter().find(|true_value| true_value.name == estimate.name)
            else {
                continue;
            };
            // Waist and base are confounded, and the truth of the waist is not nominal.
            let Some(error) = estimate.std_error.filter(|_| !estimate.name.starts_with("base"))
            else {
                continue;
            };
            let off = if estimate.unit.is_relative() {
                (estimate.estimate / true_value.value).ln() / (error / estimate.estimate)
            } else {
                (estimate.estimate - true_value.value) / error
            };
            z.push(off.abs());
        }
    }
    let share =
        |limit: f64| z.iter().filter(|score| **score < limit).count() as f64 / z.len() as f64;
    let mean = chi2.iter().sum::<f64>() / chi2.len() as f64;
    println!(
        "{} errors: {:.3} within 1 σ, {:.3} within 2 σ; mean χ²/ν {mean:.3}",
        z.len(),
        share(1.0),
        share(2.0)
    );
    // Errors of one fit are correlated: the limits assume about 15 independent ones per fit.
    assert!(
        z.len() > 40 * chi2.len()
            && (share(1.0) - 0.683).abs() < 0.08
            && (share(2.0) - 0.954).abs() < 0.04
    );
    assert!((mean - 1.0).abs() < 0.1);
}

/// The chest is declared rigid: the loads of both arms tilt it, and both hands show it.
#[test]
fn a_torso_that_gives_way_under_both_arms_is_named() {
    let effect =
        "[[effect]]\njoint-compliance = { joint = 2 }\ncompliance_rad_per_N_m = 8.3e-5\n\n[noise]";
    let (problem, truth) = two_arms(("stiffness_N_m_per_rad = 1.2e4\n", ""), ("[noise]", effect));
    let simulation = simulate(&problem, &truth, 120, 3).unwrap();
    let closure = close(&problem, &dataset(&simulation), &Options::default()).unwrap();
    let named: Vec<String> =
        closure.effects.iter().map(|found| found.effect.declaration()).collect();
    assert_eq!(
        (closure.verdict, named),
        (Verdict::Explained, vec!["joint-compliance = { joint = 2 }".to_owned()])
    );
}

#[test]
fn commands_are_corrected_in_the_branch_of_their_target_alone() {
    let (problem, truth) = two_arms(("", ""), ("", ""));
    let simulation = simulate(&problem, &truth, 120, 5).unwrap();
    let data = dataset(&simulation);
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let Placement { bases, targets, .. } = Placement::of(&data.measurements);
    let model = Model::new(&problem, &bases, &targets).unwrap();
    let mut wanted = data.measurements.select(&(0..8).collect::<Vec<_>>());
    // The right wrist exceeds its limit of 100° in rows that measure the left hand.
    for row in (0..8).filter(|&row| simulation.rows[row].target == "left") {
        wanted.configurations[row * 11 + 10] = 115_f64.to_radians();
    }
    let commands = compensate(&problem, &model, &found.x, &wanted).unwrap();
    for command in commands {
        let (row, target) = (&simulation.rows[command.row], &simulation.rows[command.row].target);
        let mut set = row.conditions.clone();
        let others = if target == "left" { 6..11 } else { 2..6 };
        assert_eq!(
            command.configuration[others.clone()],
            wanted.configuration(command.row)[others]
        );
        assert!(command.is_reached(), "{target}: {command:?}");
        set.configuration = command.configuration;
        let (reached, _) = simulation.rig.pose_of(target, &set).unwrap();
        let miss = (reached - wanted.positions[command.row]).norm() * 1e3;
        assert!(miss < 0.2, "{target}: {miss} mm");
    }
}

/// Six moving joints lead to the right hand, five to the left one.
#[test]
fn waypoints_keep_the_orientation_of_the_targets_that_can_have_one() {
    let (mut problem, truth) = two_arms(("", ""), ("", ""));
    problem.joints.iter_mut().for_each(|joint| joint.limits = (f64::NEG_INFINITY, f64::INFINITY));
    let rows = table(&simulate(&problem, &truth, 6, 2).unwrap().rows);
    let Placement { bases, targets, .. } = Placement::of(&rows);
    let model = Model::new(&problem, &bases, &targets).unwrap();
    let x = nalgebra::DVector::from_element(model.parameters.len(), 1e-3);
    let wanted = waypoints(&problem, &model, &x, &rows).unwrap();
    let shown = seen_in_base(&model, &x, &wanted);
    let commands = compensate(&problem, &model, &x, &wanted).unwrap();
    let csv = commands_csv(&problem, &shown, &commands, None);
    let mut cells = csv::Reader::from_reader(csv.as_bytes());
    for (command, cells) in
        commands.iter().zip(cells.deserialize::<std::collections::BTreeMap<String, String>>())
    {
        let (row, cells) = (command.row, cells.unwrap());
        let is_right = cells["target"] == "right";
        assert_eq!(
            (wanted.orientation(row).is_some(), command.turn.is_some()),
            (is_right, is_right),
            "row {row}"
        );
        assert_eq!(
            (cells["rx_deg"].is_empty(), cells["turn_deg"].is_empty()),
            (!is_right, !is_right),
            "{csv}"
        );
        assert!(command.is_reached() && !csv.contains("NaN"), "{command:?}");
    }
    let left: Vec<usize> =
        (0..rows.len()).filter(|&row| wanted.orientation(row).is_none()).collect();
    assert_eq!(left.len(), 3);
    let alone = waypoints(&problem, &model, &x, &rows.select(&left)).unwrap();
    assert_eq!(alone.orientations, None);
}

/// Four nests with a draw wire each.
#[test]
fn each_target_of_a_tree_meets_everything_that_is_measured_against() {
    let anchors = [[1.5, 1.2, 0.1], [0.2, -1.4, 1.3], [-0.9, 1.1, 0.4], [2.1, -0.3, -0.5]];
    let of = |(k, at): (usize, &[f64; 3])| format!("[[anchor]]\nname = \"A{k}\"\nat_m = {at:?}\n");
    let around: String = anchors.iter().enumerate().map(of).collect();
    let declared = format!("{around}[data]\ndistance_sigma_mm = 0.03\ntilt_sigma_deg = 0.002\n");
    let rig = |tilts: &str, rows: usize| {
        let ranges = format!("held_out = 0.4\npositions = 60\n{tilts}");
        let (problem, truth) = two_arms(("[data]\n", &declared), ("held_out = 0.4\n", &ranges));
        let simulation = simulate(&problem, &truth, 60 + rows, 4).unwrap();
        for fixture in 0..anchors.len() {
            for target in ["left", "right"] {
                let met = |row: &&flexcal::rig::Row| {
                    row.target == target && row.observation == Observation::Distance(fixture)
                };
                assert_eq!(
                    simulation.rows.iter().filter(met).count(),
                    20,
                    "{target} and anchor {fixture}"
                );
            }
        }
        let before = &simulation.rows[..60];
        assert!(
            before
                .iter()
                .zip(["left", "right"].iter().cycle())
                .all(|(row, target)| row.target == *target)
        );
        (problem, simulation)
    };
    rig("tilts = [\"tool\"]\n", 200);
    let (problem, simulation) = rig("", 160);
    let data = read_dataset(&problem, &simulation.csv());
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let chi2 = found.reduced_chi2.unwrap();
    assert!(
        found.is_trusted() && (chi2 - 1.0).abs() < 0.25,
        "{:?}, reduced χ² {chi2}",
        found.findings
    );
}

#[test]
fn rows_of_tilts_need_no_target() {
    let declared = "[data]\ntilt_sigma_deg = 0.01\n";
    let (problem, _) = two_arms(("[data]\n", declared), ("", ""));
    let q = "q1_deg,q2_deg,q4_deg,q5_deg,q6_deg,q8_deg,q9_deg,q10_deg,q11_deg";
    let here = "10,5,-60,30,20,-70,10,40,-30";
    let (tilts, both) =
        ("frame,tilt_x_deg,tilt_y_deg", "x_mm,y_mm,z_mm,target,frame,tilt_x_deg,tilt_y_deg");
    let read = |tables: &[String]| -> Result<Vec<String>, String> {
        let tables: Vec<_> = ["0.csv", "1.csv"].into_iter().zip(tables).collect();
        let rows = read_tables(&problem, &tables).map_err(|error| error.to_string())?.0;
        let words = rows.target.unwrap();
        Ok(words.of_row.iter().map(|&word| words.names[word].clone()).collect())
    };
    let alone = format!("{q},{tilts}\n{here},tool,1,2\n");
    let mixed = format!("{q},{both}\n{here},,,,,tool,1,2\n{here},1,2,3,right,,,\n");
    let positions = format!("{q},x_mm,y_mm,z_mm,target\n{here},1,2,3,right\n");
    for (tables, words) in [
        (vec![alone.clone()], vec!["left"]),
        (vec![mixed.clone()], vec!["right", "right"]),
        (vec![positions.clone(), alone.clone()], vec!["right", "right"]),
        (vec![alone.clone(), positions], vec!["right", "right"]),
    ] {
        assert_eq!(
            read(&tables).as_deref(),
            Ok(&words.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>()[..]),
            "{tables:?}"
        );
    }
    for (from, to, wrong) in [
        ("3,right", "3,", "0.csv:3: column target: the cell is empty"),
        ("3,right", "3,lft", "0.csv:3: column target: no target is called \"lft\""),
        (",,,,tool", ",,,lft,tool", "0.csv:2: column target: no target is called \"lft\""),
    ] {
        assert_contains(&read(&[mixed.replace(from, to)]).unwrap_err(), &[wrong]);
    }
    let unnamed = format!("{q},x_mm,y_mm,z_mm,{tilts}\n{here},1,2,3,,,\n");
    let words = "0.csv:2: the rows name no target; each of them measures one of left, right";
    assert_contains(&read(&[unnamed]).unwrap_err(), &[words]);
}
