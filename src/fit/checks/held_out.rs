//! What held-out poses say of a fit: they decide nothing in it, and are judged by it and it by
//! them.

use std::collections::HashSet;

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rayon::prelude::*;

use crate::fit::Errors;
use crate::fit::checks::kind::Kind;
use crate::fit::checks::outliers::Outlier;
use crate::fit::checks::quality::{BEYOND_NOISE, LEAST_SPREAD, MISSES, QualityFlag};
use crate::fit::stages::fitting::Fitting;
use crate::fit::uncertainty::residual_lengths::{chances, scatter};
use crate::least_squares::{Block, CHUNK_ITEMS, LeastSquares as _};
use crate::measurement::Measurements;
use crate::numeric::median;

/// A fit is worse than none if its error on held-out poses is this many times that of the
/// registered nominal arm …
const WORSE: f64 = 1.5;
/// … and this many times the noise.
const ABOVE_NOISE: f64 = 5.0;

/// Held-out rows whose errors of position are too long for the fit's σ and its own uncertainty
/// there, in the order of the rows.
///
/// A row is one where P(χ²ₖ > s²) < 0.01 / N with s² = rᵀ (I + J C Jᵀ)⁻¹ r / scatter², r and J
/// whitened by the σ that the fit took, C the covariance of its `unknowns` at `x`. The scatter is
/// the median of s / √(median of χ²ₖ), no less than 1: so a model that misses some effect
/// everywhere does not turn every row into one.
pub(in crate::fit) fn outliers(
    fitting: &Fitting,
    x: &DVector<f64>,
    unknowns: &[usize],
    covariance: &DMatrix<f64>,
) -> Vec<Outlier> {
    let rows = &fitting.split.held_out;
    let stage = fitting.stage(rows, unknowns.to_vec());
    let residuals = stage.residuals(x);
    let at = residuals.reduced(x);
    let n = unknowns.len();
    let of_pose = stage.coordinates();
    let of_chunk = |chunk: usize| -> Vec<f64> {
        let items = chunk * CHUNK_ITEMS..((chunk + 1) * CHUNK_ITEMS).min(rows.len());
        let poses = items.len();
        let mut block = Block::zeros(of_pose * poses, n);
        residuals.linearise(&at, items, &mut block);
        let jacobian =
            DMatrix::from_fn(3 * poses, n, |row, j| block.column(j)[of_pose * (row / 3) + row % 3]);
        let spread = &jacobian * covariance;
        let length = |pose: usize| {
            let residual = Vector3::from_fn(|i, _| block.column(n)[of_pose * pose + i]);
            let entry =
                |i: usize, k: usize| spread.row(3 * pose + i).dot(&jacobian.row(3 * pose + k));
            let own = Matrix3::identity() + Matrix3::from_fn(entry);
            // Scaled: squares of what is far off overflow.
            let size = residual.amax().max(1.0);
            let square = own.cholesky().map_or(f64::NAN, |factor| {
                (residual / size).dot(&factor.solve(&(residual / size)))
            });
            size * square.max(0.0).sqrt()
        };
        (0..poses).map(length).collect()
    };
    let lengths: Vec<f64> =
        (0..rows.len().div_ceil(CHUNK_ITEMS)).into_par_iter().flat_map_iter(of_chunk).collect();
    let numbers: Vec<usize> =
        stage.poses.iter().map(|pose| pose.observation.coordinates()).collect();
    let chances = chances(&numbers);
    let scatter = scatter(&lengths, &chances).max(1.0);
    let errors = fitting.position_errors(rows, x);
    let outlier = |place: usize| {
        let (row, distance) = (rows[place], lengths[place] / scatter);
        let far = || Outlier::of(fitting.measurements, row, distance, errors[place]);
        (distance > chances[place].1).then(far)
    };
    (0..rows.len()).filter_map(outlier).collect()
}

/// Number of held-out rows that are identification rows again: configuration, position and session
/// are the same to the bit.
pub(in crate::fit) fn copies(
    measurements: &Measurements,
    identification: &[usize],
    held_out: &[usize],
) -> usize {
    let key = |row: usize| -> Vec<u64> {
        let values =
            measurements.configuration(row).iter().chain(measurements.positions[row].iter());
        let words = measurements
            .observation(row)
            .key()
            .into_iter()
            .chain([measurements.session.of_row[row]]);
        values.map(|value| value.to_bits()).chain(words.map(|word| word as u64)).collect()
    };
    let known: HashSet<Vec<u64>> = identification.iter().map(|&row| key(row)).collect();
    held_out.iter().filter(|&&row| known.contains(&key(row))).count()
}

/// Whether held-out poses contradict the fit: most are missed as if they were of another arm, or
/// they are met worse than by the registered nominal arm.
///
/// Rows of each of the identified `kinds` are judged by themselves; worse than the nominal arm is
/// asked of those that errors are told of.
pub(in crate::fit) fn contradict(
    fitting: &Fitting,
    x: &DVector<f64>,
    (registered, fitted): (&Errors, &Errors),
    kinds: &[Kind],
) -> Option<QualityFlag> {
    let errors = fitting.position_errors(&fitting.split.held_out, x);
    let missed = |own: &Kind| {
        let kind = own.observation.kind();
        let rows = fitting.split.held_out.iter().zip(&errors);
        let lengths =
            rows.filter(|(row, _)| fitting.measurements.observation(**row).kind() == kind);
        let lengths = lengths.map(|(_, error)| error.norm()).filter(|length| length.is_finite());
        let (median, spread) = (median(lengths).unwrap_or(0.0), own.spread);
        let least = own.sigma.0.map_or(0.0, |sigma| BEYOND_NOISE * sigma);
        (spread > LEAST_SPREAD && median > MISSES * spread && median > least)
            .then_some(QualityFlag::HeldOutMisses { kind, median, spread })
    };
    let worse = || {
        let (before, after) = (registered.held_out.rms.norm, fitted.held_out.rms.norm);
        let own = kinds.iter().find(|own| own.observation.kind() == fitted.held_out.kind)?;
        let noise = own.observation.root() * own.sigma.1;
        (after > WORSE * before && after > ABOVE_NOISE * noise)
            .then_some(QualityFlag::HeldOutWorse { kind: fitted.held_out.kind, before, after })
    };
    kinds.iter().find_map(missed).or_else(worse)
}
