//! A joint with the link before it.

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

/// One joint with the link before it: `T_i` = Rx(α) Tx(a) Rz(θ+q) Tz(d) Ry(β)  [Chen2021, eq. 1].
#[derive(Debug, Clone, PartialEq)]
pub struct Joint<S> {
    /// What q does.
    pub kind: JointKind,
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
            alpha: Angle::new(joint.alpha),
            a: joint.a,
            theta: joint.theta,
            d: joint.d,
            beta: Angle::new(joint.beta),
            flexibility: joint.stiffness.map(f64::recip),
            nonlinear: None,
            lateral: None,
            beam: joint.beam.as_ref().map(Beam::nominal),
            bodies: point_masses(&joint.bodies),
        }
    }

    /// The same joint with its parameters as constants of another scalar.
    pub fn lift<S: Scalar>(&self) -> Joint<S> {
        let angle =
            |a: &Angle<f64>| Angle { value: S::from(a.value), sin_cos: (S::from(a.sin_cos.0), S::from(a.sin_cos.1)) };
        Joint {
            kind: self.kind,
            alpha: angle(&self.alpha),
            a: S::from(self.a),
            theta: S::from(self.theta),
            d: S::from(self.d),
            beta: angle(&self.beta),
            flexibility: self.flexibility.map(S::from),
            nonlinear: self.nonlinear.as_ref().map(Nonlinear::lift),
            lateral: self.lateral.map(|lateral| lateral.map(S::from)),
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
        let linear = self.flexibility.map_or_else(|| S::from(0.0), |flexibility| flexibility * moment);
        let takes_up_play = approach.is_none() && self.kind != JointKind::Prismatic;
        self.nonlinear.as_ref().map_or(linear, |nonlinear| linear + nonlinear.twist(moment, takes_up_play))
    }

    /// What play adds to the joint's coordinate when it came from a known direction \[rad\] or \[m\].
    pub(super) fn slip(&self, approach: Option<f64>) -> Option<S> {
        self.nonlinear.as_ref().zip(approach).map(|(nonlinear, approach)| nonlinear.play * (0.5 * approach))
    }

    /// Moves `frame` through the part of `T_i` after the link: Rz(θ + q + `twist`) Tz(d + q) Ry(β), `slip` added to q.
    pub(super) fn turn(&self, frame: &mut Frame<S>, q: f64, slip: Option<S>, twist: Option<S>) {
        let (mut angle, mut offset) = self.moved(q);
        match (slip, self.kind) {
            (Some(slip), JointKind::Prismatic) => offset += slip,
            (Some(slip), _) => angle += slip,
            (None, _) => {}
        }
        if let Some(twist) = twist {
            angle += twist;
        }
        frame.rotate_z(angle.sin_cos());
        frame.translate_z(offset);
        frame.rotate_y(self.beta.sin_cos);
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

    /// Moves `frame` through the part of a rigid `T_i` before the joint turns: Rx(α) Tx(a).
    pub(super) fn root(&self, frame: &mut Frame<S>) {
        frame.rotate_x(self.alpha.sin_cos);
        frame.translate_x(self.a);
    }

    /// Moves `frame` through the whole rigid `T_i`.
    pub(super) fn advance(&self, frame: &mut Frame<S>, q: f64) {
        self.root(frame);
        self.turn(frame, q, None, None);
    }
}
