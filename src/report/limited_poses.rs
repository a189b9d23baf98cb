//! Sentence about chosen poses with a joint at its limit.

use super::document::code;
use crate::measurement::Measurements;
use crate::problem::Problem;

/// States how many poses command a joint to its limit, where controllers may refuse them; `None` if
/// no pose does. `command` names the command that is to be repeated with other limits.
pub(super) fn at_limits(problem: &Problem, poses: &Measurements, command: &str) -> Option<String> {
    let is_at_limit = |pose: &usize| {
        let joints = poses.configuration(*pose).iter().zip(&problem.joints);
        joints.into_iter().any(|(q, joint)| {
            let (low, high) = joint.limits;
            low < high && (*q <= low || *q >= high)
        })
    };
    let count = (0..poses.len()).filter(is_at_limit).count();
    let have = if count == 1 { "has" } else { "have" };
    (count > 0).then(|| {
        format!(
            "{count} of the poses {have} a joint at its limit. If the controller refuses such commands, declare limits with a margin ({}, \
             {}) and {command} again.",
            code("min_deg"),
            code("max_deg")
        )
    })
}
