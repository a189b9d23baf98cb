//! Moments of the loads about the axes of the joints, which formulas of laws may contain.

use super::arm::Arm;
use super::forward::DeflectionMode;
use super::workspace::{Event, Workspace};
use crate::problem::PoseView;
use crate::scalar::Scalar;

/// Largest rounding of a moment, relative to the sum of the moments of all loads about the base.
const MAX_MOMENT_ROUNDING: f64 = 1e-12;

/// Moments of an arm's loads about its joint axes, with every part undeflected.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisMoments<S> {
    arm: Arm<S>,
}

impl AxisMoments<f64> {
    /// Returns the moments in another scalar type, with `seed` added to the coordinate of the joint
    /// with index `joint`.
    pub fn seeded<S: Scalar>(&self, joint: usize, seed: S) -> AxisMoments<S> {
        let mut arm: Arm<S> = self.arm.lift();
        if let Some(joint) = arm.joints.get_mut(joint) {
            match joint.kind {
                crate::problem::JointKind::Prismatic => joint.d += seed,
                _ => joint.theta += seed,
            }
        }
        AxisMoments { arm }
    }
}

impl<S: Scalar> AxisMoments<S> {
    /// Creates the moments of an arm's loads: masses, payload and hoists. Deflections and gravity
    /// compensators are left out.
    pub fn new(mut arm: Arm<S>) -> Self {
        (arm.mounting, arm.mixing) = (None, None);
        for joint in &mut arm.joints {
            // With a flexibility of 0 the joint stays rigid, but the pass sums the moment about its
            // axis.
            joint.flexibility = Some(S::from(0.0));
            (joint.nonlinear, joint.lateral, joint.slide) = (None, None, None);
            joint.compensator = None;
        }
        Self { arm }
    }

    /// Returns the moment of everything beyond each joint about its axis [N·m], shape = (joints).
    pub fn at(&self, setup: &PoseView) -> Vec<S> {
        let arm = &self.arm;
        let mut ws = Workspace::default();
        arm.gather_forces(setup, &[], &mut ws);
        arm.walk(setup, DeflectionMode::Rigid, arm.last(), &mut ws);
        ws.sum_moments();
        // A moment within rounding errors is set to zero, because its sign is meaningless.
        let term = |event: &Event<S>| match event {
            Event::Load { at, force } => at.map(|x| x.re()).norm() * force.map(|x| x.re()).norm(),
            _ => 0.0,
        };
        let least = MAX_MOMENT_ROUNDING * ws.events.iter().map(term).sum::<f64>();
        // The coordinates of the hooks of ropes that may lean come before all moments.
        let mut next = 2 * ws.hooks.len();
        // Three moments for each element of a beam come before that of its joint.
        let moment = |joint: &super::Joint<S>| {
            let of_beam = if joint.beam.is_some() { 3 * arm.beam_elements } else { 0 };
            next += of_beam + 1;
            let moment = ws.next_moments.get(next - 1).copied();
            let moment = moment.unwrap_or_else(|| S::from(0.0));
            if moment.re().abs() > least { moment } else { moment - moment.re() }
        };
        arm.joints.iter().map(moment).collect()
    }
}
