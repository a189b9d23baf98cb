//! Identification as data: estimates by name, covariance, correlations, predictions, residuals.

use std::fmt::Write as _;
use std::path::Path;

use flexcal::fit::{
    Identification, IdentifyError, Options, SavedEstimate, SavedEstimateError, identify, predict,
};
use flexcal::measurement::Dataset;
use flexcal::nalgebra::Vector3;
use flexcal::problem::Problem;
use flexcal::results::{Document as _, IdentificationResult};
use serde_json::Value;

use crate::common::arms::{parse, path};
use crate::common::program::{Folder, assert_contains, number};

fn lunar() -> (Problem, Dataset, Identification) {
    let problem = Problem::read(&path("problems/lunar-sampler")).unwrap();
    let (data, _) = Dataset::read(&problem).unwrap();
    let found = identify(&problem, &data, &Options::default()).unwrap();
    (problem, data, found)
}

#[test]
fn the_covariance_is_that_of_the_standard_errors() {
    let (problem, _, found) = lunar();
    let json: Value =
        serde_json::from_str(&IdentificationResult::new(&problem, &found).to_json()).unwrap();
    for (k, estimate) in found.estimates.iter().enumerate() {
        let told = &json["covariance"][k];
        assert_eq!(told.as_array().unwrap().len(), found.estimates.len());
        let Some(error) = estimate.std_error else {
            assert!(told.as_array().unwrap().iter().all(Value::is_null), "{}", estimate.name);
            continue;
        };
        let variance = found.covariance.entry(k, k).unwrap();
        assert!(
            (variance / error.powi(2) - 1.0).abs() < 1e-12,
            "{}: {variance} and {error}",
            estimate.name
        );
        assert_eq!(told[k].as_f64(), Some(variance));
    }
    let matrix = &found.covariance.matrix;
    assert!((matrix - matrix.transpose()).amax() <= 1e-12 * matrix.amax());
    assert!(
        found.covariance.correlation().symmetric_eigenvalues().min() > -1e-9,
        "positive semidefinite"
    );
}

#[test]
fn an_active_constraint_is_in_the_correlations() {
    // Two rigidities whose order binds have the same value.
    let text = std::fs::read_to_string(path("tests/cases/problem.toml")).unwrap();
    let text = text + "\n[[constraint]]\nterms = { 'A.EI' = 1.0, 'B.EI' = -1.0 }\nat_most = 0.0\n";
    let problem = Problem::parse(&text, &path("tests/cases/problem.toml")).unwrap();
    let (data, _) = Dataset::read_files(&[path("tests/cases/a-none.csv")], &problem).unwrap();
    let found = identify(&problem, &data, &Options::default()).unwrap();
    assert_eq!(found.active_constraints.len(), 1);
    let all = found.correlations();
    let place = |name: &str| all.names.iter().position(|other| other == name).unwrap();
    assert!(all.matrix[(place("A.EI"), place("B.EI"))] > 0.999_999);
    assert!(
        found
            .strong_correlations()
            .iter()
            .any(|(a, b, rho)| a == "A.EI" && b == "B.EI" && *rho > 0.999_999)
    );
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
    // The same poses are given as arrays.
    let rows = &data.measurements;
    let poses = Dataset::poses((0..rows.len()).map(|row| rows.configuration(row)));
    let poses = poses
        .payload(rows.payload.clone().unwrap())
        .hoist(rows.hoist.clone().unwrap())
        .time(rows.time.clone());
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
    assert!(
        found.estimate("joint2.stiffness").is_some()
            && found.estimate("joint9.stiffness").is_none()
    );
    let gone =
        found.estimates.iter().position(|estimate| estimate.name == "joint2.stiffness").unwrap();
    found.estimates[gone].name = "another".to_owned();
    let error = found.predict(&problem, &data.measurements).unwrap_err();
    assert!(
        matches!(&error, IdentifyError::NoEstimate { name } if name == "joint2.stiffness"),
        "{error}"
    );
    // A problem that lacks an identified parameter predicts nothing, either.
    found.estimates[gone].name = "joint2.stiffness".to_owned();
    assert!(found.predict(&problem, &data.measurements).is_ok());
    problem.parameters.clear();
    let error = found.predict(&problem, &data.measurements).unwrap_err();
    assert!(
        matches!(&error, IdentifyError::NotInModel { name } if name == "joint1.alpha"),
        "{error}"
    );
}

