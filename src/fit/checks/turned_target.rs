//! Shift of a target that the zero position of the joint that carries it would explain as well.

use nalgebra::Vector3;

use super::checked_fit::CheckedFit;
use super::row_steps::Step;
use crate::model::parameter::{Parameter, ParameterSite};
use crate::problem::JointKind;

/// Largest part of the shift of a target, along the axis of its joint or from it, at which the zero
/// position of that joint may have changed instead.
const MAX_PART_BESIDE_TURN: f64 = 0.1;

/// Returns the words for the zero position of the joint that carries a target, if its change acts
/// like the shift of the target; `None` if it does not.
pub(super) fn turn_of_target(
    fit: &CheckedFit,
    target: usize,
    (columns, step): (&[usize], &Step),
) -> Option<String> {
    let name = fit.fitting.placement.targets.get(target);
    let named = name.and_then(|name| fit.problem.targets.iter().find(|of| of.name == *name));
    let joint = named.map_or(fit.problem.tool.joint, |named| named.joint);
    let parameters: Vec<&Parameter> = fit.whole.parameters().collect();
    let x = fit.whole.unknowns_in(&fit.end.x);
    let (mut at, mut shift) = (Vector3::zeros(), Vector3::zeros());
    for (&column, change) in columns.iter().zip(step.change.iter()) {
        if let ParameterSite::Target { axis: axis @ 0..3, .. } = parameters[column].site {
            at[axis] = parameters[column].nominal + x[column];
            shift[axis] = *change;
        }
    }
    let has = |wanted: usize| {
        let axis = |&column: &usize| match parameters[column].site {
            ParameterSite::Target { axis, .. } => Some(axis),
            _ => None,
        };
        columns.iter().filter_map(axis).any(|axis| axis == wanted)
    };
    // A held coordinate is not in the change, and β tilts the axis in the frame.
    if !has(0) || !has(1) || fit.problem.joints.get(joint)?.beta != 0.0 {
        return None;
    }
    let radius = |at: &Vector3<f64>| at.xy().norm();
    let beside = (radius(&(at + shift)) - radius(&at)).hypot(shift.z);
    let turns = fit.problem.joints.get(joint)?.command_kind() == JointKind::Revolute;
    let angle = at.x * (at + shift).y - at.y * (at + shift).x;
    let angle = angle.atan2(at.xy().dot(&(at + shift).xy()));
    (turns && beside < MAX_PART_BESIDE_TURN * shift.norm()).then(|| {
        format!(
            " (or the zero position of joint {} is off by {:.3}°)",
            joint + 1,
            angle.to_degrees()
        )
    })
}
