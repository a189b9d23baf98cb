//! Unidentifiable combinations: fixed while unidentifiable, released once identifiable, never
//! reported as known.

use crate::common::arms::{measured as read, parse, path, with_parameters};
use crate::common::made::{at_random, divided, labels, measure, model_of, split_at};
use flexcal::fit::{Estimate, FindingCode, Identification, Options, Strategy, identify};
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const SIGMA: f64 = 5e-5;

/// Returns an arm with two parallel axes, whose offsets the nominal arm cannot separate.
fn parallel(free: &str) -> Problem {
    parse(&format!(
        "name = 'parallel'\n[[joint]]\nd_m = 0.3\n[[joint]]\nalpha_deg = 90\nd_m = 0.1\n[[joint]]\na_m = 0.5\nd_m = 0.05\n\
         [tool]\ntarget_m = [0.1, 0.02, -0.03]\n[parameters]\n{free}\n[data]\nposition_sigma_mm = 0.05\n"
    ))
}

fn estimate<'a>(found: &'a Identification, name: &str) -> &'a Estimate {
    found.estimate(name).unwrap()
}

/// Simulates ninety noisy poses of the arm with these deviations, sixty for identification.
fn measured(problem: &Problem, truth: &[(&str, f64)]) -> Dataset {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut rows = at_random(problem, 90, 2.0, &mut rng);
    let parameters = model_of(problem, &rows).parameters;
    let deviation =
        |name: &str| truth.iter().find(|(known, _)| *known == name).map_or(0.0, |(_, x)| *x);
    let x = DVector::from_iterator(parameters.len(), parameters.iter().map(|p| deviation(&p.name)));
    measure(problem, &mut rows, &x, SIGMA, &mut rng);
    divided(60, &rows)
}

#[test]
fn what_is_blind_at_nominal_is_fitted_once_it_is_seen() {
    let free = "'joint2.d' = { free = true }\n'joint3.d' = { free = true }\n'joint3.alpha' = { free = true }";
    let problem = parallel(free);
    let truth = [("joint2.d", 0.02), ("joint3.d", -0.02), ("joint3.alpha", 2.0_f64.to_radians())];
    let data = measured(&problem, &truth);
    let found = identify(&problem, &data, &Options::default()).unwrap();
    assert_eq!(found.identifiability().rank, 2);
    assert!(
        found.is_trusted() && found.reduced_chi2.unwrap() < 1.4,
        "χ²/ν {:?}",
        found.reduced_chi2
    );
    for (name, deviation) in truth {
        let estimate = estimate(&found, name);
        let miss = estimate.estimate - estimate.nominal - deviation;
        assert!(miss.abs() < 4.0 * estimate.std_error.unwrap(), "{name}: {miss:e} {estimate:?}");
    }
}

#[test]
fn a_bound_that_cuts_a_blind_combination_leaves_the_rest_of_it_free() {
    let problem =
        parallel("'joint2.d' = { min_mm = -0.5, max_mm = 0.5 }\n'joint3.d' = { free = true }");
    let data = measured(&problem, &[("joint2.d", 0.0005), ("joint3.d", 0.0035)]);
    let found = identify(&problem, &data, &Options::default()).unwrap();
    assert!(found.reduced_chi2.unwrap() < 1.4, "χ²/ν {:?}", found.reduced_chi2);
    let sum: f64 = ["joint2.d", "joint3.d"]
        .iter()
        .map(|name| estimate(&found, name))
        .map(|e| e.estimate - e.nominal)
        .sum();
    assert!((sum - 0.004).abs() < 5.0 * SIGMA / 60.0_f64.sqrt(), "{sum}");
    if let Some(error) = estimate(&found, "joint3.d").std_error {
        assert!(error > 0.1 * SIGMA / 60.0_f64.sqrt(), "± {error:e}");
    }
}

#[test]
fn parameters_of_a_blind_combination_have_no_error_of_their_own() {
    let problem = parallel(
        "'joint2.d' = { free = true }\n'joint3.d' = { free = true }\n'joint3.a' = { free = true }",
    );
    let data = measured(&problem, &[("joint2.d", 0.001)]);
    let found = identify(&problem, &data, &Options::default()).unwrap();
    for name in ["joint2.d", "joint3.d"] {
        let estimate = estimate(&found, name);
        assert!(
            estimate.std_error.is_none() && (estimate.identified - 0.5).abs() < 1e-6,
            "{estimate:?}"
        );
    }
    assert!(estimate(&found, "joint3.a").std_error.unwrap() < SIGMA);
}

#[test]
fn a_session_with_too_few_poses_is_named() {
    let problem = parallel("'joint3.a' = { free = true }\n'base.*' = { free = true }");
    let mut data = measured(&problem, &[("joint3.a", 0.001)]);
    data.measurements.session = labels((0..90).map(|row| if row == 75 { "B" } else { "A" }));
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let few = found.finding(FindingCode::HeldOutBaseNotDetermined).unwrap();
    assert!(found.is_trusted(), "{:?}", found.findings);
    assert_eq!(few.word("of"), Some("base[B]"));
    assert!(few.text.contains("3 measured coordinates for 6 parameters"), "{few}");
}

