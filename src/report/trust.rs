//! Sentence that states whether a fit is to be trusted.

use super::errors::{test_rows_word, with_unit};
use super::noise::raised_sigma_ratio;
use super::remainder::PredictionAccuracy;
use crate::fit::{FindingCode, Identification};
use crate::quantity::format::number;
use crate::results::ResidualSize;

/// Codes of warnings that contradict a trusted fit or its predictions, so that its headline names
/// reservations.
const RESERVATIONS: [FindingCode; 3] =
    [FindingCode::HeldOutBeyondPrediction, FindingCode::HeldOutNotBetter, FindingCode::RowsChanged];

/// States whether the fit is to be trusted, the held-out error before and after it, and how much
/// its residual exceeds the declared noise.
pub(super) fn outcome(found: &Identification, accuracy: Option<&PredictionAccuracy>) -> String {
    if let Some(reason) = found.first_error() {
        return format!("Not to be trusted: {reason}.");
    }
    let [before, fitted] = [&found.registered, &found.fitted].map(|errors| &errors.held_out);
    let corrected = accuracy.and_then(|accuracy| accuracy.corrected.as_ref());
    let after = corrected.unwrap_or(fitted);
    let is_larger = match ResidualSize::of(found) {
        ResidualSize::Contradicted(chi2) | ResidualSize::Unclear(chi2) => chi2 > 1.0,
        _ => false,
    };
    if !(before.mean.norm.is_finite() && after.mean.norm.is_finite()) {
        return "The fit is to be trusted.".to_owned();
    }
    let has_bound = accuracy.is_some_and(|accuracy| accuracy.bound.is_some());
    let is_raised = raised_sigma_ratio(found).is_some();
    let scope =
        if (is_larger || is_raised) && has_bound { " within the error bound below" } else { "" };
    let is_reserved =
        is_raised || found.cautions().any(|caution| RESERVATIONS.contains(&caution.code));
    let reserved = if is_reserved { ", with reservations (see the warnings)" } else { "" };
    let size = if found.noise_factor > 1.0 {
        format!("{} × the declared σ", number(found.noise_factor.sqrt(), 1))
    } else {
        "larger than the declared σ explains".to_owned()
    };
    let of = if corrected.is_some() { " without the remainder" } else { "" };
    let without = if corrected.is_some() {
        format!(" ({} without the remainder)", with_unit(fitted, fitted.mean.norm))
    } else {
        String::new()
    };
    let [from, to] = [with_unit(before, before.mean.norm), with_unit(after, after.mean.norm)];
    let change = if from == to {
        format!("stays at {to}")
    } else if after.mean.norm < before.mean.norm {
        format!("falls from {from} to {to}")
    } else {
        format!("does not fall: it goes from {from} to {to}")
    };
    format!(
        "Trusted{scope}{reserved}: the mean {} error {change}{without}.{}",
        test_rows_word(&found.fitted).replace(' ', "-"),
        if is_larger {
            format!(" Not fully explained: the residual{of} is {size}.")
        } else if let Some(ratio) = raised_sigma_ratio(found) {
            format!(
                " Not fully explained: the new rows contradict the prior, so the fit assumes {} × the declared σ.",
                number(ratio, 1)
            )
        } else {
            String::new()
        }
    )
}
