//! What a study found: each cell, and each parameter in it.

use super::study::{Cell, Study};
use super::tally::{ParameterTally, Tally};
use crate::model::parameter::Parameter;
use crate::numeric::median;

/// A finished study.
#[derive(Debug, Clone)]
pub struct Results {
    /// One result a cell, in the order of the study.
    pub cells: Vec<CellResult>,
}

/// One cell over all its repetitions.
#[derive(Debug, Clone)]
pub struct CellResult {
    /// What was fitted.
    pub cell: Cell,
    /// What came of it.
    pub tally: Tally,
    /// Time of each fit \[s\]; differs from run to run.
    pub seconds: Vec<f64>,
}

/// One parameter of a cell; x is a deviation \[rad\], \[m\], or ln(value / nominal).
#[derive(Debug, Clone, Copy)]
pub struct ParameterResult<'a> {
    /// The parameter.
    pub parameter: &'a Parameter,
    /// Trusted fits whose truth is known.
    pub fits: u64,
    /// Mean of estimate − truth.
    pub bias: Option<f64>,
    /// Standard deviation of estimate − truth.
    pub spread: Option<f64>,
    /// Root mean square of estimate − truth.
    pub rms_error: Option<f64>,
    /// Fits that claim a standard error.
    pub with_std_error: u64,
    /// Mean of the standard errors that they claim.
    pub std_error: Option<f64>,
    /// Share of them whose estimate is within 1.96 standard errors of the truth.
    pub coverage: Option<f64>,
}

/// How long the fits of a cell took \[s\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// Middle fit.
    pub median: f64,
    /// Slowest fit.
    pub slowest: f64,
    /// All fits.
    pub total: f64,
}

impl ParameterResult<'_> {
    /// Unit of errors: SI, or `relative` where they are of ln(value).
    pub fn unit(&self) -> &'static str {
        let unit = self.parameter.unit();
        if unit.is_relative() { "relative" } else { unit.symbol() }
    }
}

impl CellResult {
    /// Share of the fits that are not to be trusted.
    pub fn failure_rate(&self) -> f64 {
        self.tally.failed() as f64 / self.tally.fits.max(1) as f64
    }

    /// Every free parameter.
    pub fn parameters<'a>(&'a self, study: &'a Study) -> impl Iterator<Item = ParameterResult<'a>> {
        study.parameters.iter().zip(&self.tally.parameters).map(|(parameter, tally)| {
            let ParameterTally { error, std_error, covered } = tally;
            ParameterResult {
                parameter,
                fits: error.count,
                bias: error.mean(),
                spread: error.deviation(),
                rms_error: error.rms(),
                with_std_error: std_error.count,
                std_error: std_error.mean(),
                coverage: share(*covered, std_error.count),
            }
        })
    }

    /// Share of all standard errors, over fits and parameters, that cover the truth 1.96 times
    /// taken.
    pub fn coverage(&self) -> Option<f64> {
        let sum = |of: fn(&ParameterTally) -> u64| self.tally.parameters.iter().map(of).sum();
        share(sum(|tally| tally.covered), sum(|tally| tally.std_error.count))
    }

    /// The parameter whose bias is largest against its spread, and that ratio, with the sign of the
    /// bias.
    pub fn largest_bias<'a>(&'a self, study: &'a Study) -> Option<(&'a Parameter, f64)> {
        let ratio = |result: ParameterResult<'a>| {
            let spread = result.spread.filter(|spread| *spread > 0.0)?;
            Some((result.parameter, result.bias? / spread))
        };
        self.parameters(study).filter_map(ratio).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
    }

    /// How long the fits took.
    pub fn timing(&self) -> Timing {
        let seconds = || self.seconds.iter().copied();
        let median = median(seconds()).unwrap_or(0.0);
        Timing { median, slowest: seconds().fold(0.0, f64::max), total: seconds().sum() }
    }
}

fn share(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}
