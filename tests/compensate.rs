//! Commands that bring the arm to where it should be, tried on the virtual rig.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

use std::fs;
use std::path::{Path, PathBuf};

use flexcal::arm::{Arm, Equilibrated, Setup, Workspace};
use flexcal::measurement::{Measurements, Split};
use flexcal::model::Model;
use flexcal::problem::Problem;
use flexcal::rig::{Truth, simulate};
use flexcal::study::{Options, Placement, compensate, identify};
use nalgebra::Vector3;

fn case(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/cases").join(name)
}

/// Measurements from CSV text, as the problem reads them.
fn measured(text: &str, problem: &Problem) -> Measurements {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("measurements.csv");
    fs::write(&file, text).unwrap();
    Measurements::read(&[file], problem).unwrap().0
}

fn model(problem: &Problem, rows: &Measurements) -> Model {
    let placement = Placement::of(rows);
    Model::new(problem, &placement.bases, &placement.targets).unwrap()
}

#[test]
fn fifty_targets_are_reached_after_twenty_eight_noisy_poses() {
    let problem = Problem::read(&case("problem.toml")).unwrap();
    let truth = Truth::read(&case("truth.toml"), &problem).unwrap();
    let simulation = simulate(&problem, &truth, 78, 7).unwrap();
    let rows = measured(&simulation.csv(), &problem);
    let split = Split::new(&problem, &rows).unwrap();
    let found = identify(&problem, &rows, &split, &Options::default()).unwrap();

    // Where the nominal arm would be in the held-out configurations is where the true arm should be.
    let nominal = Arm::nominal(&problem);
    let (mut ws, mut rest) = (Workspace::default(), Equilibrated::default());
    let mut targets = rows.clone();
    for row in 0..rows.len() {
        let set = &simulation.rows[row].conditions;
        let setup = Setup { payload: set.payload, hoist: set.hoist, ..Setup::of(&set.configuration) };
        nominal.equilibrate(&setup, &mut ws, &mut rest).unwrap();
        targets.positions[row] = rest.frame.point(&problem.tool.target);
    }
    let commands = compensate(&problem, &model(&problem, &rows), &found.x, &targets).unwrap();
    let mut misses = Vec::new();
    for &row in &split.held_out {
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

#[test]
fn limits_are_kept_and_targets_out_of_reach_are_named() {
    let mut problem = Problem::read(&case("problem.toml")).unwrap();
    problem.joints[1].limits = (-0.2, 0.3);
    let rows = Measurements::read(&[case("a-none.csv")], &problem).unwrap().0;
    let arm = model(&problem, &rows);
    let mut targets = rows.clone();
    targets.positions[0] = Vector3::new(9.0, 0.0, 0.0);
    let x = nalgebra::DVector::zeros(arm.parameters.len());
    let commands = compensate(&problem, &arm, &x, &targets).unwrap();
    assert!(!commands[0].is_reached() && commands[0].miss.norm() > 4.0);
    assert!(commands.iter().all(|command| (-0.2..=0.3).contains(&command.configuration[1])));
    // Where the shoulder starts well inside its range, a correction is enough.
    let inside = commands.iter().skip(1).filter(|command| (-0.15..=0.25).contains(&rows.configuration(command.row)[1]));
    let inside: Vec<bool> = inside.map(flexcal::study::Command::is_reached).collect();
    assert!(inside.len() > 10 && inside.iter().all(|reached| *reached));
}

#[test]
fn redundancy_stays_near_the_seed() {
    let problem = Problem::read(&case("problem.toml")).unwrap();
    let rows = Measurements::read(&[case("a-none.csv")], &problem).unwrap().0;
    let arm = model(&problem, &rows);
    let x = nalgebra::DVector::zeros(arm.parameters.len());
    for command in compensate(&problem, &arm, &x, &rows).unwrap() {
        // Four joints and three coordinates: the way is a correction, not another posture.
        let seed = rows.configuration(command.row);
        let step: f64 = command.configuration.iter().zip(seed).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
        assert!(command.is_reached() && step < 0.2, "row {}: {step} rad", command.row);
    }
}
