//! Coverage of standard errors: over many simulated data sets they cover the truth at the nominal
//! rate.

#![expect(clippy::print_stdout, reason = "figures for those who ask with --nocapture")]

use crate::common::arms::{measured, parse, path};
use crate::common::made::{at_random, divided, draw, measure, model_of, part};
use flexcal::fit::{Options, Placement, identify};
use flexcal::least_squares::{Identifiability, jacobian};
use flexcal::measurement::{Measurements, Split};
use flexcal::model::{Model, PoseResiduals};
use flexcal::problem::Problem;
use flexcal::quantity::Unit;
use nalgebra::DVector;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Probability that a normal variable is within one and two standard deviations.
const NORMAL: [(f64, f64); 2] = [(1.0, 0.682_689), (2.0, 0.954_500)];
/// Allowed deviation of a share, in its standard deviations.
const LIMIT: f64 = 4.0;

/// Allowed share of failed fits.
const FAILURES: f64 = 0.005;

/// Score of one fit: (estimate − truth) / σ of each informed parameter, and χ²/ν.
struct Score {
    z: Vec<Option<f64>>,
    reduced_chi2: f64,
}

/// Fit that is repeated with new arms and new noise.
struct Trial {
    problem: Problem,
    rows: Measurements,
    model: Model,
    /// Standard deviation of the truth of a parameter without a prior.
    spread: fn(Unit) -> f64,
}

impl Trial {
    fn new(problem: Problem, rows: Measurements, spread: fn(Unit) -> f64) -> Self {
        let model = model_of(&problem, &rows);
        Self { problem, rows, model, spread }
    }

    /// Scores one fit; `None` if the fit reports that it is not trusted.
    fn score(&self, seed: u64) -> Option<Score> {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let truth = draw(&self.model, self.spread, &mut rng);
        let mut rows = self.rows.clone();
        measure(
            &self.problem,
            &mut rows,
            &truth,
            self.problem.data.position_sigma.unwrap(),
            &mut rng,
        );
        let found =
            identify(&self.problem, &divided(rows.len(), &rows), &Options::default()).unwrap();
        if !found.is_trusted() {
            println!("seed {seed}: {:?}", found.termination);
            return None;
        }
        let z = found.estimates.iter().enumerate().map(|(k, estimate)| {
            // The error is that of x, which is a logarithm for stiffnesses.
            let scale = if estimate.unit.is_relative() { estimate.estimate } else { 1.0 };
            estimate.std_error.map(|error| (found.x[k] - truth[k]) / (error / scale))
        });
        Some(Score { z: z.collect(), reduced_chi2: found.reduced_chi2.unwrap() })
    }

    /// Scores `fits` fits and compares them with the normal distribution.
    fn check(&self, what: &str, fits: u64) {
        let scores: Vec<Score> =
            (0..fits).into_par_iter().filter_map(|seed| self.score(seed)).collect();
        let failed = fits as f64 - scores.len() as f64;
        assert!(failed <= FAILURES * fits as f64, "{what}: {failed} fits of {fits} failed");
        let chi2: Vec<f64> = scores.iter().map(|score| score.reduced_chi2).collect();
        let (mean, error) = mean_and_error(&chi2);
        println!("{what}: {fits} fits, {failed} failed, χ²/ν {mean:.4} ± {error:.4}");
        assert!((mean - 1.0).abs() < LIMIT * error, "{what}: mean χ²/ν {mean} ± {error}");
        for (within, nominal) in NORMAL {
            let of_fit = |score: &Score| share(score.z.iter().flatten().copied(), within).0;
            let (mean, error) = mean_and_error(&scores.iter().map(of_fit).collect::<Vec<f64>>());
            println!(
                "  within {within} σ: {:.2} ± {:.2} % (normal {:.1} %)",
                100.0 * mean,
                100.0 * error,
                100.0 * nominal
            );
            assert!(
                (mean - nominal).abs() < LIMIT * error,
                "{what}: {mean} ± {error} within {within} σ"
            );
        }
        for (k, parameter) in self.model.parameters.iter().enumerate() {
            let z: Vec<f64> = scores.iter().filter_map(|score| score.z[k]).collect();
            let shares =
                NORMAL.map(|(within, nominal)| (share(z.iter().copied(), within), nominal));
            let (bias, _) = mean_and_error(&z);
            println!(
                "  {:16} {:5} fits, bias {bias:6.2} σ, {:.1} %, {:.1} %",
                parameter.name,
                z.len(),
                100.0 * shares[0].0.0,
                100.0 * shares[1].0.0
            );
            for ((share, n), nominal) in shares {
                let error = (nominal * (1.0 - nominal) / n).sqrt();
                let name = &parameter.name;
                assert!(
                    (share - nominal).abs() < LIMIT * error,
                    "{what}: {name} is covered in {share}, not {nominal}"
                );
            }
        }
    }
}

