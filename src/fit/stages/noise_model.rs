//! Noise model: conversion of the declared σ of each row to the σ that a fit assumes.

use statrs::distribution::{ChiSquared, ContinuousCDF as _};

/// Probability of so large or so small a residual under the declared σ, below which the declared σ
/// is contradicted.
pub(in crate::fit) const MAX_CHANCE_PROBABILITY: f64 = 1e-3;
/// Smallest σ that a fit assumes \[m\]; it is above the rounding errors of predicted positions.
pub(in crate::fit) const MIN_SIGMA: f64 = 1e-9;

/// Noise model: a fit assumes √((scale σ)² + e²) for a row with the declared σ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::fit) struct NoiseModel {
    /// Factor on the declared σ: usually 1; less if the declared σ are too large, more if rows of
    /// several kinds scatter more than declared.
    pub scale: f64,
    /// Standard deviation (1 σ) e of the error of the arm model, which is added to the noise in
    /// quadrature \[m\], for orientations \[rad\].
    pub model_error: f64,
}

impl NoiseModel {
    /// Noise model with which a fit assumes every σ as declared.
    pub const DECLARED: Self = Self { scale: 1.0, model_error: 0.0 };

    /// Returns the σ that the fit assumes for a declared `sigma`, in the same unit.
    pub fn assumed_sigma(self, sigma: f64) -> f64 {
        if self == Self::DECLARED { sigma } else { (self.scale * sigma).hypot(self.model_error) }
    }

    /// Creates the model that scales all `declared` σ by one factor, so that the mean variance of
    /// the rows is `ratio` times that of the last fit.
    ///
    /// Solves Σ (scale σ)² / assumed² = N ratio, with the σ `assumed` in the last fit.
    pub fn scaled(declared: &[f64], assumed: &[f64], ratio: f64) -> Self {
        let sum: f64 =
            declared.iter().zip(assumed).map(|(sigma, assumed)| (sigma / assumed).powi(2)).sum();
        let largest = declared.iter().copied().fold(0.0, f64::max);
        let min_scale = (MIN_SIGMA / largest).min(1.0);
        Self {
            scale: (declared.len() as f64 * ratio / sum).sqrt().max(min_scale),
            model_error: 0.0,
        }
    }

    /// Creates the model that adds one model error e to all `declared` σ, so that the mean variance
    /// of the rows is `ratio` times that of the last fit.
    ///
    /// Solves Σ (σ² + e²) / assumed² = N ratio for e, with the σ `assumed` in the last fit. If no e
    /// ≥ 0 is a solution, all σ are scaled down by one factor instead.
    pub fn raised(declared: &[f64], assumed: &[f64], ratio: f64) -> Self {
        let n = declared.len() as f64;
        let sum: f64 =
            declared.iter().zip(assumed).map(|(sigma, assumed)| (sigma / assumed).powi(2)).sum();
        let weights: f64 = assumed.iter().map(|sigma| sigma.powi(-2)).sum();
        let squared = (n * ratio - sum) / weights;
        if squared > 0.0 {
            return Self { scale: 1.0, model_error: squared.sqrt() };
        }
        let largest = declared.iter().copied().fold(0.0, f64::max);
        let scale = (n * ratio / sum).sqrt().clamp((MIN_SIGMA / largest).min(1.0), 1.0);
        Self { scale, model_error: 0.0 }
    }
}

/// Returns the critical value of a likelihood-ratio statistic 2 ln λ with one degree of freedom at
/// probability 0.001.
pub(in crate::fit) fn by_chance() -> f64 {
    ChiSquared::new(1.0).map_or(f64::INFINITY, |distribution| {
        distribution.inverse_cdf(1.0 - MAX_CHANCE_PROBABILITY)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_error_adds_to_every_sigma_and_a_sigma_too_large_is_scaled() {
        let declared = [1e-5, 2e-5, 4e-5];
        let more = NoiseModel::raised(&declared, &declared, 100.0);
        let ratio: f64 =
            declared.iter().map(|&sigma| (more.assumed_sigma(sigma) / sigma).powi(2)).sum::<f64>()
                / 3.0;
        assert!((more.scale - 1.0).abs() < 1e-15 && (ratio - 100.0).abs() < 1e-9, "{more:?}");
        let less = NoiseModel::raised(&declared, &declared, 0.01);
        assert!((less.scale - 0.1).abs() < 1e-12 && less.model_error == 0.0, "{less:?}");
        assert!((NoiseModel::DECLARED.assumed_sigma(0.3) - 0.3).abs() < 1e-15);
    }
}
