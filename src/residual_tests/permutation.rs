//! Null distributions from permuted residuals that are fitted again.

use nalgebra::{DMatrix, DVector, Vector3};
use rand::seq::SliceRandom as _;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF as _, Normal};

use super::chance::{Chance, Drawn};
use super::leverage::Leverage;
use super::statistic::{Sample, Statistic};
use crate::numeric::parallel;
use crate::numeric::{subtract_product, transposed_product};

/// Largest and smallest number of permutation draws. Fewer than the largest are made if their
/// product with Q takes more than `MAX_MULTIPLICATIONS` multiplications; p-values below 1 % then
/// come from the fitted tail.
const MAX_DRAWS: usize = 1999;
const MIN_DRAWS: usize = 999;
const MAX_MULTIPLICATIONS: u64 = 1 << 32;
/// Largest and smallest number of draws that are fitted together, so that Q is read once for all
/// of them. Fewer than the largest are fitted together if they contain more than
/// `MAX_BATCH_NUMBERS` numbers.
const MAX_BATCH_DRAWS: usize = 96;
const MIN_BATCH_DRAWS: usize = 16;
const MAX_BATCH_NUMBERS: usize = 1 << 21;
/// Number of draws whose statistics are computed side by side, in vector registers.
const DRAWS_SIDE_BY_SIDE: usize = 8;
/// Largest number of residuals of a draw (three a pose) at which draws are evaluated side by side.
/// The limit bounds the memory of the copies.
const MAX_ROWS_SIDE_BY_SIDE: usize = 1 << 18;

/// Returns the null distribution of each statistic; `None` if the statistic is the same in all
/// draws.
///
/// A draw permutes the studentised residuals e of the poses, removes their fit and studentises
/// again:
///
/// r* = ε* − Q (Qᵀε* + S^½ z),  ε* = permuted e,  S = I − QᵀQ                        [Freedman and
/// Lane 1983]
///
/// The term S^½ z, with z standard normal, represents true parameters that scatter about their
/// nominal values as the priors state. It gives r* the covariance I − H under priors, too; without
/// priors S = 0. Permutation only assumes that all poses have the same noise distribution; it needs
/// no σ. Without priors, the p-values do not depend on the unit of the residuals. All statistics
/// share the draws. Each draw has a separate random stream, so that results do not depend on the
/// number of threads.
pub(super) fn null_distributions(
    leverage: &Leverage,
    studentised: &[Vector3<f64>],
    statistics: &[&Statistic],
    seed: u64,
) -> Vec<Option<Chance>> {
    if statistics.is_empty() {
        return Vec::new();
    }
    let together = (MAX_BATCH_NUMBERS / (3 * studentised.len()).max(1))
        .clamp(MIN_BATCH_DRAWS, MAX_BATCH_DRAWS);
    let affordable = MAX_MULTIPLICATIONS / (leverage.fitted.len() as u64).max(1);
    let draws = usize::try_from(affordable).unwrap_or(MAX_DRAWS).clamp(MIN_DRAWS, MAX_DRAWS);
    let prior = leverage.prior_root();
    let starts: Vec<usize> = (0..draws).step_by(together).collect();
    let values = |space: &mut DMatrix<f64>, start: usize| {
        draw((leverage, &prior), studentised, start..(start + together).min(draws), seed, space);
        evaluate_draws(leverage, statistics, space)
    };
    let drawn: Vec<Vec<Vec<f64>>> = if together > MIN_BATCH_DRAWS {
        parallel::map_with(starts.len(), DMatrix::default, |k, space| values(space, starts[k]))
    } else {
        // If draws take much memory, all threads work on the same few draws.
        let mut space = DMatrix::default();
        starts.into_iter().map(|start| values(&mut space, start)).collect()
    };
    let drawn = drawn.concat();
    let of =
        |k: usize| Drawn::of(drawn.iter().map(|values| values[k]).collect()).map(Chance::Drawn);
    (0..statistics.len()).map(of).collect()
}

/// Writes the residuals r* of [`null_distributions`] for the draws with these numbers into the
/// columns of `residuals`, shape = (3 N, draws). `prior` is R with R Rᵀ = I − QᵀQ.
fn draw(
    (leverage, prior): (&Leverage, &DMatrix<f64>),
    studentised: &[Vector3<f64>],
    draws: std::ops::Range<usize>,
    seed: u64,
    residuals: &mut DMatrix<f64>,
) {
    let (rows, normal) = (3 * studentised.len(), Normal::standard());
    *residuals = std::mem::take(residuals).resize(rows, draws.len(), 0.0);
    let permute = |(column, draw): (&mut [f64], usize)| -> DVector<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(draw as u64);
        let (poses, _) = column.as_chunks_mut::<3>();
        // Indices of poses are permuted instead of poses, because they take less memory.
        let mut numbers: Vec<u32> = (0..).take(poses.len()).collect();
        numbers.shuffle(&mut random);
        poses
            .iter_mut()
            .zip(numbers)
            .for_each(|(pose, number)| *pose = studentised[number as usize].into());
        let by_prior = |_, _| {
            let uniform: f64 = random.random();
            normal.inverse_cdf(uniform.max(f64::EPSILON))
        };
        DVector::from_fn(prior.ncols(), by_prior)
    };
    let columns = residuals.as_mut_slice().par_chunks_mut(rows.max(1)).zip(draws);
    let by_priors: Vec<DVector<f64>> = columns.map(permute).collect();
    let mut components = transposed_product(&leverage.fitted, residuals.as_view());
    if prior.ncols() > 0 {
        components += prior * DMatrix::from_columns(&by_priors);
    }
    subtract_product(residuals.as_view_mut(), &leverage.fitted, &components);
}

/// Returns the statistics, one list a draw, from the residuals r* of the draws. Studentises these
/// residuals in place.
fn evaluate_draws(
    leverage: &Leverage,
    statistics: &[&Statistic],
    residuals: &mut DMatrix<f64>,
) -> Vec<Vec<f64>> {
    let rows = residuals.nrows().max(1);
    let of_draws = |residuals: &mut [f64]| -> Vec<Vec<f64>> {
        let mut draws: Vec<&mut [[f64; 3]]> =
            residuals.chunks_mut(rows).map(|residual| residual.as_chunks_mut().0).collect();
        for poses in &mut draws {
            leverage.studentise_in_place(poses);
        }
        let draws: Vec<&[[f64; 3]]> = draws.into_iter().map(|poses| &*poses).collect();
        match <[&[[f64; 3]]; DRAWS_SIDE_BY_SIDE]>::try_from(draws) {
            Ok(draws) => evaluate(draws, statistics),
            Err(draws) => draws.into_iter().flat_map(|draw| evaluate([draw], statistics)).collect(),
        }
    };
    let count = if rows > MAX_ROWS_SIDE_BY_SIDE { 1 } else { DRAWS_SIDE_BY_SIDE };
    residuals.as_mut_slice().par_chunks_mut(count * rows).flat_map_iter(of_draws).collect()
}

/// Returns the statistics, one list a draw, from the studentised residuals of L draws.
fn evaluate<const L: usize>(draws: [&[[f64; 3]]; L], statistics: &[&Statistic]) -> Vec<Vec<f64>> {
    let sample = Sample::of(draws);
    let values: Vec<[f64; L]> =
        statistics.iter().map(|statistic| statistic.evaluate(&sample)).collect();
    (0..L).map(|l| values.iter().map(|values| values[l]).collect()).collect()
}
