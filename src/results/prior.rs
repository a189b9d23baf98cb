//! Comparison with an earlier estimate that was the prior, in estimate.json.

use std::borrow::Cow;

use schemars::JsonSchema;
use serde::Serialize;

use crate::fit::{ComparedParameter, PriorComparison};

/// Use of an earlier estimate as prior, and its agreement with the new rows.
#[derive(Debug, Serialize, JsonSchema)]
pub struct PriorUse {
    pub file: String,
    pub drift_days: f64,
    /// Number of rows that were left out, held-out rows included, because the earlier estimate was
    /// fitted to them.
    pub rows_left_out: usize,
    /// Standard deviation (1 σ) of a coordinate taken from the earlier fit; null if that is the
    /// declared one.
    pub sigma_mm: Option<f64>,
    /// True if the prior also contains mean and spread of a fleet.
    pub includes_fleet: bool,
    /// χ² of the new rows as the prior predicts them.
    pub chi2: Option<f64>,
    pub coordinates: Option<f64>,
    pub p_value: Option<f64>,
    /// Causes for which the new rows contradict the prior.
    pub contradicted_by: Vec<String>,
    pub parameters: Vec<PriorParameter>,
}

/// Parameter with its value by the prior, by the new rows, and by both together (posterior).
#[derive(Debug, Serialize, JsonSchema)]
pub struct PriorParameter {
    pub name: String,
    pub unit: Cow<'static, str>,
    /// Earlier estimate; drift widens its standard error.
    pub prior: Value,
    /// Estimate by the new rows, with the prior of the other parameters only. Null if these rows do
    /// not determine the parameter, or if it is at a bound.
    pub data: Option<Value>,
    pub posterior: Value,
    /// Difference `data` − `prior`, divided by the standard deviation of that difference.
    pub difference_sigmas: Option<f64>,
}

/// Value with its standard error.
#[derive(Debug, Serialize, JsonSchema)]
#[schemars(rename = "ValueWithError")]
pub struct Value {
    pub estimate: f64,
    /// Null at a bound.
    pub std_error: Option<f64>,
}

impl PriorUse {
    /// Converts the comparison of a fit with the earlier estimate that was its prior.
    pub(super) fn new(comparison: &PriorComparison) -> Self {
        let chi2 = comparison.chi2;
        Self {
            file: comparison.file.display().to_string(),
            drift_days: comparison.days,
            rows_left_out: comparison.left_out,
            includes_fleet: comparison.includes_fleet,
            sigma_mm: comparison.sigma.map(|sigma| sigma * 1e3),
            chi2: chi2.map(|(chi2, ..)| chi2),
            coordinates: chi2.map(|(_, coordinates, _)| coordinates),
            p_value: chi2.map(|(.., p_value)| p_value),
            contradicted_by: comparison.causes.clone(),
            parameters: comparison.parameters.iter().map(PriorParameter::new).collect(),
        }
    }
}

impl PriorParameter {
    fn new(compared: &ComparedParameter) -> Self {
        let value = |(estimate, error)| Value { estimate, std_error: Some(error) };
        Self {
            name: compared.name.clone(),
            unit: compared.unit.symbol(),
            prior: value(compared.prior),
            data: compared.data.map(value),
            posterior: Value { estimate: compared.posterior.0, std_error: compared.posterior.1 },
            difference_sigmas: compared.difference,
        }
    }
}