#[test]
fn time_counts_from_the_first_pose_that_was_identified() {
    let (problem, data, _) = lunar();
    let problem = problem.with_effect(flexcal::problem::Effect::TrackerDrift);
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let late: Vec<usize> = (data.measurements.len() / 2..data.measurements.len()).collect();
    let (whole, half) = (&data.measurements, data.measurements.select(&late));
    let (all, some) =
        (found.predict(&problem, whole).unwrap(), found.predict(&problem, &half).unwrap());
    for (position, &row) in some.iter().zip(&late) {
        let apart: Vector3<f64> = position - all[row];
        assert!(apart.norm() < 1e-12, "{apart}");
    }
}

#[test]
fn configurations_of_another_arm_are_an_error() {
    let (problem, _, found) = lunar();
    let few =
        Dataset::builder([[0.1, 0.2], [0.3, 0.4]], [Vector3::x(), Vector3::y()]).build().unwrap();
    let wrong =
        |error: IdentifyError| matches!(error, IdentifyError::JointCount { found: 2, joints: 4 });
    assert!(identify(&problem, &few, &Options::default()).is_err_and(wrong));
    assert!(found.predict(&problem, &few.measurements).is_err_and(wrong));
}

#[test]
fn a_saved_estimate_predicts_what_the_fit_predicts() {
    let (problem, data, found) = lunar();
    let json = IdentificationResult::new(&problem, &found).to_json();
    let saved = SavedEstimate::parse(&json, Path::new("estimate.json")).unwrap();
    let again = predict(&problem, Some(&saved), &data.measurements, Some(&data.split)).unwrap();
    let (published, residuals) =
        (found.predict(&problem, &data.measurements).unwrap(), again.residuals.unwrap());
    for ((one, other), residual) in published.iter().zip(&again.positions).zip(&residuals) {
        assert!((one - other).norm() < 1e-12, "{one}{other}");
        assert_eq!(residual.held_out, data.split.held_out.contains(&residual.row));
    }
    // Rows without positions are predicted but not compared.
    let rows = &data.measurements;
    let bare =
        Dataset::poses((0..rows.len()).map(|row| rows.configuration(row))).measurements().unwrap();
    let bare = predict(&problem, Some(&saved), &bare, None).unwrap();
    assert!(
        bare.residuals.is_none() && bare.errors.is_none() && bare.positions.len() == rows.len()
    );
    // Without an estimate the nominal arm predicts.
    let nominal = predict(&problem, None, rows, None).unwrap().errors.unwrap();
    let (identification, other) = (&found.registered.identification, &found.registered.held_out);
    let registered = (28.0 * identification.mean.norm + 50.0 * other.mean.norm) / 78.0;
    assert!(
        (nominal.all.mean.norm / registered - 1.0).abs() < 0.1,
        "{}, registered {registered}",
        nominal.all.mean.norm
    );
    // An estimate of another arm is refused.
    let other = Problem { gravity: Vector3::zeros(), ..problem.clone() };
    let error = predict(&other, Some(&saved), rows, None).unwrap_err();
    let expected =
        matches!(error, flexcal::fit::PredictError::Estimate(SavedEstimateError::OtherArm { .. }));
    assert!(expected, "{error}");
}

