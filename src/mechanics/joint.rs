//! Joint with the link before it.

use nalgebra::Vector3;

use super::compensator::Compensator;
use super::imperfection::Nonlinear;
use super::link::{Beam, PointMass, point_masses};
use super::motion::{MOTION_LEN, MOTION_STARTS};
use crate::problem::{self, JointKind};
use crate::scalar::Scalar;
use crate::spatial::Frame;

/// Angle with its sine and cosine, computed once per arm rather than once per pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Angle<S> {
    /// Size of the angle \[rad\].
    pub value: S,
    /// Sine and cosine of the angle.
    pub sin_cos: (S, S),
}

impl<S: Scalar> Angle<S> {
    /// Creates an angle from radians.
    pub fn new(value: S) -> Self {
        Self { value, sin_cos: value.sin_cos() }
    }
}

impl Angle<f64> {
    fn lift<S: Scalar>(&self) -> Angle<S> {
        Angle {
            value: S::from(self.value),
            sin_cos: (S::from(self.sin_cos.0), S::from(self.sin_cos.1)),
        }
    }
}

/// Transform of six numbers: Txyz Rz(yaw) Ry(pitch) Rx(roll), as in URDF.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement<S> {
    /// Position of the origin \[m\].
    pub xyz: Vector3<S>,
    /// Angles roll, pitch and yaw.
    pub rpy: [Angle<S>; 3],
}

impl Placement<f64> {
    fn nominal(placement: &problem::Placement) -> Self {
        let [roll, pitch, yaw] = placement.rpy.into();
        Self { xyz: placement.xyz, rpy: [roll, pitch, yaw].map(Angle::new) }
    }

    fn lift<S: Scalar>(&self) -> Placement<S> {
        Placement { xyz: self.xyz.map(S::from), rpy: self.rpy.each_ref().map(Angle::lift) }
    }
}

impl<S: Scalar> Placement<S> {
    fn advance(&self, frame: &mut Frame<S>) {
        let [roll, pitch, yaw] = &self.rpy;
        frame.translate(&self.xyz);
        frame.rotate_z(yaw.sin_cos);
        frame.rotate_y(pitch.sin_cos);
        frame.rotate_x(roll.sin_cos);
    }
}

/// Joint with the link before it: `T_i` = Rx(α) Tx(a) Rz(θ+q) Tz(d) Ry(β)  [Chen2021, eq. 1],
/// behind the placement if there is one.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint<S> {
    /// Motion by the command q: rotation, translation or none.
    pub kind: JointKind,
    /// Constant transform between the parent's frame and the joint; `None` if there is none.
    pub placement: Option<Placement<S>>,
    /// Twist angle α of the link.
    pub alpha: Angle<S>,
    /// Length a of the link \[m\].
    pub a: S,
    /// Offset θ of the joint angle \[rad\].
    pub theta: S,
    /// Offset d along the joint axis \[m\].
    pub d: S,
    /// Rotation angle β about y behind the joint.
    pub beta: Angle<S>,
    /// Torsional flexibility 1/k about `z_i` [rad/(N·m)]; rigid if `None`.
    pub flexibility: Option<S>,
    /// Rotation about `z_i` that is not proportional to the moment.
    pub nonlinear: Option<Nonlinear<S>>,
    /// Flexibility about x and y before the joint's rotation [rad/(N·m)].
    pub lateral: Option<[S; 2]>,
    /// Bending flexibility 1/EI of the slide, a cantilever of length d + q [1/(N·m²)]; rigid if
    /// `None`.
    pub slide: Option<S>,
    /// Spring that takes up part of the moment about `z_i`.
    pub compensator: Option<Compensator<S>>,
    /// Small motion before the joint turns, and behind it: translation \[m\] and rotation vector
    /// \[rad\] each; `None` if the arm has no such parameter.
    pub motion: Option<Box<[S; 2 * MOTION_LEN]>>,
    /// Elastic link along the length a; rigid and without mass if `None`.
    pub beam: Option<Beam<S>>,
    /// Point masses that move with frame i, behind the joint.
    pub bodies: Vec<PointMass>,
    /// Relative error of these masses; `None` if the arm has no such parameter.
    pub body_error: Option<S>,
}

/// Angle and offset of a joint in a pose: its constants θ and d with the command q added to one of
/// them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinates<S> {
    /// Sine and cosine of the angle: θ + q for a revolute joint, θ for a prismatic one.
    pub angle: (S, S),
    /// Displacement along the axis: d + q for a prismatic joint, d for a revolute one \[m\].
    pub offset: S,
}

impl Joint<f64> {
    pub(super) fn nominal(joint: &problem::Joint) -> Self {
        Self {
            kind: joint.kind,
            placement: joint.placement.as_ref().map(Placement::nominal),
            alpha: Angle::new(joint.alpha),
            a: joint.a,
            theta: joint.theta,
            d: joint.d,
            beta: Angle::new(joint.beta),
            flexibility: joint.stiffness.map(f64::recip),
            nonlinear: None,
            lateral: None,
            slide: None,
            compensator: None,
            motion: None,
            beam: joint.beam.as_ref().map(Beam::nominal),
            bodies: point_masses(&joint.bodies),
            body_error: None,
        }
    }

    /// Converts the joint to another scalar type, with constant parameters.
    pub fn lift<S: Scalar>(&self) -> Joint<S> {
        Joint {
            kind: self.kind,
            placement: self.placement.as_ref().map(Placement::lift),
            alpha: self.alpha.lift(),
            a: S::from(self.a),
            theta: S::from(self.theta),
            d: S::from(self.d),
            beta: self.beta.lift(),
            flexibility: self.flexibility.map(S::from),
            nonlinear: self.nonlinear.as_ref().map(Nonlinear::lift),
            lateral: self.lateral.map(|lateral| lateral.map(S::from)),
            slide: self.slide.map(S::from),
            compensator: self.compensator.as_ref().map(Compensator::lift),
            motion: self.motion.as_ref().map(|motion| Box::new(motion.map(S::from))),
            beam: self.beam.as_ref().map(Beam::lift),
            bodies: self.bodies.clone(),
            body_error: self.body_error.map(S::from),
        }
    }
}

