//! Errors of arms in words: before and after, and poses whose errors nobody knows.

use super::quantity::{counted, mm};
use crate::identify::{ErrorSummary, Errors};

/// The arm before anything was identified.
pub(super) const NOMINAL: &str = "nominal arm, base and tool fitted";

/// What errors of a kind of rows are, and in which unit they are shown.
pub(super) fn measure(of: &ErrorSummary) -> &'static str {
    match of.kind {
        "point" => "missed point, mm",
        "distance" => "distance, mm",
        "surface" => "distance from the surface, mm",
        "tilt" => "tilt, mrad",
        "known distance" => "known distance, mm",
        _ => "error, mm",
    }
}

/// Cells of a table of errors: whose, on which poses, mean, rms and largest distance \[mm\].
pub(super) fn row(poses: &str, arm: &str, of: &ErrorSummary) -> Vec<String> {
    let values = [of.mean.norm, of.rms.norm, of.max.norm].map(|value| mm(value, 4));
    [vec![poses.to_owned(), arm.to_owned()], values.to_vec()].concat()
}

/// "mean 0.1 mm, rms 0.2 mm".
pub(super) fn mean_and_rms(of: &ErrorSummary) -> String {
    format!("mean {} mm, rms {} mm", mm(of.mean.norm, 4), mm(of.rms.norm, 4))
}

/// For each arm by name the poses that have no equilibrium with it, so that no mean over their errors exists; `None` where
/// all errors are known.
pub(super) fn unpredicted(arms: &[(&str, &Errors)]) -> Option<String> {
    let mut parts = Vec::new();
    for (arm, errors) in arms {
        for (poses, of) in [("held-out", &errors.held_out), ("identification", &errors.identification)] {
            if of.unpredicted > 0 {
                parts.push(format!("{} with {arm}", without_equilibrium(of, poses)));
            }
        }
    }
    let poses = parts.join("; ");
    let all = arms.iter().flat_map(|(_, errors)| [&errors.held_out, &errors.identification]);
    match poses.as_str() {
        "" if all.into_iter().all(|of| of.rms.norm.is_finite()) => None,
        "" => Some("Some errors are too large for their squares to be numbers.".to_owned()),
        _ => Some(format!("{poses}. Over such poses there is no mean, rms or largest error.")),
    }
}

/// "3 of 50 held-out poses have no equilibrium".
pub(super) fn without_equilibrium(of: &ErrorSummary, poses: &str) -> String {
    let have = if of.unpredicted == 1 { "has" } else { "have" };
    format!("{} of {} {have} no equilibrium", of.unpredicted, counted(of.n, &format!("{poses} pose")))
}