/// Returns the share of values within ±`limit`, and the number of values.
fn share(values: impl Iterator<Item = f64>, limit: f64) -> (f64, f64) {
    let (mut inside, mut all) = (0.0, 0.0);
    for value in values {
        all += 1.0;
        inside += if value.abs() < limit { 1.0 } else { 0.0 };
    }
    (inside / all, all)
}

/// Returns the mean and its standard error.
fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// Returns the lunar sampler with its priors, in the 28 poses of the example.
fn lunar_sampler() -> Trial {
    let problem = Problem::read(&path("tests/cases")).unwrap();
    let rows = measured(&problem, &["tests/cases/a-none.csv"]);
    let chosen = Split::new(&problem, &rows).unwrap().identification;
    let rows = part(&rows, chosen);
    assert_eq!(rows.len(), 28);
    Trial::new(problem, rows, |_| unreachable!())
}

/// Returns a rigid UR10 without priors; parameters that the poses cannot separate are fixed.
fn ur10() -> Trial {
    let text = std::fs::read_to_string(path("problems/ur10-ipa/problem.toml")).unwrap();
    let (arm, _) = text.split_once("[parameters]").unwrap();
    let with = |rules: &str| {
        parse(&format!("{arm}[parameters]\n{rules}\n[data]\nposition_sigma_mm = 0.1\n"))
    };
    let all = with("\"*\" = { free = true }");
    let rows = at_random(&all, 60, 2.8, &mut ChaCha8Rng::seed_from_u64(17));
    let model = model_of(&all, &rows);
    let n = model.parameters.len();
    // From the tool inwards, each parameter that the nominal arm separates from those already
    // chosen is freed.
    let poses = Placement::of(&rows).poses(&rows, &(0..rows.len()).collect::<Vec<_>>(), 1.0);
    let columns = jacobian(
        &PoseResiduals::new(&model, poses, (0..n).collect(), DVector::zeros(n)),
        &DVector::zeros(n),
    );
    let mut chosen: Vec<usize> = Vec::new();
    for k in (0..n).rev() {
        chosen.push(k);
        let triangle = columns.select_columns(&chosen).qr().unpack_r();
        if Identifiability::of(&triangle).rank < chosen.len() {
            chosen.pop();
        }
    }
    let free: Vec<String> = chosen
        .iter()
        .map(|&k| format!("\"{}\" = {{ free = true }}", model.parameters[k].name))
        .collect();
    assert!((25..=30).contains(&free.len()), "{} parameters are identifiable", free.len());
    Trial::new(with(&free.join("\n")), rows, |_| 5e-3)
}

#[test]
fn errors_cover_the_truth_with_priors() {
    lunar_sampler().check("lunar sampler", 200);
}

#[test]
fn errors_cover_the_truth_without_priors() {
    ur10().check("UR10", 300);
}

#[test]
#[ignore = "the same at length"]
fn errors_cover_the_truth_at_length() {
    lunar_sampler().check("lunar sampler", 2000);
    ur10().check("UR10", 2000);
}
