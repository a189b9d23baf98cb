//! Comparison of a fit with the earlier estimate that was its prior.

use std::path::PathBuf;

use crate::quantity::Unit;

/// Prior, new data and posterior of a fit that had an earlier estimate as prior.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PriorComparison {
    /// Path of the earlier estimate.
    pub file: PathBuf,
    /// Time over which drift widened the prior \[days\].
    pub days: f64,
    /// Number of rows that were left out of the fit, because the earlier estimate was fitted to
    /// them.
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
    /// True if the prior of a fleet is part of the earlier estimate.
    pub includes_fleet: bool,
    /// χ² of the new rows as predicted by the prior, its degrees of freedom, and its p-value;
    /// `None` if it was not computed.
    pub chi2: Option<(f64, f64, f64)>,
    /// Texts of the causes of change that explain why the new rows contradict the prior, in the
    /// order in which they were found. Empty if the rows agree with the prior.
    pub causes: Vec<String>,
    /// True if one of `causes` is larger noise, so that the fit assumes a larger σ.
    pub has_raised_sigma: bool,
    /// True if larger noise is the most probable cause even after the fit allowed for all `causes`.
    pub is_unexplained: bool,
    /// Comparison of each parameter of which the prior contains information.
    pub parameters: Vec<ComparedParameter>,
}

/// Smallest p-value of the new rows at which they do not contradict the prior.
const MIN_AGREEING_P: f64 = 0.001;

impl PriorComparison {
    /// Returns the p-value of new rows that contradict the prior by χ²; `None` if they do not.
    pub fn contradicting_p(&self) -> Option<f64> {
        self.chi2.map(|(.., p)| p).filter(|p| *p < MIN_AGREEING_P)
    }

    /// Returns true if the new rows contradict the prior, by χ² or by a change that was found.
    pub fn is_contradicted(&self) -> bool {
        self.contradicting_p().is_some() || self.has_raised_sigma || !self.causes.is_empty()
    }
}

/// Parameter with its prior, the estimate from the new rows alone, and its posterior; SI units.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ComparedParameter {
    pub name: String,
    pub unit: Unit,
    /// Value and standard error of the earlier estimate, widened by drift.
    pub prior: (f64, f64),
    /// Value and standard error by the new rows, with the prior of the other parameters; `None` if
    /// the new rows contain no information on the parameter, or if it is at a bound.
    pub data: Option<(f64, f64)>,
    /// Value and standard error of the fit; the standard error is `None` at a bound.
    pub posterior: (f64, Option<f64>),
    /// Difference `data` − `prior`, divided by its standard deviation; `None` if `data` is.
    pub difference: Option<f64>,
}
