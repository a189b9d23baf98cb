//! Errors of rows that were left out, and what they say of further rows.

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

/// Errors of the rows fitted, each predicted without its configuration or its block.
#[derive(Debug, Clone)]
pub(super) struct LeftOutErrors {
    /// Length of measured − predicted of each row \[m\].
    pub errors: Vec<f64>,
    /// The same over the size that its variance leads to expect \[1\].
    pub scores: Vec<f64>,
}

impl LeftOutErrors {
    /// Errors of a faded correction: `beside` the remainder, and with parameters `alone`.
    pub fn of(hyper: &Hyperparameters, rows: &Rows, alone: &[LeftOut], beside: &[LeftOut]) -> Self {
        let noise = AXES as f64 * hyper.noise_variance();
        let one = |(row, (alone, beside)): (usize, (&LeftOut, &LeftOut))| {
            let prior = variance(hyper, rows, row).trace();
            let share = fade(beside.variance - noise, prior);
            let correction = alone.error - beside.error;
            let error = (alone.error - correction * share).norm();
            let missed = if prior > 0.0 { (1.0 - share) * correction.norm() } else { 0.0 };
            (error, error / expected_size(beside.variance, missed))
        };
        let (errors, scores) = alone.iter().zip(beside).enumerate().map(one).unzip();
        Self { errors, scores }
    }
}

/// Size of an error from the trace of its covariance and from what fading leaves out \[m\].
pub(super) fn expected_size(variance: f64, missed: f64) -> f64 {
    (variance + missed * missed).sqrt()
}

/// What a remainder gains on configurations left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gain {
    /// Mean left-out error with the parameters alone \[m\].
    pub without: f64,
    /// Mean left-out error with the remainder \[m\].
    pub with: f64,
    /// Standard error of the mean difference over the configurations \[m\].
    pub std_error: f64,
    /// Gain in the logarithm of the marginal likelihood, priors of the hyperparameters included.
    pub evidence: f64,
}

impl Gain {
    /// Gain of each configuration's mean error, averaged over `configurations`.
    pub(super) fn of(
        configurations: &[Vec<usize>],
        (without, with): (&[f64], &[f64]),
        evidence: f64,
    ) -> Self {
        let mean = |rows: &[usize], of: &[f64]| {
            rows.iter().map(|&row| of[row]).sum::<f64>() / rows.len() as f64
        };
        let n = configurations.len() as f64;
        let before: Vec<f64> = configurations.iter().map(|rows| mean(rows, without)).collect();
        let after: Vec<f64> = configurations.iter().map(|rows| mean(rows, with)).collect();
        let (without, with) = (before.iter().sum::<f64>() / n, after.iter().sum::<f64>() / n);
        let squares = before.iter().zip(&after).map(|(a, b)| (a - b - (without - with)).powi(2));
        let std_error = (squares.sum::<f64>() / (n - 1.0) / n).sqrt();
        Self { without, with, std_error, evidence }
    }

    /// Mean gain over its standard error.
    pub fn ratio(&self) -> f64 {
        (self.without - self.with) / self.std_error
    }
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

    /// Factor from the expected size of an error to a bound that holds with probability `level`:
    /// the larger of both quantiles ⌈level (G + 1)⌉ / G over G configurations.
    ///                                          [Lei, G'Sell, Rinaldo, Tibshirani & Wasserman 2018]
    pub fn quantile(&self, level: f64) -> f64 {
        let count = self.configurations.max(1) as f64;
        let part = ((level * (count + 1.0)).ceil() / count).min(1.0);
        let of = |scores: &[f64]| {
            let last = scores.len().saturating_sub(1);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a rank between 0 and the last one"
            )]
            let rank = (part * last as f64).ceil() as usize;
            scores.get(rank).copied().unwrap_or(0.0)
        };
        of(&self.single).max(of(&self.blocks))
    }
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
        // ⌈0.95 · 100⌉ = 95 of 99.
        assert!((few.quantile(0.95) - 2.0 * 96.0 / 99.0).abs() < 1.1 / 99.0 * 2.0);
        assert!((few.quantile(0.999) - 2.0).abs() < 1e-15, "no more than the largest");
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
