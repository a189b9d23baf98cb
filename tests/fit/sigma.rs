//! Tests that a wrongly declared σ has no influence: priors and data are weighted by the actual
//! scatter.

use crate::common::arms::lunar_case;
use crate::common::arms::parse;
use flexcal::fit::{Identification, Options, identify};
use flexcal::measurement::{Dataset, Split};
use flexcal::problem::Problem;
use flexcal::report::estimate_text;
use flexcal::rig::{Truth, simulate};
use flexcal::select::{Verdict, close};

/// Reads the lunar sampler with another declared σ [m], and the measurements of a case.
fn case(name: &str, sigma: f64) -> (Problem, Dataset) {
    let (mut problem, data) = lunar_case(&format!("{name}.csv"));
    problem.data.position_sigma = Some(sigma);
    (problem, data)
}

fn fit(name: &str, sigma: f64) -> (Problem, Identification) {
    let (problem, data) = case(name, sigma);
    let found = identify(&problem, &data, &Options::default()).unwrap();
    (problem, found)
}

/// Returns the largest difference of two fits in standard errors of the first, and the largest
/// ratio of standard errors.
fn apart(one: &Identification, other: &Identification) -> (f64, f64) {
    let pairs = one.estimates.iter().zip(&other.estimates);
    let both =
        pairs.filter_map(|(a, b)| Some((a.estimate - b.estimate, a.std_error?, b.std_error?)));
    both.fold((0.0_f64, 1.0_f64), |(far, ratio), (difference, a, b)| {
        (far.max(difference.abs() / a), ratio.max(a / b).max(b / a))
    })
}

#[test]
fn a_sigma_that_fits_is_taken_as_declared() {
    for name in ["a-none", "h-none-large"] {
        let (problem, found) = fit(name, 5e-5);
        assert_eq!((found.noise_factor, found.sigma_scale), (1.0, 1.0), "{name}");
        assert!((found.sigma_taken / 5e-5 - 1.0).abs() < 1e-12, "{name}");
        assert!(
            estimate_text(&problem, &found, None).contains("explains the data to the declared σ")
        );
    }
}

#[test]
fn a_sigma_that_is_wrong_changes_no_estimate() {
    for (name, right) in [
        ("a-none", 5e-5),
        ("h-none-large", 5e-5),
        ("c-link-thermal-bending", 3e-4),
        ("e-payload-mass", 4.5e-4),
    ] {
        let (_, expected) = fit(name, right);
        assert!(
            (0.5..2.0).contains(&expected.reduced_chi2.unwrap()),
            "{name}: {:?}",
            expected.reduced_chi2
        );
        for factor in [0.01, 0.1, 10.0, 100.0] {
            let (problem, found) = fit(name, factor * right);
            let (far, ratio) = apart(&expected, &found);
            // The scatter is known to about 10 %.
            assert!(far < 0.4 && ratio < 1.3, "{name} × {factor}: {far} σ, {ratio}");
            assert!(
                (found.sigma_taken / right - 1.0).abs() < 0.25,
                "{name} × {factor}: {}",
                found.sigma_taken
            );
            let chi2 = found.reduced_chi2.unwrap();
            assert!(
                (chi2 * factor * factor / expected.reduced_chi2.unwrap() - 1.0).abs() < 0.2,
                "{name}: {chi2}"
            );
            let text = estimate_text(&problem, &found, None).replace('\n', " ");
            let cause = if factor > 1.0 { "is too large" } else { "the model lacks something" };
            assert!(text.contains(cause) && text.contains("if only noise is left"), "{text}");
        }
    }
}

#[test]
fn a_sigma_of_each_row_is_raised_by_the_model_s_error() {
    let (problem, mut data) = case("c-link-thermal-bending", 5e-5);
    let rows = data.measurements.len();
    let all = (0..rows).map(|row| if row % 2 == 0 { 5e-5 } else { 5e-7 }).collect();
    data.measurements.sigma = Some(all);
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let (_, alike) = fit("c-link-thermal-bending", 5e-5);
    // Half of the rows do not dominate the others: the model error is the same for all.
    assert!(apart(&alike, &found).0 < 0.5, "{:?}", apart(&alike, &found));
}

/// Truth for which the loop once reported a scale error of the tracker in noise.
const TRUTH: &str = "[random]
'joint*' = { sigma_deg = 0.1, sigma_mm = 1 }
'tool.*' = { sigma_mm = 1 }
[noise]
position_sigma_mm = 0.05
[poses]
q1_deg = [-150, 150]
q2_deg = [-120, 0]
q3_deg = [-120, 120]
q4_deg = [-150, 150]
q5_deg = [-150, 150]
q6_deg = [-180, 180]
identification = 60
";

/// Returns the problem of an elbow arm with a declared σ [mm].
pub fn elbow(sigma: f64) -> String {
    format!(
        "name = 'elbow'\n[[joint]]\nd_m = 0.1273\n[[joint]]\nalpha_deg = 90\n[[joint]]\na_m = -0.612\n[[joint]]\n\
         a_m = -0.5723\nd_m = 0.163941\n[[joint]]\nalpha_deg = 90\nd_m = 0.1157\n[[joint]]\nalpha_deg = -90\n\
         d_m = 0.0922\n[tool]\ntarget_m = [0.03, 0.02, 0.109]\n[parameters]\n'joint*' = {{ sigma_deg = 0.5, sigma_mm = 3 }}\n\
         'tool.*' = {{ sigma_mm = 3 }}\n[data]\nposition_sigma_mm = {sigma}\n"
    )
}

/// Simulates its measurements on the rig, with noise of 0.05 mm.
pub fn simulated(seed: u64) -> Dataset {
    let problem = parse(&elbow(0.05));
    let truth = Truth::parse(TRUTH, std::path::Path::new("truth.toml"), &problem).unwrap();
    let rows = simulate(&problem, &truth, 110, seed).unwrap().rows;
    let (held_out, identification) = (0..rows.len()).partition(|&row| rows[row].held_out);
    Dataset::new(flexcal::study::table(&rows), Split { identification, held_out })
}

#[test]
fn a_sigma_too_large_makes_the_loop_invent_nothing() {
    for seed in [2, 4] {
        let data = simulated(seed);
        for factor in [1.0, 10.0, 100.0] {
            let closed = close(&parse(&elbow(0.05 * factor)), &data, &Options::default()).unwrap();
            assert_eq!(
                closed.verdict,
                Verdict::NothingFound,
                "seed {seed} × {factor}: {:?}",
                closed.effects
            );
            let size = closed.residual_tests.tests.first().unwrap();
            assert_eq!(size.to_string().contains("overstated"), factor > 1.0, "{size}");
        }
    }
}
