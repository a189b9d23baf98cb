//! Error of predictions over the workspace, now and after more poses.

use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use super::Site;
use crate::fit::Identification;
use crate::measurement::Measurements;
use crate::remainder::Correction;

/// Smallest misfit that is assumed, as a fraction of the noise; no real arm is free of misfit.
const MIN_MISFIT_RATIO: f64 = 0.5;
/// Degrees of freedom of the prior assumption that misfit and noise are equally large. The
/// assumption dominates while there are few measured poses.
const PRIOR_FREEDOM: f64 = 10.0;
/// Probability with which the bound over the workspace is not too low.
const CONFIDENCE: f64 = 0.9;

/// Standard errors of the expected error by which a tolerance must be too small to be out of reach.
const REACH_SIGMAS: f64 = 2.0;

/// Returns the quantile of the length of a normal vector in space, relative to its root mean
/// square.
pub(super) fn normal_bound(level: f64) -> f64 {
    ChiSquared::new(3.0).map_or(0.0, |squares| (squares.inverse_cdf(level) / 3.0).sqrt())
}

/// Sizes of noise and misfit, estimated from the residuals of a fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MisfitSize {
    /// 1 σ of the noise of one coordinate \[m\].
    pub noise: f64,
    /// Root mean square misfit of the position along each axis \[m\].
    pub misfit: f64,
    /// Residual degrees of freedom: number of measured coordinates minus the sum of the identified
    /// shares of the fitted parameters.
    pub freedom: f64,
}

impl MisfitSize {
    /// Splits the variance of the residuals of a fit. The misfit is the part beyond the declared
    /// noise; without declared noise, half of the variance is taken as noise. `declared` is the
    /// declared σ of a position \[m\]: a fit with a prior may assume a larger one.
    pub fn of(found: &Identification, (has_declared_noise, declared): (bool, Option<f64>)) -> Self {
        let identified: f64 = found
            .estimates
            .iter()
            .filter(|estimate| estimate.fitted)
            .map(|estimate| estimate.identified)
            .sum();
        let coordinates = found.coordinates as f64;
        let freedom = (coordinates - identified).max(0.0);
        let sum = found.fitted.identification.rms.norm.powi(2) / 3.0 * coordinates;
        let noise = if has_declared_noise {
            declared.unwrap_or(found.sigma)
        } else {
            found.sigma / 2_f64.sqrt()
        };
        let variance = noise * noise;
        let scatter = (sum + PRIOR_FREEDOM * 2.0 * variance) / (freedom + PRIOR_FREEDOM);
        let misfit = (scatter - variance).max((MIN_MISFIT_RATIO * noise).powi(2)).sqrt();
        Self { noise, misfit, freedom }
    }
}

/// Error measured − predicted over the workspace.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorkspaceError {
    /// Expected root mean square error length, measurement noise included \[m\].
    pub expected: f64,
    /// 1 σ of the expected error \[m\].
    pub expected_sigma: f64,
    /// Length that errors in the workspace do not exceed with the requested probability \[m\].
    pub bound: f64,
    /// Part of the expected error that no estimate of the parameters removes: noise and misfit
    /// \[m\].
    pub least: f64,
    /// Length below which no number of poses can be expected to bring the bound \[m\]: the bound of
    /// normally distributed errors with the root mean square `least`, less
    /// [`REACH_SIGMAS`] standard errors.
    pub least_bound: f64,
}

impl WorkspaceError {
    /// Estimates the error of predictions at the poses of `table` from the errors of configurations
    /// that were left out of the fit. `freedom` is the number of residual degrees of freedom.
    /// `None` if no configuration was left out.
    pub(super) fn of(
        correction: &Correction,
        site: &Site,
        table: &Measurements,
        (level, freedom): (f64, f64),
    ) -> Option<Self> {
        let sizes = site.expected_sizes(correction, table);
        let freedom = freedom.max(3.0);
        let scale = correction.left_out_scale()?;
        let bound = correction.pooled_bound(&sizes, level, (CONFIDENCE, freedom))?;
        let squares: f64 = sizes.iter().map(|size| size * size).sum();
        let expected = scale * (squares / sizes.len() as f64).sqrt();
        let least = (scale * correction.noise_length()).min(expected);
        let error = 1.0 / (2.0 * freedom).sqrt();
        let reach = normal_bound(level) * (1.0 - REACH_SIGMAS * error).max(0.0);
        let least_bound = least * reach;
        Some(Self { expected, expected_sigma: expected * error, bound, least, least_bound })
    }

    /// Returns the error after the variance that the parameters cause has fallen to a `share` of
    /// its present value.
    pub(super) fn with_parameters(self, share: f64) -> Self {
        let (square, least) = (self.expected * self.expected, self.least * self.least);
        let ratio = ((least + (square - least) * share) / square).sqrt();
        Self {
            expected: self.expected * ratio,
            expected_sigma: self.expected_sigma * ratio,
            bound: self.bound * ratio,
            least: self.least,
            least_bound: self.least_bound,
        }
    }
}