/// Returns a rigid arm of three joints and the tables of two sessions with different bases; session
/// B has a gross error.
fn two_sessions() -> Folder {
    let problem = "name = 'arm'\n[[joint]]\nd_m = 0.4\n[[joint]]\nalpha_deg = 90\n[[joint]]\na_m = 0.6\n\
                   [tool]\ntarget_m = [0.5, 0.1, 0.0]\n[parameters]\n'joint3.a' = { sigma_mm = 3 }\n'base.*' = { free = true }\n\
                   'tool.*' = { sigma_mm = 1 }\n[data]\nposition_sigma_mm = 0.02\nheld_out = { fraction = 0.3 }\n";
    let folder = Folder::with([("problem.toml", problem)]);
    let arm = parse(problem);
    for (session, shift) in [("A", 0.0), ("B", 100.0)] {
        let configurations: Vec<[f64; 3]> =
            (0..40).map(|k| [1.7, 2.3, 3.1].map(|step| f64::from(k) * step % 2.0 - 1.0)).collect();
        let poses = Dataset::poses(&configurations).measurements().unwrap();
        let truth = predict(&arm, None, &poses, None).unwrap().positions;
        let mut table = "session,target,pose,q1_rad,q2_rad,q3_rad,x_mm,y_mm,z_mm\n".to_owned();
        for (k, (q, p)) in configurations.iter().zip(&truth).enumerate() {
            let off = if session == "B" && k == 7 { 0.6 } else { 0.01 * (k as f64).sin() };
            let [x, y, z] = [p.x * 1e3 + shift + off, p.y * 1e3 - 2.0 * shift, p.z * 1e3];
            writeln!(table, "{session},ball,{k},{},{},{},{x},{y},{z}", q[0], q[1], q[2]).unwrap();
        }
        folder.write(format!("{session}.csv"), table);
    }
    folder
}

#[test]
fn an_estimate_applies_to_another_session_without_a_refit() {
    let folder = two_sessions();
    folder.flexcal("identify problem.toml --quiet --out fit --data A.csv").success();
    let predict = "predict problem.toml --estimate fit/estimate.json";
    let run = folder.flexcal(&format!("{predict} --out there --data A.csv B.csv")).success();
    assert_contains(&run.stdout, &["Fitted to these rows, with the arm held: base[B].x"]);
    let errors = folder.json("there/errors.json");
    assert_eq!([&errors["all"]["n"], &errors["sessions"]["B"]["n"]], [80, 40]);
    let max = |session: &str| number(&errors["sessions"][session]["max_mm"]["norm"]);
    assert!(max("A") < 0.1 && (max("B") - 0.6).abs() < 0.2, "{errors}");
    let residuals = folder.read("there/residuals.csv");
    let (header, rows) = residuals.split_once('\n').unwrap();
    let expected = "file,line,pose,session,target,q1_deg,q2_deg,q3_deg,predicted_x_mm,predicted_y_mm,predicted_z_mm,\
                    residual_x_mm,residual_y_mm,residual_z_mm,whitened,outlier,held_out";
    assert_eq!(header, expected);
    let outliers: Vec<&str> =
        rows.lines().filter(|line| line.split(',').rev().nth(1) == Some("true")).collect();
    assert!(
        matches!(outliers[..], [line] if line.starts_with("B.csv,9,7,B,ball,")),
        "{outliers:?}"
    );
    assert!(
        folder
            .read("there/predictions.csv")
            .starts_with("file,line,pose,session,target,q1_deg,q2_deg,q3_deg,predicted_x_mm,")
    );
    assert_eq!(folder.table("fit/residuals.csv").rows.len(), 40);
    // Without measurements the base of a new session is unknown.
    let bare = |line: &str| line.splitn(7, ',').take(6).collect::<Vec<_>>().join(",") + "\n";
    folder.write("bare.csv", folder.read("B.csv").lines().map(bare).collect::<String>());
    let run = folder.flexcal(&format!("{predict} --out bare --data bare.csv")).code(2);
    assert_contains(
        &run.stderr,
        &["session \"B\" of the table was not identified; identified are \"A\""],
    );
    assert!(!folder.has("bare"));
}