#[test]
fn an_arm_that_misses_is_not_trusted() {
    let problem = parallel("'joint3.a' = { sigma_mm = 5 }\n'joint3.theta' = { sigma_deg = 1 }");
    let mut data = measured(&problem, &[("joint3.a", 0.001)]);
    for q in data.measurements.configurations.iter_mut().skip(1).step_by(3) {
        *q = -*q;
    }
    let found = identify(&problem, &data, &Options::default()).unwrap();
    assert!(found.has(FindingCode::MissesMeasurements), "{:?}", found.findings);
}

#[test]
fn a_mirrored_arm_is_not_trusted() {
    let problem = parallel("'joint*.alpha' = { sigma_deg = 0.2 }\n'base.*' = { free = true }");
    let mut data = measured(&problem, &[("joint3.alpha", 0.001)]);
    for position in &mut data.measurements.positions {
        position.swap_rows(0, 1);
    }
    let found = identify(&problem, &data, &Options::default()).unwrap();
    assert!(found.first_error().is_some());
}

#[test]
fn a_wave_may_go_far_beyond_its_prior_and_an_angle_of_the_arm_may_not() {
    let declared = |rules: &str| {
        let free = format!("'joint3.a' = {{ sigma_mm = 5 }}\n{rules}");
        parallel(&format!("{free}\n[[effect]]\njoint-harmonic = {{ joint = 3, orders = [2] }}"))
    };
    let find = |rules: &str, truth: &str, size: f64| {
        let problem = declared(rules);
        let data = measured(&problem, &[(truth, size)]);
        identify(&problem, &data, &Options::default())
            .unwrap()
            .first_error()
            .map(|error| error.code)
    };
    assert_eq!(
        find("'joint-harmonic.*' = { sigma_deg = 0.01 }", "joint-harmonic[3].sin2", 0.02),
        None
    );
    let angle = find("'joint3.alpha' = { sigma_deg = 0.01 }", "joint3.alpha", 0.02);
    assert_eq!(angle, Some(FindingCode::BeyondPrior));
}

#[test]
fn stage_by_stage_settles_on_two_hundred_poses() {
    let problem = Problem::read(&path("tests/cases/problem.toml")).unwrap();
    let rows = read(&problem, &["tests/cases/h-none-large.csv"]);
    let data = Dataset::from_measurements(&problem, rows).unwrap();
    let options = Options::default().with_strategy(Strategy::Sequential);
    let found = identify(&problem, &data, &options).unwrap();
    assert!(found.is_trusted());
    assert!(
        found.fitted.identification.rms.norm < 0.0865e-3,
        "{}",
        found.fitted.identification.rms.norm
    );
}

#[test]
fn everything_free_and_no_prior_converges() {
    let problem = with_parameters(
        "tests/cases/problem.toml",
        "'joint*' = { free = true }\n'tool.*' = { free = true }",
    );
    let rows = read(&problem, &["tests/cases/h-none-large.csv"]);
    let data = Dataset::from_measurements(&problem, rows).unwrap();
    let found = identify(&problem, &data, &Options::default()).unwrap();
    assert!(found.is_trusted() && found.identifiability().rank < found.unknowns.len());
    assert!(found.fitted.held_out.rms.norm < 0.2e-3);
}

#[test]
fn a_constraint_that_cuts_a_blind_combination_does_what_the_bound_does() {
    let free = "'joint2.d' = { free = true }\n'joint3.d' = { free = true }";
    let bounded = parallel("'joint2.d' = { min_mm = 2 }\n'joint3.d' = { free = true }");
    let constraint = "[[constraint]]\nterms = { 'joint2.d' = 1.0 }\nat_least_mm = 102";
    let constrained = parallel(&format!("{free}\n{constraint}"));
    let data = measured(&parallel(free), &[("joint2.d", -0.003)]);
    let find = |problem: &Problem| identify(problem, &data, &Options::default()).unwrap();
    let (by_bound, by_constraint) = (find(&bounded), find(&constrained));
    assert!(by_constraint.reduced_chi2.unwrap() < 1.4, "χ²/ν {:?}", by_constraint.reduced_chi2);
    assert!((&by_bound.x - &by_constraint.x).amax() < 1e-8);
}

#[test]
fn base_and_tool_of_a_held_out_session_count_together() {
    let problem = parallel(
        "'joint3.a' = { free = true }\n'base.*' = { free = true }\n'tool.*' = { free = true }",
    );
    let mut data = measured(&problem, &[]);
    data.measurements.session = labels((0..90).map(|row| if row >= 88 { "B" } else { "A" }));
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let few = found.finding(FindingCode::HeldOutBaseNotDetermined).unwrap();
    assert_eq!(few.word("of"), Some("base[B]"));
    assert!(few.text.contains("6 measured coordinates for 9 parameters"), "{few}");
}

#[test]
fn two_points_do_not_turn_a_base() {
    let problem = parallel("'base.*' = { free = true }");
    let mut data = measured(&problem, &[]);
    data.split = split_at(2, &data.measurements);
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let turned: f64 = ["base.rx", "base.ry", "base.rz"]
        .iter()
        .map(|name| estimate(&found, name).estimate.abs())
        .sum();
    assert!(turned < 0.01 && !found.identifiability().unidentifiable.is_empty(), "{turned} rad");
}
