//! Remainder, bounds of prediction errors, and posterior covariance in the results of commands.

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::Serialize;
use serde_json::value::RawValue;

use super::document::json_rows;
use super::summary::Summary;
use crate::fit::{Estimate, Identification};
use crate::remainder::{Bounds, Fitted};

/// Name of the file that holds a remainder.
pub const REMAINDER_FILE: &str = "remainder.json";

/// Remainder (smooth correction of errors that no law explains) that corrects predictions.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Remainder {
    /// Name of the remainder's file in the same folder; null if the problem declares the remainder.
    pub file: Option<&'static str>,
    /// Joints whose errors the remainder describes.
    pub sites: Vec<String>,
    /// Quantities on which the joint errors of the remainder depend.
    pub inputs: Vec<String>,
    /// Mean error of configurations left out of the fit, without the remainder.
    pub left_out_without_mm: Option<f64>,
    /// Mean error of configurations left out of the fit, with the remainder.
    pub left_out_mm: Option<f64>,
    /// Mean gain at configurations left out of the fit, divided by its standard error.
    pub gain_over_std_error: Option<f64>,
    /// Mean increase of the logarithm of the predictive density of the left-out rows, divided by
    /// its standard error.
    pub density_gain_over_std_error: Option<f64>,
    pub identification_without: Summary,
    pub held_out_without: Summary,
}

impl Remainder {
    /// Summarises the accepted remainder of `fitted`; `found` has the errors without it. `None` if
    /// no remainder was accepted.
    pub(super) fn new(found: &Identification, fitted: &Fitted) -> Option<Self> {
        let remainder = fitted.remainder.as_ref()?;
        let joints = remainder.joints().into_iter();
        Some(Self {
            file: (!fitted.is_declared).then_some(REMAINDER_FILE),
            sites: joints.map(|joint| format!("joint {}", joint + 1)).collect(),
            inputs: remainder.inputs(),
            left_out_without_mm: fitted.gain.map(|gain| gain.without * 1e3),
            left_out_mm: fitted.gain.map(|gain| gain.with * 1e3),
            gain_over_std_error: fitted.gain.map(|gain| gain.error.ratio()),
            density_gain_over_std_error: fitted.gain.map(|gain| gain.density.ratio()),
            identification_without: Summary::of(&found.fitted.identification),
            held_out_without: Summary::of(&found.fitted.held_out),
        })
    }
}

/// Summary of the bounds on prediction errors.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct BoundSummary {
    /// Expected root mean square of measured − predicted, with the noise of a measurement.
    pub expected_error_mm: f64,
    /// Probability with which an error stays below its bound, 0 to 1.
    pub level: f64,
    pub mean_bound_mm: f64,
}

impl BoundSummary {
    /// Summarises the error bounds of poses.
    pub(super) fn new(bounds: &Bounds) -> Self {
        Self {
            expected_error_mm: bounds.expected() * 1e3,
            level: bounds.level,
            mean_bound_mm: bounds.mean() * 1e3,
        }
    }
}

/// Returns the uncertainty of predictions without a remainder as JSON text; `None` if the text is
/// not valid JSON.
pub(super) fn prediction(fitted: &Fitted) -> Option<Box<RawValue>> {
    RawValue::from_string(fitted.alone.to_text().trim_end().to_owned()).ok()
}

/// Returns the rows of the posterior covariance of all free parameters, SI, each as one line of
/// JSON text. Rows and columns are in the order of the estimates; entries of held parameters are 0.
///
/// The correlations are those of the uncertainty of predictions. The variance of an estimate with a
/// standard error is the square of that error.
pub(super) fn covariance(found: &Identification, fitted: &Fitted) -> Vec<Box<RawValue>> {
    let n = found.estimates.len();
    let (names, posterior) = fitted.alone.parameter_covariance();
    let index = |name: &&str| found.estimates.iter().position(|estimate| estimate.name == **name);
    let indices: Vec<Option<usize>> = names.iter().map(index).collect();
    // The posterior of a stiffness is that of its logarithm: d value = value · d ln(value).
    let slope = |k: usize| {
        let estimate = &found.estimates[k];
        if estimate.unit.is_relative() { estimate.estimate } else { 1.0 }
    };
    let mut covariance = DMatrix::zeros(n, n);
    for (i, k) in indices.iter().enumerate() {
        for (j, l) in indices.iter().enumerate() {
            if let (Some(k), Some(l)) = (*k, *l) {
                covariance[(k, l)] = slope(k) * posterior[(i, j)] * slope(l);
            }
        }
    }
    let factor = |(k, estimate): (usize, &Estimate)| {
        let spread = f64::sqrt(covariance[(k, k)]);
        estimate.std_error.filter(|_| spread > 0.0).map_or(1.0, |error| error / spread)
    };
    let factors: Vec<f64> = found.estimates.iter().enumerate().map(factor).collect();
    json_rows(n, |k, l| factors[k] * covariance[(k, l)] * factors[l])
}
