//! Arm: joints, and the quantities that act on the arm as a whole.

use nalgebra::Vector3;

use super::imperfection::HoistError;
use super::joint::Joint;
use crate::problem::{Equilibrium, PoseView, Problem, Tree};
use crate::scalar::Scalar;
use crate::spatial::Frame;

/// Arm, or several arms on one trunk, with parameters of the scalar type S. Predictions are in its
/// base frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm<S> {
    /// Gravity, arm base frame [m/s²].
    pub gravity: Vector3<S>,
    /// Configuration on which the loads act: rigid or deflected.
    pub equilibrium: Equilibrium,
    /// Number of closed-form elements per beam.
    pub beam_elements: usize,
    /// Joints from the base outwards, branch by branch.
    pub joints: Vec<Joint<S>>,
    /// Parent relations of the joints.
    pub tree: Tree,
    /// Index of the joint whose frame carries the payload; the last joint if `None`.
    pub payload_on: Option<usize>,
    /// Position of the payload in the frame that carries it \[m\].
    pub payload_at: Vector3<S>,
    /// Payload mass of poses that give none \[kg\].
    pub payload_mass: f64,
    /// Difference of the true payload mass from the declared one, in poses with a payload \[kg\].
    pub payload_error: S,
    /// Errors of the hoists' force and direction; `None` if they have none.
    pub rope: Option<HoistError<S>>,
    /// Flexibility of the base about its x and y axes [rad/(N·m)]; rigid if `None`.
    pub mounting: Option<[S; 2]>,
    /// Mixing factor λ from loads on the rigid arm (0) to loads on the deflected arm (1); used with
    /// undeflected statics only.
    pub mixing: Option<S>,
}

impl Arm<f64> {
    /// Creates the arm as the problem declares it.
    pub fn nominal(problem: &Problem) -> Self {
        Self {
            gravity: problem.gravity,
            equilibrium: problem.statics.equilibrium,
            beam_elements: problem.statics.beam_elements,
            joints: problem.joints.iter().map(Joint::nominal).collect(),
            tree: problem.tree(),
            payload_on: Some(problem.tool.joint).filter(|joint| joint + 1 < problem.joints.len()),
            payload_at: problem.tool.payload_at,
            payload_mass: problem.tool.payload_mass,
            payload_error: 0.0,
            rope: None,
            mounting: None,
            mixing: None,
        }
    }

    /// Converts the arm to another scalar type, with constant parameters.
    pub fn lift<S: Scalar>(&self) -> Arm<S> {
        Arm {
            gravity: self.gravity.map(S::from),
            equilibrium: self.equilibrium,
            beam_elements: self.beam_elements,
            joints: self.joints.iter().map(Joint::lift).collect(),
            tree: self.tree.clone(),
            payload_on: self.payload_on,
            payload_at: self.payload_at.map(S::from),
            payload_mass: self.payload_mass,
            payload_error: S::from(self.payload_error),
            rope: self.rope.as_ref().map(HoistError::lift),
            mounting: self.mounting.map(|mounting| mounting.map(S::from)),
            mixing: self.mixing.map(S::from),
        }
    }
}

impl<S: Scalar> Arm<S> {
    /// Returns true if a joint, a link or the base deflects.
    pub fn is_elastic(&self) -> bool {
        let gives = |joint: &Joint<S>| {
            joint.has_twist()
                || joint.lateral.is_some()
                || joint.slide.is_some()
                || joint.beam.is_some()
        };
        self.mounting.is_some() || self.joints.iter().any(gives)
    }

    /// Returns the index of the last joint.
    pub(crate) fn last(&self) -> usize {
        self.joints.len().saturating_sub(1)
    }

    /// Returns the frame of the joint `tip` of the undeflected arm, arm base frame.
    pub(crate) fn rigid_frame(&self, setup: &PoseView, tip: usize) -> Frame<S> {
        let mut frame = Frame::identity();
        for (index, (joint, &q)) in self.joints.iter().zip(setup.configuration).enumerate() {
            if self.tree.path_contains(index, tip) {
                joint.advance(&mut frame, q, setup.motion(index));
            }
        }
        frame
    }

    /// Returns for each joint of the undeflected arm its axis, as a point \[m\] and a direction,
    /// and the frame behind it, arm base frame.
    pub fn rigid_joints(&self, configuration: &[f64]) -> Vec<(Vector3<S>, Vector3<S>, Frame<S>)> {
        let mut frame = Frame::identity();
        let mut forks = vec![frame; self.tree.extra_branches_at_base()];
        let along = |(index, (joint, &q)): (usize, (&Joint<S>, &f64))| {
            if self.tree.begins_branch(index) {
                frame = forks.pop().unwrap_or(frame);
            }
            let mut root = frame;
            joint.advance_to_axis(&mut root);
            joint.advance(&mut frame, q, None);
            forks.extend((0..self.tree.extra_branches_on(index)).map(|_| frame));
            (root.origin, root.axes[2], frame)
        };
        self.joints.iter().zip(configuration).enumerate().map(along).collect()
    }

    /// Returns true if a payload hangs on the arm in a pose.
    pub(crate) fn carries_payload(&self, setup: &PoseView) -> bool {
        self.payload(setup).re() != 0.0
    }

    /// Returns the payload mass of a pose \[kg\].
    pub(super) fn payload(&self, setup: &PoseView) -> S {
        let declared = setup.payload.copied().unwrap_or(self.payload_mass);
        if declared > 0.0 { self.payload_error + declared } else { S::from(declared) }
    }
}
