//! Errors of rows that were left out, and what they say of further rows.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, Vector3};
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use super::kernel::{Hyperparameters, variance};
use super::posterior::LeftOut;
use super::rows::{AXES, Rows};

/// Most scores that are kept: quantiles up to 1 − 1/1000 stay exact.
const MAX_SCORES: usize = 1000;

/// Share of a correction that is applied: 1 where data decide the remainder, 0 where they say
/// nothing of it.
///
/// `explained` is the variance that is left of the correction, `prior` that of the remainder before
/// any data, both as traces \[m²\].
pub(super) fn fade(left: f64, prior: f64) -> f64 {
    if prior > 0.0 { 1.0 - (left / prior).clamp(0.0, 1.0) } else { 0.0 }
}

/// Error of a row that was predicted without its configuration or its block.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct LeftOutError {
    /// Length of measured − predicted \[m\].
    pub length: f64,
    /// Length over the size that the variance leads to expect \[1\].
    pub score: f64,
    /// Logarithm of the predictive density \[ln m⁻³\].
    pub density: f64,
}

/// Errors of a faded correction, from rows predicted by the parameters `alone` and `with` the
/// remainder that has these hyperparameters.
pub(super) fn left_out_errors(
    hyper: &Hyperparameters,
    rows: &Rows,
    alone: &[LeftOut],
    with: &[LeftOut],
) -> Vec<LeftOutError> {
    let one = |(row, (alone, with)): (usize, (&LeftOut, &LeftOut))| {
        let noise = AXES as f64 * hyper.noise_variance_of(rows.relative_sigma[row]);
        let prior = variance(hyper, rows, row).trace();
        let whole = with.covariance.trace();
        let share = fade(whole - noise, prior);
        let correction = alone.error - with.error;
        let error = alone.error - correction * share;
        let missed = if prior > 0.0 { (1.0 - share) * correction.norm() } else { 0.0 };
        let faded = Matrix3::from_diagonal_element(missed * missed / AXES as f64);
        LeftOutError {
            length: error.norm(),
            score: error.norm() / expected_size(whole, missed),
            density: log_density(&error, &(with.covariance + faded)),
        }
    };
    alone.iter().zip(with).enumerate().map(one).collect()
}

/// Logarithm of the density of a normal distribution with mean 0; NaN where the covariance is not
/// positive definite.
fn log_density(error: &Vector3<f64>, covariance: &Matrix3<f64>) -> f64 {
    let Some(factor) = covariance.cholesky() else { return f64::NAN };
    let square = error.dot(&factor.solve(error));
    -0.5 * (square + covariance.determinant().ln() + AXES as f64 * TAU.ln())
}

/// Size of an error from the trace of its covariance and from what fading leaves out \[m\].
pub(super) fn expected_size(variance: f64, missed: f64) -> f64 {
    (variance + missed * missed).sqrt()
}

/// Scores of rows left out, in ascending order: their quantiles turn an expected size into a bound.
#[derive(Debug, Clone, PartialEq)]
pub struct Scores {
    /// Number of configurations.
    pub(super) configurations: usize,
    /// Each configuration left out by itself.
    pub(super) single: Vec<f64>,
    /// Blocks of neighbouring configurations left out.
    pub(super) blocks: Vec<f64>,
}

impl Scores {
    /// Sorts scores, and thins many of them to evenly spaced quantiles.
    pub(super) fn new(configurations: usize, single: Vec<f64>, blocks: Vec<f64>) -> Self {
        Self { configurations, single: thinned(single), blocks: thinned(blocks) }
    }

    /// Multiplies all scores.
    pub(super) fn scale(&mut self, factor: f64) {
        self.single.iter_mut().chain(&mut self.blocks).for_each(|score| *score *= factor);
    }

    /// Factor from the expected size of an error to a bound that holds with probability `level`:
    /// the larger of both quantiles of rank level (G + 1) of G configurations, interpolated.
    /// [Lei, G'Sell, Rinaldo, Tibshirani & Wasserman 2018]
    ///
    /// A rank beyond G extends the largest score as the lengths of normal errors in three
    /// coordinates would.
    pub fn quantile(&self, level: f64) -> f64 {
        let count = self.configurations.max(1) as f64;
        let part = level * (count + 1.0) / count;
        let of = |scores: &[f64]| {
            let last = scores.len().saturating_sub(1);
            let place = (part.min(1.0) * scores.len() as f64 - 1.0).max(0.0);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a rank between 0 and the last one"
            )]
            let below = (place.floor() as usize).min(last);
            let low = scores.get(below).copied().unwrap_or(0.0);
            let high = scores.get(below + 1).copied().unwrap_or(low);
            low + (high - low) * (place - below as f64)
        };
        let beyond = if part > 1.0 { length(level) / length(count / (count + 1.0)) } else { 1.0 };
        beyond * of(&self.single).max(of(&self.blocks))
    }
}

/// Length of a normal error in three coordinates, over its σ, that holds with probability `level`.
fn length(level: f64) -> f64 {
    ChiSquared::new(AXES as f64).map_or(1.0, |squares| squares.inverse_cdf(level).sqrt())
}

/// Sorts finite scores and keeps at most [`MAX_SCORES`] evenly spaced ones.
fn thinned(mut scores: Vec<f64>) -> Vec<f64> {
    scores.retain(|score| score.is_finite());
    scores.sort_by(f64::total_cmp);
    let last = scores.len().saturating_sub(1);
    if scores.len() <= MAX_SCORES {
        return scores;
    }
    let at = |k: usize| scores[(k * last).div_ceil(MAX_SCORES - 1)];
    (0..MAX_SCORES).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_come_from_the_larger_list_and_survive_thinning() {
        let ramp = |n: usize, scale: f64| (1..=n).map(|k| scale * k as f64 / n as f64).collect();
        let few = Scores::new(99, ramp(99, 1.0), ramp(99, 2.0));
        // 0.95 · 100 = 95 of 99.
        assert!((few.quantile(0.95) - 2.0 * 95.0 / 99.0).abs() < 1e-12);
        assert!((2.2..2.6).contains(&few.quantile(0.999)), "more than the largest");
        let many = Scores::new(20_000, ramp(20_000, 1.0), ramp(20_000, 0.5));
        assert!(many.single.len() == MAX_SCORES && (many.quantile(0.95) - 0.95).abs() < 2e-3);
    }

    #[test]
    fn a_correction_fades_where_nothing_was_learned() {
        assert_eq!(
            (fade(0.0, 2.0), fade(2.0, 2.0), fade(3.0, 2.0), fade(1.0, 2.0)),
            (1.0, 0.0, 0.0, 0.5)
        );
        assert!(fade(0.0, 0.0).abs() < 1e-15);
    }
}
