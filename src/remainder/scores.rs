//! Errors of rows that were left out, and the error bounds of predictions that follow from them.

use std::f64::consts::{FRAC_2_PI, TAU};

use nalgebra::Matrix3;
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use super::kernel::{Hyperparameters, variance};
use super::posterior::LeftOut;
use super::rows::{AXES, Rows};
use crate::numeric::bisect;

/// Maximum number of scores that are kept, as evenly spaced quantiles. Quantiles up to 0.999 can
/// still be taken from them.
const MAX_SCORES: usize = 1000;
/// Minimum number of configurations from which the tail of the scores is estimated.
const MIN_FOR_TAIL: usize = 20;
/// Number of bisections of the interval in which an error bound is searched.
const HALVINGS: usize = 50;

/// Returns the part of a correction that is applied, 1 − `posterior` / `prior`: 1 if the data
/// determine the remainder, 0 if they do not, or without a remainder.
///
/// `posterior` is the posterior variance of the correction and `prior` the prior variance of the
/// remainder, both as traces \[m²\].
pub(super) fn applied_share(posterior: f64, prior: f64) -> f64 {
    if prior > 0.0 { 1.0 - (posterior / prior).clamp(0.0, 1.0) } else { 0.0 }
}

/// Error of a row that was predicted without its configuration or its block.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct LeftOutError {
    /// Error length ‖measured − predicted‖ \[m\].
    pub length: f64,
    /// Score: error length divided by its expected root mean square.
    pub score: f64,
    /// Squared error in units of its predicted covariance S, eᵀS⁻¹e. NaN if S is not positive
    /// definite.
    pub square: f64,
    /// Half the logarithm of the determinant of S \[ln m³\].
    pub ln_volume: f64,
}

impl LeftOutError {
    /// Returns the logarithm of the predictive density of the measured position \[ln m⁻³\]: a
    /// normal density with the covariance `scale` S.
    pub fn density(&self, scale: f64) -> f64 {
        let axes = AXES as f64;
        -0.5 * (self.square / scale + axes * (scale * TAU).ln()) - self.ln_volume
    }
}

/// Computes the errors of left-out rows if only the [`applied_share`] of each correction is added.
/// `alone` are the errors with the parameters alone, `with` those with the remainder of these
/// hyperparameters.
pub(super) fn left_out_errors(
    hyper: &Hyperparameters,
    rows: &Rows,
    alone: &[LeftOut],
    with: &[LeftOut],
) -> Vec<LeftOutError> {
    let score = |(row, (alone, with)): (usize, (&LeftOut, &LeftOut))| {
        let noise = AXES as f64 * hyper.noise_variance_of(rows.relative_sigma[row]);
        let prior = variance(hyper, rows, row).trace();
        let whole = with.covariance.trace();
        let share = applied_share(whole - noise, prior);
        let correction = alone.error - with.error;
        let error = alone.error - correction * share;
        let missed = if prior > 0.0 { (1.0 - share) * correction.norm() } else { 0.0 };
        let faded = Matrix3::from_diagonal_element(missed * missed / AXES as f64);
        let covariance = with.covariance + faded;
        let factor = covariance.cholesky();
        let square = factor.map_or(f64::NAN, |factor| error.dot(&factor.solve(&error)));
        LeftOutError {
            length: error.norm(),
            score: error.norm() / expected_size(whole, missed),
            square,
            ln_volume: 0.5 * covariance.determinant().ln(),
        }
    };
    alone.iter().zip(with).enumerate().map(score).collect()
}

/// Returns the expected root mean square of the error length \[m\]. `variance` is the trace of the
/// error covariance \[m²\], and `missed` the length of the part of the correction that is not applied
/// \[m\].
pub(super) fn expected_size(variance: f64, missed: f64) -> f64 {
    (variance + missed * missed).sqrt()
}

/// Scores of left-out rows, in ascending order. A quantile of the scores times an expected error
/// length is an error bound.
#[derive(Debug, Clone, PartialEq)]
pub struct Scores {
    /// Number of configurations that were left out.
    pub(super) configurations: usize,
    /// Scores of rows that were predicted without their configuration.
    pub(super) single: Vec<f64>,
    /// Scores of rows that were predicted without their block of neighbouring configurations.
    pub(super) blocks: Vec<f64>,
}

impl Scores {
    /// Sorts the scores. Above [`MAX_SCORES`], only evenly spaced quantiles are kept.
    pub(super) fn new(configurations: usize, single: Vec<f64>, blocks: Vec<f64>) -> Self {
        Self { configurations, single: thinned(single), blocks: thinned(blocks) }
    }