impl<S: Scalar> Joint<S> {
    /// Returns the true masses \[kg\] of the bodies, with their positions.
    pub(crate) fn masses(&self) -> impl Iterator<Item = (S, &Vector3<f64>)> {
        let factor = self.body_error.map(|error| error + 1.0);
        self.bodies.iter().map(move |body| {
            (factor.map_or_else(|| S::from(body.mass), |factor| factor * body.mass), &body.at)
        })
    }

    /// Returns true if the joint rotates about its axis under load.
    pub(super) fn has_twist(&self) -> bool {
        self.flexibility.is_some() || self.nonlinear.is_some()
    }

    /// Returns the rotation about the axis under a moment [N·m] about it \[rad\]. `approach` is the
    /// direction of approach (±1) if it is recorded.
    pub(super) fn twist(&self, moment: S, approach: Option<f64>) -> S {
        let linear =
            self.flexibility.map_or_else(|| S::from(0.0), |flexibility| flexibility * moment);
        let takes_up_play = approach.is_none() && self.kind != JointKind::Prismatic;
        self.nonlinear
            .as_ref()
            .map_or(linear, |nonlinear| linear + nonlinear.twist(moment, takes_up_play))
    }

    /// Returns the offset of the joint's coordinate by play \[rad\] or \[m\]; `None` without play
    /// or without a recorded direction of approach.
    pub(super) fn play_offset(&self, approach: Option<f64>) -> Option<S> {
        self.nonlinear
            .as_ref()
            .zip(approach)
            .map(|(nonlinear, approach)| nonlinear.play * (0.5 * approach))
    }

    /// Returns the coordinates at the command `q`, with `play_offset` added to q and `twist`
    /// \[rad\] to the angle.
    pub(super) fn coordinates_with(
        &self,
        q: f64,
        play_offset: Option<S>,
        twist: Option<S>,
    ) -> Coordinates<S> {
        let (mut angle, mut offset) = self.theta_and_d(q);
        match (play_offset, self.kind) {
            (Some(play_offset), JointKind::Prismatic) => offset += play_offset,
            (Some(play_offset), _) => angle += play_offset,
            (None, _) => {}
        }
        if let Some(twist) = twist {
            angle += twist;
        }
        Coordinates { angle: angle.sin_cos(), offset }
    }

    /// Returns the coordinates at the command `q`, without deflection and play.
    #[inline]
    pub fn coordinates(&self, q: f64) -> Coordinates<S> {
        let (angle, offset) = self.theta_and_d(q);
        Coordinates { angle: angle.sin_cos(), offset }
    }

    /// Returns (θ, d) with q added to θ of a revolute joint or d of a prismatic joint.
    #[inline]
    fn theta_and_d(&self, q: f64) -> (S, S) {
        match self.kind {
            JointKind::Revolute => (self.theta + q, self.d),
            JointKind::Prismatic => (self.theta, self.d + q),
            JointKind::Fixed => (self.theta, self.d),
        }
    }

    /// Moves `frame` to the start of the link: through the placement, if there is one, and Rx(α).
    pub(super) fn advance_to_link(&self, frame: &mut Frame<S>) {
        if let Some(placement) = &self.placement {
            placement.advance(frame);
        }
        frame.rotate_x(self.alpha.sin_cos);
    }

    /// Moves `frame` to the axis of the joint, undeflected: the placement and Rx(α) Tx(a).
    pub(super) fn advance_to_axis(&self, frame: &mut Frame<S>) {
        self.advance_to_link(frame);
        frame.translate_x(self.a);
    }

    /// Moves `frame` through `T_i` at q = 0, without Ry(β).
    pub(crate) fn advance_to_zero(&self, frame: &mut Frame<S>) {
        self.advance_to_axis(frame);
        frame.rotate_z(self.theta.sin_cos());
        frame.translate_z(self.d);
    }

    /// Moves `frame` through the whole undeflected `T_i`, with the small motions of a pose.
    pub(super) fn advance(
        &self,
        frame: &mut Frame<S>,
        q: f64,
        motion: Option<&[f64; 2 * MOTION_LEN]>,
    ) {
        self.advance_to_axis(frame);
        self.displace(frame, motion, MOTION_STARTS[0]);
        let Coordinates { angle, offset } = self.coordinates(q);
        frame.rotate_z(angle);
        frame.translate_z(offset);
        frame.rotate_y(self.beta.sin_cos);
        self.displace(frame, motion, MOTION_STARTS[1]);
    }

    /// Moves a frame by the small motion whose six numbers start at `first`: the sum of the arm's
    /// constants and the numbers of the pose.
    pub(super) fn displace(
        &self,
        frame: &mut Frame<S>,
        of_pose: Option<&[f64; 2 * MOTION_LEN]>,
        first: usize,
    ) {
        if self.motion.is_none() && of_pose.is_none() {
            return;
        }
        let number = |axis: usize| {
            let k = first + axis;
            let constant = self.motion.as_ref().map_or_else(|| S::from(0.0), |motion| motion[k]);
            constant + of_pose.map_or(0.0, |motion| motion[k])
        };
        frame.translate(&Vector3::from_fn(|axis, _| number(axis)));
        frame.rotate(&Vector3::from_fn(|axis, _| number(3 + axis)));
    }
}
