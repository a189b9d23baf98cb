//! Bounded estimates: weakly determined combinations are fixed and named, and no trusted parameter
//! leaves the size of the arm.

use crate::common::arms::parse;
use crate::common::made::{at_random, divided, draw, measure, model_of};
use flexcal::fit::{FindingCode, Identification, Options, SolverChoice, identify};
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use flexcal::quantity::Unit;
use flexcal::report::estimate_text;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

const SIGMA: f64 = 5e-5;
pub const PRIORS: &str = "'joint*.alpha' = { sigma_deg = 0.5 }
'joint*.a' = { sigma_mm = 3 }
'joint*.theta' = { sigma_deg = 0.5 }
'joint*.beta' = { sigma_deg = 0.5 }
";

/// Returns an elbow arm with three axes that are parallel up to `twist` [°].
fn elbow(twist: f64, parameters: &str) -> Problem {
    parse(&text(twist, parameters))
}

pub fn text(twist: f64, parameters: &str) -> String {
    format!(
        "name = 'elbow'\n[[joint]]\nd_m = 0.1273\n[[joint]]\nalpha_deg = 90\n[[joint]]\nalpha_deg = {twist}\na_m = -0.612\n\
         [[joint]]\na_m = -0.5723\nd_m = 0.163941\n[[joint]]\nalpha_deg = 90\nd_m = 0.1157\n[[joint]]\nalpha_deg = -90\n\
         d_m = 0.0922\n[tool]\ntarget_m = [0.03, 0.02, 0.109]\n[parameters]\n{parameters}\n[data]\nposition_sigma_mm = 0.05\n"
    )
}

/// Simulates sixty noisy poses and thirty held-out ones of an arm with errors of 0.1° and 1 mm.
pub fn measured(problem: &Problem, seed: u64) -> Dataset {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut rows = at_random(problem, 90, 2.5, &mut rng);
    let size = |unit| if unit == Unit::Length { 1e-3 } else { 2e-3 };
    let mut truth = draw(&model_of(problem, &rows), size, &mut rng);
    truth.iter_mut().for_each(|x| *x = x.clamp(-3e-3, 3e-3));
    measure(problem, &mut rows, &truth, SIGMA, &mut rng);
    divided(60, &rows)
}

/// Returns the lengths that moved by more than a centimetre.
fn far(found: &Identification) -> Vec<String> {
    let lengths = found
        .estimates
        .iter()
        .filter(|estimate| estimate.unit == Unit::Length && !estimate.name.starts_with("base"));
    let moved = lengths.filter(|estimate| (estimate.estimate - estimate.nominal).abs() > 0.01);
    moved.map(|estimate| format!("{}: {}", estimate.name, estimate.estimate)).collect()
}

#[test]
fn what_is_seen_too_weakly_is_held_and_named() {
    let free = format!("{PRIORS}'joint*.d' = {{ free = true }}\n'tool.*' = {{ free = true }}");
    // Combinations are unidentifiable or weak at the nominal arm, with bounds and without.
    for (twist, bound) in
        [(0.0, ""), (0.002, ""), (0.0, "\n'joint1.a' = { sigma_mm = 3, min_mm = -50 }")]
    {
        let problem = elbow(twist, &format!("{free}{bound}"));
        for seed in 1..=3 {
            let found = identify(&problem, &measured(&problem, seed), &Options::default()).unwrap();
            let at = format!("{twist}° {bound} seed {seed}");
            assert_eq!(found.solver == SolverChoice::Bounded, !bound.is_empty());
            assert!(
                found.is_trusted() && far(&found).is_empty(),
                "{at}: {:?} {:?}",
                found.findings,
                far(&found)
            );
            assert!(
                found.reduced_chi2.unwrap() < 1.4 && found.fitted.held_out.rms.norm < 3.0 * SIGMA,
                "{at}"
            );
            let named: Vec<&str> = found
                .weak
                .iter()
                .flat_map(|combination| &combination.weights)
                .map(|(k, _)| found.unknowns[*k].as_str())
                .collect();
            assert!(named.contains(&"joint3.d") && !named.contains(&"joint1.a"), "{at}: {named:?}");
            assert_eq!(found.estimate("joint3.d").unwrap().std_error, None);
            assert!(found.estimate("joint5.d").unwrap().std_error.unwrap() < 1e-3, "{at}");
            assert!(estimate_text(&problem, &found, None).contains("too weakly"), "{at}");
        }
    }
}

#[test]
fn what_is_seen_well_enough_is_not_held() {
    let problem = elbow(
        5.0,
        &format!("{PRIORS}'joint*.d' = {{ free = true }}\n'joint4.d' = {{ fixed = true }}"),
    );
    let found = identify(&problem, &measured(&problem, 1), &Options::default()).unwrap();
    assert!(found.weak.is_empty(), "{:?}", found.weak);
    let estimate = found.estimate("joint3.d").unwrap();
    let error = estimate.std_error.unwrap();
    assert!(error < 0.05 && estimate.estimate.abs() < 4.0 * error + 3e-3, "{estimate:?}");
}

#[test]
fn no_trusted_parameter_leaves_the_arm() {
    // The measuring frame is three metres above the base of the arm, and only a link may absorb
    // that.
    let problem = elbow(0.0, "'joint1.d' = { free = true }");
    let mut data = measured(&problem, 1);
    for position in &mut data.measurements.positions {
        position.z += 3.0;
    }
    let found = identify(&problem, &data, &Options::default()).unwrap();
    let error = found.first_error().unwrap();
    assert_eq!(
        (error.code, error.word("parameter")),
        (FindingCode::BeyondArmSize, Some("joint1.d"))
    );
    assert!(error.to_string().contains("times the arm's own size"), "{error}");
}