    /// Multiplies all scores by `factor`, which widens or narrows the bounds.
    pub(super) fn multiply(&mut self, factor: f64) {
        self.single.iter_mut().chain(&mut self.blocks).for_each(|score| *score *= factor);
    }

    /// Returns the ratio of error bound to expected error length at which the bound holds with
    /// probability `level`.
    ///
    /// With G configurations it is the score of rank level (G + 1), interpolated. The larger one of
    /// both lists, single configurations and blocks, is taken. [Lei, G'Sell, Rinaldo, Tibshirani &
    /// Wasserman 2018] For ranks beyond G, the largest score is extrapolated with the distribution
    /// of the length of a normal vector in three dimensions.
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
        let beyond = if part > 1.0 {
            length_quantile(level) / length_quantile(count / (count + 1.0))
        } else {
            1.0
        };
        beyond * of(&self.single).max(of(&self.blocks))
    }

    /// Returns the root mean square of the scores of single configurations; 1 if the expected error
    /// lengths are right. `None` without scores.
    pub(super) fn scale(&self) -> Option<f64> {
        let count = self.single.len() as f64;
        let squares: f64 = self.single.iter().map(|score| score * score).sum();
        (count > 0.0 && squares > 0.0).then(|| (squares / count).sqrt())
    }

    /// Returns the relative standard error of the quantile `level` of a sample of lengths of normal
    /// vectors in three dimensions. The sample has as many lengths as there are configurations.
    /// [David & Nagaraja 2003, eq. 10.2.1]
    fn quantile_error(&self, level: f64) -> f64 {
        let quantile = length_quantile(level);
        let density = FRAC_2_PI.sqrt() * quantile.powi(2) * (-0.5 * quantile.powi(2)).exp();
        (level * (1.0 - level) / self.configurations as f64).sqrt() / (density * quantile)
    }

    /// Returns the length \[m\] that errors do not exceed with probability `level`, over all poses
    /// with the expected error lengths `sizes` \[m\] together. The length is too small with at most
    /// the probability 1 − `confidence`, if the scores have `freedom` degrees of freedom. `None`
    /// without scores.
    ///
    /// Errors are assumed to be normal vectors with the scale of the scores. They are stretched if
    /// the scores have a longer tail by more than the standard error of their quantile.
    pub(super) fn pooled_bound(
        &self,
        sizes: &[f64],
        level: f64,
        (confidence, freedom): (f64, f64),
    ) -> Option<f64> {
        let scale = self.scale()?;
        let squares = ChiSquared::new(AXES as f64).ok()?;
        let lowest = ChiSquared::new(freedom).ok()?.inverse_cdf(1.0 - confidence);
        let normal = length_quantile(level) / (AXES as f64).sqrt();
        let tail = if self.configurations < MIN_FOR_TAIL {
            1.0
        } else {
            let error = self.quantile_error(level);
            (self.quantile(level) / (scale * normal) - error).max(1.0)
        };
        let unit = scale * tail * (freedom / lowest).sqrt() / (AXES as f64).sqrt();
        let within = |bound: f64| {
            let shares = sizes.iter().map(|size| squares.cdf((bound / (unit * size)).powi(2)));
            shares.sum::<f64>() / sizes.len() as f64
        };
        let largest = sizes.iter().copied().fold(0.0, f64::max) * unit * 10.0;
        Some(bisect(|bound| within(bound) < level, (0.0, largest), HALVINGS).1)
    }
}

/// Returns the quantile of the length of a standard normal vector in three dimensions.
fn length_quantile(level: f64) -> f64 {
    ChiSquared::new(AXES as f64).map_or(1.0, |squares| squares.inverse_cdf(level).sqrt())
}

/// Sorts the finite scores and keeps at most [`MAX_SCORES`] evenly spaced ones.
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
        // The rank is 0.95 · 100 = 95 among 99 scores.
        assert!((few.quantile(0.95) - 2.0 * 95.0 / 99.0).abs() < 1e-12);
        assert!((2.2..2.6).contains(&few.quantile(0.999)), "more than the largest");
        let many = Scores::new(20_000, ramp(20_000, 1.0), ramp(20_000, 0.5));
        assert!(many.single.len() == MAX_SCORES && (many.quantile(0.95) - 0.95).abs() < 2e-3);
    }

    #[test]
    fn a_correction_fades_where_nothing_was_learned() {
        assert_eq!(
            (
                applied_share(0.0, 2.0),
                applied_share(2.0, 2.0),
                applied_share(3.0, 2.0),
                applied_share(1.0, 2.0)
            ),
            (1.0, 0.0, 0.0, 0.5)
        );
        assert!(applied_share(0.0, 0.0).abs() < 1e-15);
    }
}
