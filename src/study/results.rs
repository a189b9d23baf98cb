//! Results of a study by cell and by parameter.

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::Serialize;

use super::definition::{Cell, Study};
use super::tally::{ParameterTally, Tally};
use crate::numeric::median;

/// Results of a finished study.
#[derive(Debug, Clone)]
pub struct Results {
    /// Results of each cell, in the order of the study.
    pub cells: Vec<CellResult>,
}

/// Results of one cell over all its repetitions.
#[derive(Debug, Clone)]
pub struct CellResult {
    /// Noise level, number of poses, strategy and solver of the fits.
    pub cell: Cell,
    /// Statistics over the fits.
    pub tally: Tally,
    /// Duration of each fit \[s\]; differs from run to run.
    pub seconds: Vec<f64>,
}

/// Errors of the estimates of one parameter of a cell; its deviation x is in \[rad\], \[m\], or
/// ln(value / nominal).
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[schemars(rename = "StudiedParameter")]
pub struct ParameterResult {
    pub name: String,
    /// Unit of the errors: SI, or `relative` for errors of ln(value).
    pub unit: Cow<'static, str>,
    /// Number of trusted fits whose truth is known.
    pub fits: u64,
    /// Mean of estimate − truth, in the unit of x.
    pub bias: Option<f64>,
    /// Standard deviation of estimate − truth, in the unit of x.
    pub spread: Option<f64>,
    /// Root mean square of estimate − truth, in the unit of x.
    pub rms_error: Option<f64>,
    /// Number of fits that report a standard error.
    pub with_std_error: u64,
    /// Mean of the reported standard errors, in the unit of x.
    pub std_error: Option<f64>,
    /// Fraction of the fits with a standard error whose estimate is within 1.96 standard errors of
    /// the truth.
    pub coverage: Option<f64>,
}

/// Durations of the fits of a cell \[s\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Timing {
    /// Median duration of a fit \[s\].
    pub median: f64,
    /// Duration of the slowest fit \[s\].
    pub slowest: f64,
    /// Total duration of all fits \[s\].
    pub total: f64,
}

impl CellResult {
    /// Returns the fraction of the fits that failed or are not trusted.
    pub fn failure_rate(&self) -> f64 {
        self.tally.failed() as f64 / self.tally.fits.max(1) as f64
    }

    /// Returns the statistics of every free parameter.
    pub fn parameters(&self, study: &Study) -> impl Iterator<Item = ParameterResult> {
        study.parameters.iter().zip(&self.tally.parameters).map(|(parameter, tally)| {
            let ParameterTally { error, std_error, covered } = tally;
            let unit = parameter.unit();
            ParameterResult {
                name: parameter.name.clone(),
                unit: if unit.is_relative() { "relative".into() } else { unit.symbol() },
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

    /// Returns the fraction of all estimates with a standard error, over fits and parameters, that
    /// are within 1.96 standard errors of the truth; `None` if there are none.
    pub fn coverage(&self) -> Option<f64> {
        let sum = |of: fn(&ParameterTally) -> u64| self.tally.parameters.iter().map(of).sum();
        share(sum(|tally| tally.covered), sum(|tally| tally.std_error.count))
    }

    /// Returns the name of the parameter with the largest ratio of bias to standard deviation of
    /// its errors, and the signed ratio; `None` if no parameter has both.
    pub fn largest_bias(&self, study: &Study) -> Option<(String, f64)> {
        let ratio = |result: ParameterResult| {
            let spread = result.spread.filter(|spread| *spread > 0.0)?;
            Some((result.name, result.bias? / spread))
        };
        self.parameters(study).filter_map(ratio).max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
    }

    /// Returns statistics of the durations of the fits.
    pub fn timing(&self) -> Timing {
        let seconds = || self.seconds.iter().copied();
        let median = median(seconds()).unwrap_or(0.0);
        Timing { median, slowest: seconds().fold(0.0, f64::max), total: seconds().sum() }
    }
}

/// Returns the ratio of two counts, or `None` if the whole is zero.
fn share(part: u64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part as f64 / whole as f64)
}
