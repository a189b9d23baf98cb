//! Residuals as chance would leave them: permuted, and fitted again.

use nalgebra::{DMatrix, Vector3};
use rand::seq::SliceRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF as _, Normal};

use super::chance::{Chance, Drawn};
use super::leverage::Leverage;
use super::statistic::{Sample, Statistic};

/// Number of draws. Fewer where a product of all of them with Q takes more multiplications than `WORK`: of a fit of hundreds of parameters
/// to thousands of poses what is less probable than one in a hundred is then told by the fitted tail, instead of one in two hundred.
const DRAWS: usize = 1999;
const FEWEST: usize = 999;
const WORK: u64 = 1 << 32;
/// Draws that are fitted together, fewer where they have more than so many numbers: Q is gone through once for all of them.
const TOGETHER: usize = 96;
const FEWEST_TOGETHER: usize = 16;
const NUMBERS: usize = 1 << 21;

/// What each statistic does by chance; `None` where it cannot vary.
///
/// A draw permutes the studentised poses e, takes the fit away again and studentises anew:
///
/// r* = ε* − Q (Qᵀε* + S^½ z),  ε* = permuted e,  S = I − QᵀQ                        [Freedman and Lane 1983]
///
/// The last term is what true parameters, scattered about their nominal values as the priors say, leave of themselves
/// (z standard normal): with it, r* has the covariance I − H of r under priors, too; without priors S = 0. A permutation needs
/// no distribution of the noise but that it be the same at every pose, and no σ: without priors the p-values are
/// the same in any unit. All statistics share the draws; each draw has its own random numbers, whatever the threads.
pub(super) fn chances(
    leverage: &Leverage,
    studentised: &[Vector3<f64>],
    statistics: &[&Statistic],
    seed: u64,
) -> Vec<Option<Chance>> {
    if statistics.is_empty() {
        return Vec::new();
    }
    let together = (NUMBERS / (3 * studentised.len()).max(1)).clamp(FEWEST_TOGETHER, TOGETHER);
    let affordable = WORK / (leverage.fitted.len() as u64).max(1);
    let draws = usize::try_from(affordable).unwrap_or(DRAWS).clamp(FEWEST, DRAWS);
    let prior = leverage.prior_root();
    let starts: Vec<usize> = (0..draws).step_by(together).collect();
    let drawn: Vec<Vec<f64>> = starts
        .into_par_iter()
        .flat_map_iter(|start| {
            let residuals = draw((leverage, &prior), studentised, start..(start + together).min(draws), seed);
            let values = |residual: &[f64]| -> Vec<f64> {
                let sample = Sample::of(leverage.studentise(residual));
                statistics.iter().map(|statistic| statistic.of(&sample)).collect()
            };
            residuals.as_slice().chunks_exact(residuals.nrows()).map(values).collect::<Vec<_>>()
        })
        .collect();
    let of = |k: usize| Drawn::of(drawn.iter().map(|values| values[k]).collect()).map(Chance::Drawn);
    (0..statistics.len()).map(of).collect()
}

/// Residuals r* of some draws as columns, shape = (3 N, draws).
fn draw(
    (leverage, prior): (&Leverage, &DMatrix<f64>),
    studentised: &[Vector3<f64>],
    draws: std::ops::Range<usize>,
    seed: u64,
) -> DMatrix<f64> {
    let mut residuals = DMatrix::zeros(3 * studentised.len(), draws.len());
    let mut by_priors = DMatrix::zeros(prior.ncols(), draws.len());
    let normal = Normal::standard();
    for (column, draw) in draws.enumerate() {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(draw as u64);
        let mut permuted = studentised.to_vec();
        permuted.shuffle(&mut random);
        for (pose, value) in permuted.iter().enumerate() {
            residuals.fixed_view_mut::<3, 1>(3 * pose, column).copy_from(value);
        }
        for value in by_priors.column_mut(column).iter_mut() {
            let uniform: f64 = random.random();
            *value = normal.inverse_cdf(uniform.max(f64::EPSILON));
        }
    }
    let mut taken = &leverage.transposed * &residuals;
    if prior.ncols() > 0 {
        taken += prior * by_priors;
    }
    residuals.gemm(-1.0, &leverage.fitted, &taken, 1.0);
    residuals
}
