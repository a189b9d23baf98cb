//! Standard errors that the curvature of the model refutes.
//!
//! Where some combination of the unknowns is uncertain by centimetres or degrees, the others follow
//! it along a curve: with x = x̂ + Σ uₖ vₖ and normal uₖ, the optimum of the others moves by −½ Σ
//! aₖₗ uₖ uₗ with aₖₗ = C Jᵀ r″(vₖ, vₗ) [Bates & Watts 1980]. The mean square of that, (½ Σ aₖₖ)²
//! plus ½ Σ aₖₗ², is compared with the squares of the standard errors.

use nalgebra::{DMatrix, DVector};

use super::surroundings::{Surroundings, rigid_predictions};
use crate::fit::stages::fitting::{FitEnd, Fitting};
use crate::fit::stages::parameter_size::size_of_unit;
use crate::fit::uncertainty::statistics::Statistics;

/// Least standard deviation of a combination of unknowns, in their plausible sizes, at which its
/// curvature matters.
const MIN_DEVIATION: f64 = 5e-4;
/// Largest movement of an unknown, in its standard errors, at which the unknown still has one.
const MAX_MOVED: f64 = 1.0;
/// Largest step of second differences along a combination, in plausible sizes.
const MAX_STEP: f64 = 0.05;
/// Maximum number of combinations, the most uncertain ones.
const MAX_COMBINATIONS: usize = 12;
/// Largest number of predicted rows of a rigid arm, which takes about a tenth of a second. Fits
/// that take longer keep the standard errors of the linear model.
const MAX_PREDICTIONS: usize = 1_000_000;

/// Marks the unknowns of a fit that ended at `end` whose standard errors the curvature of the model
/// refutes as not determined.
pub(in crate::fit) fn refute_errors(fitting: &Fitting, end: &FitEnd, statistics: &mut Statistics) {
    let stage = fitting.whole();
    let sizes: Vec<Option<f64>> =
        stage.parameters().map(|parameter| size_of_unit(stage.model, parameter)).collect();
    let n = sizes.len();
    let mut uncertain = combinations(&statistics.covariance, &sizes);
    uncertain.sort_by(|a, b| b.0.total_cmp(&a.0));
    uncertain.truncate(MAX_COMBINATIONS);
    let count = uncertain.len();
    if count == 0 || count * (count + 1) * rigid_predictions(fitting, end) > MAX_PREDICTIONS {
        return;
    }
    let surroundings = Surroundings::new(&stage, &end.x, &statistics.covariance);
    // Movement of the optimum for steps of one standard deviation along the sum of some directions.
    let movement = |chosen: &[usize]| {
        let step = chosen.iter().fold(DVector::zeros(n), |sum, &k| {
            let (deviation, direction) = &uncertain[k];
            sum + direction * deviation.min(MAX_STEP)
        });
        surroundings.movement(&step)
    };
    let factor = |k: usize| (uncertain[k].0 / MAX_STEP).max(1.0);
    let along: Vec<DVector<f64>> = (0..count).map(|k| movement(&[k])).collect();
    let mut mean = DVector::<f64>::zeros(n);
    let mut squares = DVector::<f64>::zeros(n);
    for k in 0..count {
        let twice = &along[k] * factor(k).powi(2);
        mean += &twice * 0.5;
        squares += twice.map(|value| 0.5 * value * value);
        for l in 0..k {
            let mixed = (movement(&[k, l]) - &along[k] - &along[l]) * (0.5 * factor(k) * factor(l));
            squares += mixed.map(|value| value * value);
        }
    }
    for j in 0..n {
        let moved = mean[j].hypot(squares[j].sqrt());
        statistics.determined[j] &= moved <= MAX_MOVED * statistics.errors[j] || moved.is_nan();
    }
}

/// Combinations of unknowns with their standard deviation in plausible sizes, and the change of the
/// unknowns for a standard deviation of 1.
type Combinations = Vec<(f64, DVector<f64>)>;

/// Returns the principal combinations of a covariance whose standard deviation exceeds
/// [`MIN_DEVIATION`]. Unknowns without a plausible size take no part.
fn combinations(covariance: &DMatrix<f64>, sizes: &[Option<f64>]) -> Combinations {
    let n = sizes.len();
    let size = |j: usize| sizes[j].unwrap_or(f64::INFINITY);
    let scaled = DMatrix::from_fn(n, n, |i, j| covariance[(i, j)] / (size(i) * size(j)));
    if scaled.trace() < MIN_DEVIATION.powi(2) || scaled.iter().any(|value| !value.is_finite()) {
        return Vec::new();
    }
    let eigen = scaled.symmetric_eigen();
    let pairs = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    pairs
        .filter(|(variance, _)| **variance > MIN_DEVIATION.powi(2))
        .map(|(variance, column)| {
            let change = |j: usize| sizes[j].map_or(0.0, |size| size * column[j]);
            (variance.sqrt(), DVector::from_fn(n, |j, _| change(j)))
        })
        .collect()
}
