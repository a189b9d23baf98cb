//! Misreadings that explain why an arm does not fit its measurements.

use super::Misreading;

/// Misreading that explains the measurements after a fit in full.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::fit) struct Explanation {
    /// Description with the size that the fit found.
    pub words: String,
    /// Root mean squared error that the fit leaves \[m\], with the deviations from priors.
    pub rms: f64,
}

/// Misreadings that explain why an arm does not fit, the best first.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::fit) struct Explanations {
    /// Misreadings with which the nominal arm is near.
    pub near: Vec<Misreading>,
    /// Misreadings with which the fit is far better than as read.
    pub fitted: Vec<Explanation>,
    /// Root mean squared error as read, fitted or not, with the deviations from priors \[m\].
    pub as_read: f64,
}
