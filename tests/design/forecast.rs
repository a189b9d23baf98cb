//! What a check expects of given poses, against what many fits then show.

use flexcal::design::{Check, Expected, Judged, check};
use flexcal::measurement::Measurements;
use flexcal::parameter::Unit;
use flexcal::problem::Problem;
use nalgebra::DVector;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::bench::{fit, lunar, ranges, rms};
use super::common::arms::parse;
use super::common::made::{at_random, draw, measure, model_of, predicted};

/// Errors of the estimates, in x, and of predictions in `elsewhere` [m], of arms drawn from the priors, each measured anew.
fn errors(problem: &Problem, rows: &Measurements, elsewhere: &Measurements, runs: u64) -> (Vec<DVector<f64>>, f64) {
    let model = model_of(problem, rows);
    let free = |unit: Unit| if unit == Unit::Length { 0.01 } else { 0.01_f64 };
    let of = |run: u64| {
        let mut random = ChaCha8Rng::seed_from_u64(run);
        let x = draw(&model, free, &mut random);
        let mut rows = rows.clone();
        measure(problem, &mut rows, &x, problem.data.position_sigma.unwrap(), &mut random);
        let found = fit(problem, &rows).x;
        let (there, found_there) = (predicted(problem, elsewhere, &x), predicted(problem, elsewhere, &found));
        let squares: f64 = there.iter().zip(&found_there).map(|(a, b)| (a - b).norm_squared()).sum();
        (found - x, squares / elsewhere.len() as f64)
    };
    let all: Vec<_> = (0..runs).into_par_iter().map(of).collect();
    let prediction = (all.iter().map(|(_, square)| square).sum::<f64>() / runs as f64).sqrt();
    (all.into_iter().map(|(error, _)| error).collect(), prediction)
}

/// 1 σ of x.
fn expected_x(expected: &Expected) -> Option<f64> {
    let relative = !matches!(expected.unit, Unit::Angle | Unit::Length);
    expected.std_error.map(|error| if relative { error / expected.nominal } else { error })
}

/// Actual over expected standard errors, by name.
fn ratios(check: &Check, errors: &[DVector<f64>]) -> Vec<(String, f64)> {
    let own = check.forecast.expected.iter().enumerate();
    own.filter_map(|(k, expected)| Some((expected.name.clone(), rms(errors, k) / expected_x(expected)?))).collect()
}

#[test]
fn lunar_probe() {
    let (mut problem, truth) = lunar();
    problem.data.held_out = None;
    let within = ranges(&truth);
    let rows = within.draw(&problem, 40, flexcal::design::Extremes::No, 3, 0);
    let elsewhere = within.draw(&problem, 200, flexcal::design::Extremes::No, 3, 10);
    let judged = Judged::Table { poses: rows.clone(), within: Some(within), held_out: None };
    let found = check(&problem, &judged, 3).unwrap();
    for scale in [1.0, 0.5, 0.2] {
        let mut problem = problem.clone();
        for rule in &mut problem.parameters {
            if let flexcal::problem::Freedom::Free { sigma, .. } = &mut rule.freedom {
                if let Some(r) = &mut sigma.relative { *r *= scale; }
            }
        }
        let found2 = check(&problem, &judged, 3).unwrap();
        let clock = std::time::Instant::now();
        let (errors, prediction) = errors(&problem, &rows, &elsewhere, 400);
        println!("scale {scale} {:?} prediction {} expected {}", clock.elapsed(), prediction, found2.prediction.rms);
        for (name, ratio) in ratios(&found2, &errors) { print!("{name} {ratio:.2}  "); }
        println!();
    }
    let _ = (found, at_random, parse);
}
