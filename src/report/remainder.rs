//! Sentences about a remainder and about bounds of prediction errors.

use std::fmt::Write as _;

use crate::fit::{Identification, Residual};
use crate::quantity::format::{counted, number};
use crate::remainder::{Bounds, Fitted, Gain};

/// Returns one sentence on the result of the search for a remainder; `found` holds the errors
/// without it.
pub fn remainder_text(found: &Identification, fitted: &Fitted) -> String {
    let Some(gain) = fitted.gain.filter(|_| !fitted.is_declared) else {
        return match &fitted.residuals {
            Some(corrected) => {
                let before = number(found.fitted.held_out.mean.norm * 1e3, 4);
                let after = number(corrected.errors.held_out.mean.norm * 1e3, 4);
                format!(
                    "Corrected by the remainder that the problem declares: mean error of held-out \
                     poses {before} mm without it, {after} mm with it."
                )
            }
            None => "No remainder: too few configurations to fit one.".to_owned(),
        };
    };
    let [without, with] = [gain.without, gain.with].map(|error| number(error * 1e3, 4));
    match &fitted.residuals {
        Some(corrected) => {
            let before = number(found.fitted.held_out.mean.norm * 1e3, 4);
            let after = number(corrected.errors.held_out.mean.norm * 1e3, 4);
            let joints = fitted.remainder.as_ref().map_or(0, |pose| pose.joints().len());
            format!(
                "Remainder at {}, kept: mean error of configurations left out {without} mm \
                 without it, {with} mm with it; of held-out poses {before} mm and {after} mm.",
                counted(joints, "joint"),
            )
        }
        None => format!(
            "No remainder is kept: mean error of configurations left out {without} mm without it, \
             {with} mm with it, a gain of {} standard errors (more than {} are needed); the log \
             predictive density changes by {} per row (a rise is needed), the log likelihood by {} \
             (more than {} is needed).",
            number(gain.error.ratio(), 2),
            number(gain.threshold(), 2),
            number(gain.density.mean, 2),
            number(gain.evidence, 2),
            number(Gain::least_evidence(), 2),
        ),
    }
}

/// Returns the expected error and its bound in words. If there are `residuals`, adds the share of
/// rows within their bounds.
pub(super) fn bounded(bounds: &Bounds, residuals: Option<&[Residual]>) -> String {
    let mut words = format!(
        "Expected error {} mm rms; the {} % bound is {} mm on average",
        number(bounds.expected() * 1e3, 3),
        (bounds.level * 1e6).round() / 1e4,
        number(bounds.mean() * 1e3, 3),
    );
    if let Some(residuals) = residuals {
        let share = bounds.coverage(residuals.iter().map(|pose| pose.position.norm()));
        let _ = write!(words, "; {} % of these rows lie within theirs", number(share * 100.0, 1));
    }
    let beyond = bounds.poses.iter().filter(|pose| pose.is_extrapolated).count();
    if beyond > 0 {
        let poses = counted(beyond, "pose");
        let _ = write!(words, "; {poses} outside of what was measured, with wider bounds");
    }
    words
}
