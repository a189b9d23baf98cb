//! Two arms on one torso, measured on the virtual test rig: what a fit and the loop make of it.

use flexcal::diagnose::{Verdict, close};
use flexcal::identify::{Options, Placement, compensate, identify};
use flexcal::measurement::{Dataset, Split};
use flexcal::model::Model;
use flexcal::monte_carlo::table;
use flexcal::problem::Problem;
use flexcal::simulate::{Simulation, Truth, simulate};
use std::path::Path;

use crate::common::arms::{parse, path};

/// Arms that are drawn.
const SEEDS: u64 = 24;

/// The problem and its truth, with a piece of each exchanged.
fn two_arms(problem: (&str, &str), truth: (&str, &str)) -> (Problem, Truth) {
    let read = |name: &str, (old, new): (&str, &str)| {
        let text = std::fs::read_to_string(path("problems/two-arms").join(name)).unwrap();
        assert!(text.contains(old), "{old}");
        text.replacen(old, new, 1)
    };
    let declared = parse(&read("problem.toml", problem));
    let truth = Truth::parse(&read("TRUTH.toml", truth), Path::new("TRUTH.toml"), &declared).unwrap();
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
        assert!(found.is_trusted(), "{:?}", found.quality_flag);
        chi2.push(found.reduced_chi2.unwrap());
        for estimate in &found.estimates {
            let Some(own) = simulation.parameters.iter().find(|own| own.name == estimate.name) else { continue };
            // Waist and base say the same, and the truth of the waist is not nominal.
            let Some(error) = estimate.std_error.filter(|_| !estimate.name.starts_with("base")) else { continue };
            let off = if estimate.unit.is_relative() {
                (estimate.estimate / own.value).ln() / (error / estimate.estimate)
            } else {
                (estimate.estimate - own.value) / error
            };
            z.push(off.abs());
        }
    }
    let share = |limit: f64| z.iter().filter(|own| **own < limit).count() as f64 / z.len() as f64;
    let mean = chi2.iter().sum::<f64>() / chi2.len() as f64;
    println!("{} errors: {:.3} within 1 σ, {:.3} within 2 σ; mean χ²/ν {mean:.3}", z.len(), share(1.0), share(2.0));
    // Errors of one fit hang together: the limits are those of some 15 independent ones a fit.
    assert!(z.len() > 40 * chi2.len() && (share(1.0) - 0.683).abs() < 0.08 && (share(2.0) - 0.954).abs() < 0.04);
    assert!((mean - 1.0).abs() < 0.1);
}

/// The chest is declared rigid: the loads of both arms lean it, and both hands show it.
#[test]
fn a_torso_that_gives_way_under_both_arms_is_named() {
    let effect = "[[effect]]\njoint-compliance = { joint = 2 }\ncompliance_rad_per_N_m = 8.3e-5\n\n[noise]";
    let (problem, truth) = two_arms(("stiffness_N_m_per_rad = 1.2e4\n", ""), ("[noise]", effect));
    let simulation = simulate(&problem, &truth, 120, 3).unwrap();
    let closure = close(&problem, &dataset(&simulation), &Options::default()).unwrap();
    let named: Vec<String> = closure.effects.iter().map(|found| found.effect.declaration()).collect();
    assert_eq!((closure.verdict, named), (Verdict::Explained, vec!["joint-compliance = { joint = 2 }".to_owned()]));
}

#[test]
fn commands_are_corrected_in_the_branch_of_their_target_alone() {
    let (problem, truth) = two_arms(("", ""), ("", ""));
    let simulation = simulate(&problem, &truth, 120, 5).unwrap();
    let data = dataset(&simulation);
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let Placement { bases, targets, .. } = Placement::of(&data.measurements);
    let model = Model::new(&problem, &bases, &targets).unwrap();
    let wanted = data.measurements.select(&(0..8).collect::<Vec<_>>());
    let commands = compensate(&problem, &model, &found.x, &wanted).unwrap();
    for command in commands {
        let (row, target) = (&simulation.rows[command.row], &simulation.rows[command.row].target);
        let mut set = row.conditions.clone();
        let others = if target == "left" { 6..11 } else { 2..6 };
        assert_eq!(command.configuration[others.clone()], set.configuration[others]);
        set.configuration = command.configuration;
        let (reached, _) = simulation.rig.pose_of(target, &set).unwrap();
        let miss = (reached - wanted.positions[command.row]).norm() * 1e3;
        assert!(miss < 0.2, "{target}: {miss} mm");
    }
}
