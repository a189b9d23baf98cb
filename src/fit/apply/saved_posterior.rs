//! Uncertainty of a saved estimate.

use std::collections::HashSet;

use nalgebra::DMatrix;

/// Uncertainty and noise of a saved estimate, from which the next identification of the arm makes
/// its prior.
#[derive(Debug, Clone)]
pub(crate) struct SavedPosterior {
    /// Covariance of the values of all parameters, SI; NaN where it was not written.
    pub covariance: DMatrix<f64>,
    /// Standard deviation (1 σ) of a measured coordinate that the fit assumed \[m\]; `None` in
    /// files of older versions.
    pub sigma_taken: Option<f64>,
    /// Noise variance that the fit assumed, relative to the declared one; 1 in files of older
    /// versions.
    pub noise_factor: f64,
    /// Digests of the rows that were fitted; empty in files of older versions.
    pub fitted_rows: HashSet<String>,
    /// True if the fit had an earlier estimate or a fleet as prior.
    pub has_prior: bool,
    /// True if the prior of a fleet is part of the prior of the fit.
    pub includes_fleet: bool,
}
