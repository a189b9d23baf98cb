//! An identification as data: estimates by name, covariance, correlations, predictions, residuals.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]

mod common;

use common::arms::path;
use flexcal::identify::{Identification, IdentifyError, Options, identify};
use flexcal::measurement::Dataset;
use flexcal::nalgebra::Vector3;
use flexcal::problem::Problem;
use flexcal::report::estimate_json;
use serde_json::Value;

fn lunar() -> (Problem, Dataset, Identification) {
    let problem = Problem::read(&path("problems/lunar-sampler")).unwrap();
    let (data, _) = Dataset::read(&problem).unwrap();
    let found = identify(&problem, &data, &Options::default()).unwrap();
    (problem, data, found)
}

#[test]
fn the_covariance_is_that_of_the_standard_errors() {
    let (problem, _, found) = lunar();
    let json: Value = serde_json::from_str(&estimate_json(&problem, &found)).unwrap();
    for (k, estimate) in found.estimates.iter().enumerate() {
        let told = &json["covariance"][k];
        assert_eq!(told.as_array().unwrap().len(), found.estimates.len());
        let Some(error) = estimate.std_error else {
            assert!(told.as_array().unwrap().iter().all(Value::is_null), "{}", estimate.name);
            continue;
        };
        let variance = found.covariance.of(k, k).unwrap();
        assert!((variance / error.powi(2) - 1.0).abs() < 1e-12, "{}: {variance} and {error}", estimate.name);
        assert_eq!(told[k].as_f64(), Some(variance));
    }
    let matrix = &found.covariance.matrix;
    assert!((matrix - matrix.transpose()).amax() <= 1e-12 * matrix.amax());
    assert!(found.covariance.correlation().symmetric_eigenvalues().min() > -1e-9, "positive semidefinite");
}

#[test]
fn an_active_constraint_is_in_the_correlations() {
    // Two rigidities held in their order: both are one number.
    let text = std::fs::read_to_string(path("tests/cases/problem.toml")).unwrap();
    let text = text + "\n[[constraint]]\nterms = { 'A.EI' = 1.0, 'B.EI' = -1.0 }\nat_most = 0.0\n";
    let problem = Problem::parse(&text, &path("tests/cases/problem.toml")).unwrap();
    let (data, _) = Dataset::read_files(&[path("tests/cases/a-none.csv")], &problem).unwrap();
    let found = identify(&problem, &data, &Options::default()).unwrap();
    assert_eq!(found.active_constraints.len(), 1);
    let all = found.correlations();
    let place = |name: &str| all.names.iter().position(|own| own == name).unwrap();
    assert!(all.matrix[(place("A.EI"), place("B.EI"))] > 0.999_999);
    assert!(found.strong_correlations().iter().any(|(a, b, rho)| a == "A.EI" && b == "B.EI" && *rho > 0.999_999));
}

#[test]
fn predictions_are_measurements_less_residuals() {
    let (problem, data, found) = lunar();
    let residuals = found.residuals(&problem, &data).unwrap();
    let predicted = found.predict(&problem, &data.measurements).unwrap();
    assert_eq!(residuals.len(), 78);
    let sigma = problem.data.position_sigma.unwrap();
    let mut squares = 0.0;
    for (residual, predicted) in residuals.iter().zip(&predicted) {
        let measured = data.measurements.positions[residual.row];
        assert!((measured - predicted - residual.position).norm() < 1e-15);
        assert!((residual.whitened * sigma - residual.position).norm() < 1e-15);
        assert_eq!(residual.held_out, data.split.held_out.contains(&residual.row));
        squares += if residual.held_out { residual.position.norm_squared() } else { 0.0 };
    }
    assert!(((squares / 50.0).sqrt() / found.fitted.held_out.rms.norm - 1.0).abs() < 1e-12);
    // The same poses as plain arrays.
    let rows = &data.measurements;
    let poses = Dataset::poses((0..rows.len()).map(|row| rows.configuration(row)));
    let poses = poses.payload(rows.payload.clone().unwrap()).hoist(rows.hoist.clone().unwrap()).time(rows.time.clone());
    let poses = match &rows.temperature {
        Some(temperature) => poses.temperature(temperature.clone()),
        None => poses,
    };
    let again = found.predict(&problem, &poses.measurements().unwrap()).unwrap();
    let furthest = again.iter().zip(&predicted).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(furthest < 1e-12, "{furthest} m");
}

#[test]
fn what_was_not_identified_predicts_nothing() {
    let (mut problem, data, mut found) = lunar();
    assert!(found.estimate("joint2.stiffness").is_some() && found.estimate("joint9.stiffness").is_none());
    let gone = found.estimates.iter().position(|estimate| estimate.name == "joint2.stiffness").unwrap();
    found.estimates[gone].name = "another".to_owned();
    let error = found.predict(&problem, &data.measurements).unwrap_err();
    assert!(matches!(&error, IdentifyError::NoEstimate { name } if name == "joint2.stiffness"), "{error}");
    // Nor does a problem that lacks what was identified.
    found.estimates[gone].name = "joint2.stiffness".to_owned();
    assert!(found.predict(&problem, &data.measurements).is_ok());
    problem.parameters.clear();
    let error = found.predict(&problem, &data.measurements).unwrap_err();
    assert!(matches!(&error, IdentifyError::NotInModel { name } if name == "joint1.alpha"), "{error}");
}

#[test]
fn time_counts_from_the_first_pose_that_was_identified() {
    let (problem, data, _) = lunar();
    let problem = problem.with_effect(flexcal::problem::Effect::TrackerDrift);
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let late: Vec<usize> = (data.measurements.len() / 2..data.measurements.len()).collect();
    let (whole, half) = (&data.measurements, data.measurements.select(&late));
    let (all, some) = (found.predict(&problem, whole).unwrap(), found.predict(&problem, &half).unwrap());
    for (position, &row) in some.iter().zip(&late) {
        let apart: Vector3<f64> = position - all[row];
        assert!(apart.norm() < 1e-12, "{apart}");
    }
}

#[test]
fn configurations_of_another_arm_are_an_error() {
    let (problem, _, found) = lunar();
    let few = Dataset::builder([[0.1, 0.2], [0.3, 0.4]], [Vector3::x(), Vector3::y()]).build().unwrap();
    let wrong = |error: IdentifyError| matches!(error, IdentifyError::JointCount { found: 2, joints: 4 });
    assert!(identify(&problem, &few, &Options::default()).is_err_and(wrong));
    assert!(found.predict(&problem, &few.measurements).is_err_and(wrong));
}
