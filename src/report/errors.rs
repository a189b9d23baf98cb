//! Poses whose errors nobody knows.

use crate::identify::{ErrorSummary, Errors};

/// For each arm by name the poses that have no equilibrium with it, so that no mean over their errors exists; `None` where
/// all errors are known.
pub(super) fn unpredicted(arms: &[(&str, &Errors)]) -> Option<String> {
    let mut parts = Vec::new();
    for (arm, errors) in arms {
        for (poses, of) in [("held-out", &errors.held_out), ("identification", &errors.identification)] {
            if of.unpredicted > 0 {
                parts.push(format!("{} with {arm}", counted(of, poses)));
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
pub(super) fn counted(of: &ErrorSummary, poses: &str) -> String {
    let have = if of.unpredicted == 1 { "has" } else { "have" };
    format!("{} of {} {poses} poses {have} no equilibrium", of.unpredicted, of.n)
}
