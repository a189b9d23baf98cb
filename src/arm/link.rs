//! What an arm is made of.

use nalgebra::Vector3;

use super::Flexibility;
use crate::problem::{self, Equilibrium, JointKind, Problem};
use crate::scalar::Scalar;
use crate::spatial::{Frame, Motion};

/// An angle with its sine and cosine, taken once per arm rather than once per pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Angle<S> {
    /// The angle [rad].
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

/// A point mass on its carrier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointMass {
    /// Mass [kg].
    pub mass: f64,
    /// Position in the carrier's frame [m].
    pub at: Vector3<f64>,
}

/// A suspension force on a beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hoist {
    /// Hook in the beam's frame [m].
    pub at: Vector3<f64>,
    /// Force where the pose gives none [N].
    pub force: f64,
    /// Unit direction, arm base frame.
    pub direction: Vector3<f64>,
}

/// An elastic link along a joint's a, clamped after Rx(α).
#[derive(Debug, Clone, PartialEq)]
pub struct Beam<S> {
    /// Own mass, spread evenly [kg].
    pub mass: f64,
    /// Flexibilities.
    pub flexibility: Flexibility<S>,
    /// Carried masses, beam frame.
    pub masses: Vec<PointMass>,
    /// Suspension.
    pub hoist: Option<Hoist>,
}

/// One joint with the link before it: `T_i` = Rx(α) Tx(a) Rz(θ+q) Tz(d) Ry(β)  [Chen2021, eq. 1].
#[derive(Debug, Clone, PartialEq)]
pub struct Joint<S> {
    /// What q does.
    pub kind: JointKind,
    /// α.
    pub alpha: Angle<S>,
    /// a [m].
    pub a: S,
    /// θ [rad].
    pub theta: S,
    /// d [m].
    pub d: S,
    /// β.
    pub beta: Angle<S>,
    /// Torsional flexibility 1/k about `z_i` [rad/(N·m)]; `None`: rigid.
    pub flexibility: Option<S>,
    /// Elastic link along a.
    pub beam: Option<Beam<S>>,
    /// Masses carried by frame i.
    pub bodies: Vec<PointMass>,
}

/// A serial arm with its parameters as scalars S; predicts in its own base frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Arm<S> {
    /// Gravity, arm base frame [m/s²].
    pub gravity: Vector3<S>,
    /// On which arm the loads act.
    pub equilibrium: Equilibrium,
    /// Closed-form elements per beam.
    pub beam_elements: usize,
    /// Joints from the base outwards.
    pub joints: Vec<Joint<S>>,
    /// Where a payload hangs, last frame [m].
    pub payload_at: Vector3<f64>,
    /// Payload where the pose gives none [kg].
    pub payload_mass: f64,
}

/// What the controller and the test bench set for one pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setup<'a> {
    /// Configuration q, shape = (joints) [rad] or [m]; fixed joints ignore theirs.
    pub configuration: &'a [f64],
    /// Payload [kg], if it is known for this pose.
    pub payload: Option<f64>,
    /// Hoist force [N], if it is known for this pose.
    pub hoist: Option<f64>,
}

impl Arm<f64> {
    /// The arm as the problem declares it.
    pub fn nominal(problem: &Problem) -> Self {
        Self {
            gravity: problem.gravity,
            equilibrium: problem.statics.equilibrium,
            beam_elements: problem.statics.beam_elements,
            joints: problem.joints.iter().map(Joint::nominal).collect(),
            payload_at: problem.tool.payload_at,
            payload_mass: problem.tool.payload_mass,
        }
    }

    /// The same arm with its parameters as constants of another scalar.
    pub fn lift<S: Scalar>(&self) -> Arm<S> {
        Arm {
            gravity: self.gravity.map(S::from),
            equilibrium: self.equilibrium,
            beam_elements: self.beam_elements,
            joints: self.joints.iter().map(Joint::lift).collect(),
            payload_at: self.payload_at,
            payload_mass: self.payload_mass,
        }
    }
}

