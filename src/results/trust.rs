//! What of a fit is to be trusted: all, predictions alone, or nothing.

use schemars::JsonSchema;
use serde::Serialize;

use super::residual_test::exceeds_noise;
use crate::fit::{FindingCode, Identification, PriorComparison};

/// Findings by which held-out rows, new rows or other rows contradict a fit without errors.
const CONTRADICTING: [FindingCode; 7] = [
    FindingCode::HeldOutNotBetter,
    FindingCode::HeldOutBeyondPrediction,
    FindingCode::HeldOutOutliers,
    FindingCode::HeldOutUncertain,
    FindingCode::EarlierEstimateContradicted,
    FindingCode::RowsChanged,
    FindingCode::SetUpUndecided,
];
/// Largest ratio of the noise variance that a fit with a prior assumes to the declared one, at
/// which they are equal but for rounding.
const MAX_EQUAL_VARIANCE_RATIO: f64 = 1.0 + 1e-9;

/// What of a fit is to be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Trust {
    /// Nothing: a finding is an error.
    NotTrusted,
    /// Not known: priors decide most of the fit, so that its residual cannot contradict it.
    NotJudged,
    /// The fit has no errors, but rows contradict it beyond chance.
    Contradicted,
    /// Predictions within their error bound, but not each parameter: the residual is larger than
    /// the declared σ explains, and parameters may have absorbed what the model lacks.
    Predictions,
    /// Predictions and parameters, with their standard errors.
    Trusted,
}

impl Trust {
    /// Judges a fit. `exceeds_bounds` is true if more held-out configurations exceed their error
    /// bound than chance explains.
    pub(crate) fn of(found: &Identification, exceeds_bounds: bool) -> Self {
        if !found.is_trusted() {
            Self::NotTrusted
        } else if found.has(FindingCode::PriorsDecide) {
            Self::NotJudged
        } else if exceeds_bounds
            || found.prior.as_ref().is_some_and(PriorComparison::is_contradicted)
            || CONTRADICTING.iter().any(|code| found.has(*code))
        {
            Self::Contradicted
        } else if exceeds_noise(found) || raised_variance(found).is_some() {
            Self::Predictions
        } else {
            Self::Trusted
        }
    }
}

/// Returns the ratio of the noise variance that a fit with a prior assumes to the declared one, if
/// it is larger.
pub(crate) fn raised_variance(found: &Identification) -> Option<f64> {
    let prior = found.prior.as_ref().filter(|prior| prior.estimated_sigma.is_none())?;
    Some(prior.variance_ratio).filter(|ratio| *ratio > MAX_EQUAL_VARIANCE_RATIO)
}
