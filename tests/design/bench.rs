//! Shared fixtures of the design tests.

use std::path::Path;

use flexcal::fit::{Identification, Options, identify};
use flexcal::measurement::{Dataset, Measurements, Split};
use flexcal::problem::{PoseConditions, PoseRanges, Problem};
use flexcal::rig::{Rig, Truth, simulate};
use nalgebra::{DVector, Vector3};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;

use super::common::arms::{parse, path};
use super::common::made::{model_of, normal};

/// Returns the lunar sampler and the truth of the test rig.
pub fn lunar() -> (Problem, Truth) {
    let problem = Problem::read(&path("tests/cases")).unwrap();
    let truth = Truth::read(Path::new(&path("tests/cases/truth.toml")), &problem).unwrap();
    (problem, truth)
}

/// Returns the lunar sampler with fitted orientations.
pub fn oriented() -> Problem {
    let text = std::fs::read_to_string(path("tests/cases/problem.toml")).unwrap();
    let text = text.replace(
        "\"tool.*\" = { sigma_mm = 5.0 }",
        "\"tool.*\" = { sigma_mm = 5.0, sigma_deg = 1.0 }",
    );
    let text = text.replace(
        "position_sigma_mm = 0.05",
        "position_sigma_mm = 0.05\norientation_sigma_deg = 0.005",
    );
    let problem = parse(&text);
    assert!(problem.data.fits_orientation);
    problem
}

/// Returns the ranges of joints, payload and hoist from which the test rig draws.
pub fn ranges(truth: &Truth) -> PoseRanges {
    PoseRanges { temperature: None, approach: false, ..truth.poses.clone() }
}

/// Fits every row; the same rows are also held out.
pub fn fit(problem: &Problem, rows: &Measurements) -> Identification {
    let all: Vec<usize> = (0..rows.len()).collect();
    let split = Split { identification: all.clone(), held_out: all };
    identify(problem, &Dataset::new(rows.clone(), split), &Options::default()).unwrap()
}

/// Draws a true arm on the test rig, and its deviations from nominal in the model's parameters.
pub fn true_arm(
    problem: &Problem,
    truth: &Truth,
    rows: &Measurements,
    seed: u64,
) -> (Rig, DVector<f64>) {
    let simulation = simulate(problem, truth, 1, seed).unwrap();
    let value = |name: &str| {
        // One EI in the model is an EIy and an EIz on the rig; the first is used for both.
        let known = simulation
            .parameters
            .iter()
            .find(|p| p.name == name || (name.ends_with("EI") && p.name.starts_with(name)));
        known.map(|parameter| parameter.value)
    };
    let x = model_of(problem, rows).parameter_vector(value).unwrap();
    (simulation.rig, x)
}

/// Measures every row on the rig, with noise of 1 σ = `sigma` [m].
pub fn measure(rig: &Rig, rows: &mut Measurements, sigma: f64, seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    for row in 0..rows.len() {
        let at = |column: &Option<Vec<f64>>| column.as_ref().map(|values| values[row]);
        let conditions = PoseConditions {
            configuration: rows.configuration(row).to_vec(),
            payload: at(&rows.payload),
            hoist: at(&rows.hoist),
            ..PoseConditions::default()
        };
        let noise = Vector3::from_fn(|_, _| sigma * normal(&mut random));
        rows.positions[row] = rig.position(&conditions).unwrap() + noise;
    }
}

/// Returns the root mean square of entry `k`.
pub fn rms(errors: &[DVector<f64>], k: usize) -> f64 {
    (errors.iter().map(|error| error[k] * error[k]).sum::<f64>() / errors.len() as f64).sqrt()
}