impl<S: Scalar> Arm<S> {
    /// Whether any joint or link deflects.
    pub fn is_elastic(&self) -> bool {
        self.joints.iter().any(|joint| joint.flexibility.is_some() || joint.beam.is_some())
    }

    /// The last frame of the arm that does not deflect, arm base frame.
    pub(super) fn rigid_frame(&self, setup: &Setup) -> Frame<S> {
        let mut frame = Frame::identity();
        for (joint, &q) in self.joints.iter().zip(setup.configuration) {
            joint.advance(&mut frame, q);
        }
        frame
    }

    /// Payload of a pose [kg].
    pub(super) fn payload(&self, setup: &Setup) -> f64 {
        setup.payload.unwrap_or(self.payload_mass)
    }
}

impl Joint<f64> {
    fn nominal(joint: &problem::Joint) -> Self {
        let point_masses = |bodies: &[problem::Body]| {
            bodies.iter().map(|body| PointMass { mass: body.mass, at: body.position }).collect()
        };
        let reciprocal = |rigidity: Option<f64>| rigidity.map_or(0.0, f64::recip);
        Self {
            kind: joint.kind,
            alpha: Angle::new(joint.alpha),
            a: joint.a,
            theta: joint.theta,
            d: joint.d,
            beta: Angle::new(joint.beta),
            flexibility: joint.stiffness.map(f64::recip),
            beam: joint.beam.as_ref().map(|beam| Beam {
                mass: beam.mass,
                flexibility: Flexibility {
                    axial: reciprocal(beam.ea),
                    about_y: reciprocal(beam.ei_y),
                    about_z: reciprocal(beam.ei_z),
                    twist: reciprocal(beam.gj),
                },
                masses: point_masses(&beam.masses),
                hoist: beam.hoist.as_ref().map(|hoist| Hoist {
                    at: hoist.at,
                    force: hoist.force,
                    direction: hoist.direction,
                }),
            }),
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
            beam: self.beam.as_ref().map(|beam| Beam {
                mass: beam.mass,
                flexibility: Flexibility {
                    axial: S::from(beam.flexibility.axial),
                    about_y: S::from(beam.flexibility.about_y),
                    about_z: S::from(beam.flexibility.about_z),
                    twist: S::from(beam.flexibility.twist),
                },
                masses: beam.masses.clone(),
                hoist: beam.hoist,
            }),
            bodies: self.bodies.clone(),
        }
    }
}

impl<S: Scalar> Joint<S> {
    /// Moves `frame` through the part of `T_i` after the link: Rz(θ + q + `twist`) Tz(d + q) Ry(β).
    pub(super) fn turn(&self, frame: &mut Frame<S>, q: f64, twist: Option<S>) {
        let (mut angle, offset) = self.coordinates(q);
        if let Some(twist) = twist {
            angle += twist;
        }
        frame.rotate_z(angle.sin_cos());
        frame.translate_z(offset);
        frame.rotate_y(self.beta.sin_cos);
    }

    /// The rigid `T_i` as one motion for each of α, a, θ, d, β.
    pub fn motions(&self, q: f64) -> [Motion<S>; 5] {
        let (angle, offset) = self.coordinates(q);
        [
            Motion::RotateX(self.alpha.sin_cos),
            Motion::TranslateX(self.a),
            Motion::RotateZ(angle.sin_cos()),
            Motion::TranslateZ(offset),
            Motion::RotateY(self.beta.sin_cos),
        ]
    }

    /// θ and d of a configuration: q adds to one of them.
    fn coordinates(&self, q: f64) -> (S, S) {
        match self.kind {
            JointKind::Revolute => (self.theta + q, self.d),
            JointKind::Prismatic => (self.theta, self.d + q),
            JointKind::Fixed => (self.theta, self.d),
        }
    }

    /// Moves `frame` through the whole rigid `T_i`.
    fn advance(&self, frame: &mut Frame<S>, q: f64) {
        frame.rotate_x(self.alpha.sin_cos);
        frame.translate_x(self.a);
        self.turn(frame, q, None);
    }
}
