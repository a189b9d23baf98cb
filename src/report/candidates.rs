//! Words about the candidates from which poses are chosen, and about chosen poses.

use super::document::code;
use crate::measurement::Measurements;
use crate::problem::{JointKind, Problem};
use crate::quantity::format::counted;

/// Number of candidates below which a choice among drawn poses is called one of few.
const FEW_CANDIDATES: usize = 200;

/// Returns the number of `candidates`, with the number of poses `drawn` to find those that cameras
/// see, inside the workspace if it is limited.
pub(super) fn candidates_drawn(
    candidates: usize,
    drawn: Option<usize>,
    is_limited: bool,
) -> String {
    let counts = counted(candidates, "candidate");
    let inside = if is_limited { " and inside the workspace" } else { "" };
    match drawn {
        Some(drawn) => format!("{counts} in view{inside} among {drawn} drawn poses"),
        None => counts,
    }
}

/// States that cameras see a marker in few of the `drawn` poses, and what to do; `None` if there
/// are enough candidates, or if no poses were drawn for cameras. A workspace that is limited leaves
/// out poses, too.
pub(super) fn few_in_view(
    candidates: usize,
    drawn: Option<usize>,
    is_limited: bool,
) -> Option<String> {
    let inside = if is_limited { "lie in the workspace and " } else { "" };
    drawn.filter(|_| candidates < FEW_CANDIDATES).map(|drawn| {
        format!(
            "Only {candidates} of {drawn} drawn poses {inside}show the marker as the measured \
             views do, so that better poses may exist. Give {} a table of poses in which the \
             detector finds the marker, or {} a file with narrower ranges of the joints in {}.",
            code("--pool"),
            code("--truth"),
            code("[poses]")
        )
    })
}

/// States how many poses command a joint to its limit, where controllers may refuse them; `None` if
/// no pose does. `command` names the command that is to be repeated with other limits.
pub(super) fn at_limits(problem: &Problem, poses: &Measurements, command: &str) -> Option<String> {
    let are_at_limit = |pose: usize, slides: bool| {
        let joints = poses.configuration(pose).iter().zip(&problem.joints);
        joints.into_iter().any(|(q, joint)| {
            let (low, high) = joint.limits;
            (joint.command_kind() == JointKind::Prismatic) == slides
                && low < high
                && (*q <= low || *q >= high)
        })
    };
    let at_limits = |slides: bool| (0..poses.len()).filter(move |&pose| are_at_limit(pose, slides));
    let count = (0..poses.len())
        .filter(|&pose| are_at_limit(pose, false) || are_at_limit(pose, true))
        .count();
    let keys = [(false, "min_deg", "max_deg"), (true, "min_m", "max_m")];
    let keys = keys.into_iter().filter(|(slides, ..)| at_limits(*slides).next().is_some());
    let keys: Vec<String> =
        keys.map(|(_, low, high)| format!("{}, {}", code(low), code(high))).collect();
    let who = match count {
        1 => "1 of the poses has".to_owned(),
        _ if count == poses.len() => format!("All {count} poses have"),
        _ => format!("{count} of the poses have"),
    };
    (count > 0).then(|| {
        format!(
            "{who} a joint at its limit. If the controller refuses such commands, declare limits \
             with a margin ({}) and {command} again.",
            keys.join("; ")
        )
    })
}
