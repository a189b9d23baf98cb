//! A joint with the link before it.

use nalgebra::Vector3;

use super::compensator::Compensator;
use super::imperfection::Nonlinear;
use super::link::{Beam, PointMass, point_masses};
use crate::problem::{self, JointKind};
use crate::scalar::Scalar;
use crate::spatial::Frame;

/// An angle with its sine and cosine, taken once per arm rather than once per pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Angle<S> {
    /// The angle \[rad\].
    pub value: S,
    /// (sin, cos).
    pub sin_cos: (S, S),
}

impl<S: Scalar> Angle<S> {
    /// From radians.
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

/// A transform of six numbers: Txyz Rz(yaw) Ry(pitch) Rx(roll), as URDF has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement<S> {
    /// Origin \[m\].
    pub xyz: Vector3<S>,
    /// Roll, pitch and yaw.
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

/// One joint with the link before it: `T_i` = Rx(α) Tx(a) Rz(θ+q) Tz(d) Ry(β)  [Chen2021, eq. 1],
/// behind the placement where there is one.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint<S> {
    /// What q does.
    pub kind: JointKind,
    /// A transform before all others.
    pub placement: Option<Placement<S>>,
    /// α.
    pub alpha: Angle<S>,
    /// a \[m\].
    pub a: S,
    /// θ \[rad\].
    pub theta: S,
    /// d \[m\].
    pub d: S,
    /// β.
    pub beta: Angle<S>,
    /// Torsional flexibility 1/k about `z_i` [rad/(N·m)]; `None`: rigid.
    pub flexibility: Option<S>,
    /// Turning about `z_i` that is not in proportion to the moment.
    pub nonlinear: Option<Nonlinear<S>>,
    /// Flexibility about x and y of the frame that has not yet turned [rad/(N·m)].
    pub lateral: Option<[S; 2]>,
    /// Flexibility 1/EI of the slide, a cantilever that is as long as the joint's own d + q
    /// [1/(N·m²)].
    pub slide: Option<S>,
    /// Spring that takes off part of the moment about `z_i`.
    pub compensator: Option<Compensator<S>>,
    /// Elastic link along a.
    pub beam: Option<Beam<S>>,
    /// Masses carried by frame i.
    pub bodies: Vec<PointMass>,
}

/// A joint in a pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinates<S> {
    /// (sin, cos) of θ + q.
    pub angle: (S, S),
    /// d + q \[m\].
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
            beam: joint.beam.as_ref().map(Beam::nominal),
            bodies: point_masses(&joint.bodies),
        }
    }

    /// The same joint with its parameters as constants of another scalar.
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
            beam: self.beam.as_ref().map(Beam::lift),
            bodies: self.bodies.clone(),
        }
    }
}

impl<S: Scalar> Joint<S> {
    /// Whether the joint gives way about its axis.
    pub(super) fn turns(&self) -> bool {
        self.flexibility.is_some() || self.nonlinear.is_some()
    }

    /// Angle about the axis under a moment [N·m] about it.
    pub(super) fn twist(&self, moment: S, approach: Option<f64>) -> S {
        let linear =
            self.flexibility.map_or_else(|| S::from(0.0), |flexibility| flexibility * moment);
        let takes_up_play = approach.is_none() && self.kind != JointKind::Prismatic;
        self.nonlinear
            .as_ref()
            .map_or(linear, |nonlinear| linear + nonlinear.twist(moment, takes_up_play))
    }

    /// What play adds to the joint's coordinate when it came from a known direction \[rad\] or
    /// \[m\].
    pub(super) fn slip(&self, approach: Option<f64>) -> Option<S> {
        self.nonlinear
            .as_ref()
            .zip(approach)
            .map(|(nonlinear, approach)| nonlinear.play * (0.5 * approach))
    }

    /// Where a configuration puts the joint, `slip` added to q and `twist` to the angle.
    pub(super) fn turned(&self, q: f64, slip: Option<S>, twist: Option<S>) -> Coordinates<S> {
        let (mut angle, mut offset) = self.moved(q);
        match (slip, self.kind) {
            (Some(slip), JointKind::Prismatic) => offset += slip,
            (Some(slip), _) => angle += slip,
            (None, _) => {}
        }
        if let Some(twist) = twist {
            angle += twist;
        }
        Coordinates { angle: angle.sin_cos(), offset }
    }

    /// Where a configuration puts the joint.
    #[inline]
    pub fn coordinates(&self, q: f64) -> Coordinates<S> {
        let (angle, offset) = self.moved(q);
        Coordinates { angle: angle.sin_cos(), offset }
    }

    /// θ and d of a configuration: q adds to one of them.
    #[inline]
    fn moved(&self, q: f64) -> (S, S) {
        match self.kind {
            JointKind::Revolute => (self.theta + q, self.d),
            JointKind::Prismatic => (self.theta, self.d + q),
            JointKind::Fixed => (self.theta, self.d),
        }
    }

    /// Moves `frame` to where the link begins: through the placement, if there is one, and Rx(α).
    pub(super) fn begin(&self, frame: &mut Frame<S>) {
        if let Some(placement) = &self.placement {
            placement.advance(frame);
        }
        frame.rotate_x(self.alpha.sin_cos);
    }

    /// Moves `frame` through the part of a rigid `T_i` before the joint turns: the placement and
    /// Rx(α) Tx(a).
    pub(super) fn root(&self, frame: &mut Frame<S>) {
        self.begin(frame);
        frame.translate_x(self.a);
    }

    /// Moves `frame` to the joint's axis at q = 0: through `T_i` but for Ry(β).
    pub(crate) fn walk_to_axis(&self, frame: &mut Frame<S>) {
        self.root(frame);
        frame.rotate_z(self.theta.sin_cos());
        frame.translate_z(self.d);
    }

    /// Moves `frame` through the whole rigid `T_i`.
    pub(super) fn advance(&self, frame: &mut Frame<S>, q: f64) {
        self.root(frame);
        let Coordinates { angle, offset } = self.coordinates(q);
        frame.rotate_z(angle);
        frame.translate_z(offset);
        frame.rotate_y(self.beta.sin_cos);
    }
}
