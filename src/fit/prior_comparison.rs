//! Comparison of the posterior of a fit with an earlier estimate that was its prior.

use std::path::PathBuf;

use crate::quantity::Unit;

/// Prior, new data and posterior of a fit that had an earlier estimate as prior.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PriorComparison {
    /// Path of the earlier estimate.
    pub file: PathBuf,
    /// Days of drift by which the prior was widened.
    pub days: f64,
    /// Number of rows that were left out, because the earlier estimate was fitted to them.
    pub left_out: usize,
    /// Standard deviation (1 σ) of a coordinate \[m\] taken from the earlier fit; `None` if that
    /// is the declared one.
    pub sigma: Option<f64>,
    /// Noise variance taken from the earlier fit, relative to the declared one; 1 if that is the
    /// declared one, or none is declared.
    pub variance_ratio: f64,
    /// Standard deviation (1 σ) of a coordinate \[m\] that the earlier fit estimated; `None` if
    /// the problem declares σ.
    pub estimated_sigma: Option<f64>,
    /// True if the prior contains that of a fleet.
    pub includes_fleet: bool,
    /// χ² of the new rows under the prior, its degrees of freedom, and its p-value.
    pub chi2: Option<(f64, f64, f64)>,
    /// Causes for which the new rows contradict the prior, in the order in which they were found.
    pub causes: Vec<String>,
    /// Parameters that the prior informs on.
    pub parameters: Vec<ComparedParameter>,
}

/// Parameter with its prior, what the new rows say of it, and its posterior; SI units.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ComparedParameter {
    pub name: String,
    pub unit: Unit,
    /// Value and standard error of the earlier estimate, widened by drift.
    pub prior: (f64, f64),
    /// Value and standard error by the new rows, with the prior of the other parameters; `None` if
    /// they say nothing, or if the parameter is at a bound.
    pub data: Option<(f64, f64)>,
    /// Value and standard error of the fit; no standard error at a bound.
    pub posterior: (f64, Option<f64>),
    /// Difference of data and prior, in units of its standard deviation.
    pub difference: Option<f64>,
}
