//! Misreadings that explain why an arm does not fit its measurements.

use super::Misreading;

/// Misreading with which a full fit explains the measurements.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::fit) struct Explanation {
    /// Description of the misreading, with the size that the fit found.
    pub words: String,
    /// Root mean squared error that the fit leaves \[m\], with the deviations from priors.
    pub rms: f64,
}

/// Misreadings that would explain the misfit, best first.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::fit) struct Explanations {
    /// Misreadings with which the nominal arm is near the measurements.
    pub near: Vec<Misreading>,
    /// Misreadings with which a full fit is far better than without.
    pub fitted: Vec<Explanation>,
    /// Root mean squared error without a misreading, deviations from priors included \[m\].
    pub as_read: f64,
}
