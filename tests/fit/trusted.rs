//! Fits that the data refute are not passed on: bounds along unidentifiable directions, priors and
//! noise that the data contradict, held-out rows, orientations, planar arms, and reversed joints.

use std::path::Path;

use flexcal::fit::{FindingCode, Identification, Misreading, Options, identify};
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use nalgebra::{DVector, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::common::arms::parse;
use crate::common::made::{at_random, divided, measure, model_of};
use crate::judged::{PRIORS, SIGMA, measured, text};

fn fit(problem: &Problem, data: &Dataset) -> Identification {
    identify(problem, data, &Options::default()).unwrap()
}

/// Simulates noisy poses of the arm with these deviations, the first `fitted` for identification.
fn simulated(problem: &Problem, truth: &[(&str, f64)], poses: [usize; 2], seed: u64) -> Dataset {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut rows = at_random(problem, poses[0] + poses[1], 2.0, &mut rng);
    let parameters = model_of(problem, &rows).parameters;
    let deviation = |name: &str| truth.iter().find(|own| own.0 == name).map_or(0.0, |own| own.1);
    let x = DVector::from_iterator(parameters.len(), parameters.iter().map(|p| deviation(&p.name)));
    measure(problem, &mut rows, &x, SIGMA, &mut rng);
    divided(poses[0], &rows)
}

#[test]
fn a_bound_along_an_unidentifiable_direction_gives_its_partner_no_certainty() {
    // Axes 2 and 3 are parallel: only joint2.d + joint3.d moves the target.
    let problem = parse(&text(
        "'joint2.d' = { min_mm = -1, max_mm = 1 }\n'joint3.d' = { min_mm = -5, max_mm = 5 }",
    ));
    let truth = [("joint2.d", 0.2e-3), ("joint3.d", 3e-3)];
    let found = fit(&problem, &simulated(&problem, &truth, [60, 30], 1));
    assert!(found.estimate("joint2.d").unwrap().at_bound.is_some());
    let finding = found.finding(FindingCode::BoundInUnidentifiedDirection).unwrap();
    assert_eq!(finding.word("parameter"), Some("joint2.d"), "{finding}");
    let partner = found.estimate("joint3.d").unwrap();
    let error = (partner.estimate - partner.nominal - 3e-3).abs();
    let sigma = partner.std_error.unwrap();
    assert!(error < 3.0 * sigma && sigma > 3e-4, "{error} {sigma}");
    assert!(partner.identified < 0.5, "{}", partner.identified);
    // The sum is as certain as before.
    let rows = Dataset::poses([[0.3; 5]]).build().unwrap().measurements;
    let predicted = found.predict_with_covariance(&problem, &rows).unwrap();
    assert!(predicted[0].covariance.trace().sqrt() < SIGMA, "{}", predicted[0].covariance);
}

#[test]
fn a_bound_that_the_data_press_against_hides_nothing() {
    let problem =
        parse(&text("'joint3.a' = { min_mm = -1, max_mm = 1 }\n'tool.x' = { free = true }"));
    let found = fit(&problem, &simulated(&problem, &[("joint3.a", 2e-3)], [60, 30], 2));
    assert!(found.estimate("joint3.a").unwrap().at_bound.is_some());
    assert!(!found.has(FindingCode::BoundInUnidentifiedDirection), "{:?}", found.findings);
}

#[test]
fn priors_that_are_a_thousand_times_too_narrow_are_named_and_not_trusted() {
    let problem = parse(&text(
        "'joint*.a' = { sigma_mm = 0.002 }\n'joint*.alpha' = { sigma_deg = 0.3 }\n'joint*.d' = { sigma_mm = 2 }\n\
         'joint*.theta' = { sigma_deg = 0.3 }\n'tool.*' = { sigma_mm = 2 }",
    ));
    let truth = [("joint2.a", 2.5e-3), ("joint3.a", -3e-3), ("joint4.a", 1.5e-3)];
    let found = fit(&problem, &simulated(&problem, &truth, [60, 30], 3));
    let finding = found.finding(FindingCode::PriorContradicted).unwrap();
    assert!(!found.is_trusted());
    assert_eq!(finding.word("rule"), Some("joint*.a"), "{finding}");
    assert!(finding.number("factor").unwrap() >= 100.0, "{finding}");
}

#[test]
fn priors_that_hold_are_not_questioned_where_the_model_lacks_something() {
    let problem = parse(&text(PRIORS));
    let mut data = measured(&problem, 4);
    for row in 0..90 {
        let q = data.measurements.configuration(row)[1];
        data.measurements.positions[row].z += 4e-4 * (5.0 * q).sin();
    }
    let found = fit(&problem, &data);
    assert!(found.noise_factor > 4.0 && found.is_trusted(), "{:?}", found.findings);
}

#[test]
fn a_sigma_declared_in_another_unit_is_named() {
    let declared = text(PRIORS).replace("position_sigma_mm = 0.05", "position_sigma_mm = 0.00005");
    let found = fit(&parse(&declared), &measured(&parse(&text(PRIORS)), 5));
    let finding = found.finding(FindingCode::NoiseBeyondDeclared).unwrap();
    assert!(finding.remedy.contains("another unit") && !found.is_trusted(), "{finding}");
}

#[test]
fn held_out_rows_contradict_a_fit_that_does_not_predict_them() {
    let problem = parse(&text(PRIORS));
    let clean = measured(&problem, 6);
    assert!(!fit(&problem, &clean).has(FindingCode::HeldOutBeyondPrediction));
    let mut moved = clean;
    moved.measurements.positions[60..].iter_mut().for_each(|own| own.z += 2.5 * SIGMA);
    let found = fit(&problem, &moved);
    assert!(found.has(FindingCode::HeldOutBeyondPrediction), "{:?}", found.findings);
}

#[test]
fn a_fit_of_few_poses_that_makes_a_true_arm_worse_says_so() {
    let wide = text("'joint*' = { sigma_deg = 2, sigma_mm = 50 }\n'tool.*' = { sigma_mm = 50 }");
    let problem = parse(&wide);
    let found = fit(&problem, &simulated(&problem, &[], [9, 60], 7));
    assert!(found.fitted.held_out.rms.norm > found.registered.held_out.rms.norm);
    let codes = [FindingCode::HeldOutNotBetter, FindingCode::HeldOutWorse];
    assert!(codes.into_iter().any(|code| found.has(code)), "{:?}", found.findings);
}

#[test]
fn a_coordinate_that_no_parameter_moves_counts_in_no_degree_of_freedom() {
    let planar = "name = 'planar'\n[[joint]]\n[[joint]]\na_m = 0.32\n[tool]\ntarget_m = [0.22, 0, 0.1]\n[parameters]\n\
                  'joint1.theta' = { free = true }\n'joint2.a' = { free = true }\n'joint2.theta' = { free = true }\n'tool.x' = { free = true }\n[data]\n";
    let problem = Problem::parse(planar, Path::new("problem.toml")).unwrap();
    let mut squares = 0.0;
    for seed in 0..20 {
        let mut data = simulated(&problem, &[], [40, 10], seed);
        data.measurements.positions.iter_mut().for_each(|own| own.z = 0.1);
        let found = fit(&problem, &data);
        squares += (found.sigma_taken / SIGMA).powi(2) / 20.0;
    }
    assert!((0.9..1.1).contains(&squares), "{squares}");
}

#[test]
fn every_reversed_joint_is_named() {
    let problem = parse(&format!("{}\n", text(&format!("{PRIORS}\n'base.*' = {{ free = true }}"))));
    let mut data = measured(&problem, 8);
    let reversed = [1, 2, 4];
    for (k, q) in data.measurements.configurations.iter_mut().enumerate() {
        if reversed.contains(&(k % 5 + 1)) {
            *q = -*q;
        }
    }
    let found = fit(&problem, &data);
    let far = found.finding(FindingCode::NominalFarOff).unwrap();
    let words = Misreading::reversed(&reversed).to_string();
    assert!(far.to_string().contains(&words), "{far}");
}

#[test]
fn orientations_in_another_convention_are_not_trusted_and_it_is_named() {
    let oriented = text("'joint*' = { sigma_deg = 0.3, sigma_mm = 2 }\n'tool.*' = { free = true }")
        + "orientation_sigma_deg = 0.02\n";
    let problem = parse(&oriented);
    let mut data = simulated(&problem, &[("joint2.alpha", 2e-3)], [60, 30], 9);
    let model = model_of(&problem, &data.measurements);
    let rows: Vec<usize> = (0..90).collect();
    let poses =
        flexcal::fit::Placement::of(&data.measurements).poses(&data.measurements, &rows, 1.0);
    let zero = DVector::zeros(model.parameters.len());
    let turns = model.orientations(&poses, zero.as_slice());
    let true_turns: Vec<UnitQuaternion<f64>> =
        turns.into_iter().map(UnitQuaternion::from_scaled_axis).collect();
    data.measurements.orientations = Some(true_turns.clone());
    assert!(!fit(&problem, &data).has(FindingCode::OrientationMisfit));
    // Angles of R = Rz Ry Rx, read as rotation vectors.
    let misread = |turn: &UnitQuaternion<f64>| {
        let (x, y, z) = turn.euler_angles();
        UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z))
    };
    data.measurements.orientations = Some(true_turns.iter().map(misread).collect());
    let found = fit(&problem, &data);
    let finding = found.finding(FindingCode::OrientationMisfit).unwrap();
    assert!(!found.is_trusted() && finding.remedy.contains("R = Rz Ry Rx"), "{finding}");
}
