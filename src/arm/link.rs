//! What an arm is made of.

use nalgebra::Vector3;

use super::Flexibility;
use super::imperfection::{AddedMass, Nonlinear, Rope, Thermal};
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
    /// Change with temperature.
    pub thermal: Option<Thermal<S>>,
    /// A mass that nobody declared.
    pub added: Option<AddedMass<S>>,
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
    /// Turning about `z_i` that is not in proportion to the moment.
    pub nonlinear: Option<Nonlinear<S>>,
    /// Flexibility about x and y of the frame that has not yet turned [rad/(N·m)].
    pub lateral: Option<[S; 2]>,
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
    /// By how much a payload is heavier than declared, whenever one is carried [kg].
    pub payload_error: S,
    /// How ropes pull other than declared.
    pub rope: Option<Rope<S>>,
    /// Flexibility of the base about its x and y [rad/(N·m)].
    pub mounting: Option<[S; 2]>,
    /// λ from loads on the rigid arm (0) to loads on the bent arm (1), where the declared statics are undeflected.
    pub mixing: Option<S>,
    /// Temperature without thermal effects [°C].
    pub reference_temperature: f64,
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
    /// Temperature [°C], if it is known for this pose.
    pub temperature: Option<f64>,
    /// Time [s].
    pub time: f64,
    /// Time since the first measured pose [s].
    pub elapsed: f64,
    /// Direction from which each joint came, shape = (joints), −1, 0 or +1, if it is known.
    pub approach: Option<&'a [f64]>,
}

impl<'a> Setup<'a> {
    /// A configuration, shape = (joints) [rad] or [m], of which nothing else is known.
    pub fn of(configuration: &'a [f64]) -> Self {
        Self { configuration, payload: None, hoist: None, temperature: None, time: 0.0, elapsed: 0.0, approach: None }
    }
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
            payload_error: 0.0,
            rope: None,
            mounting: None,
            mixing: None,
            reference_temperature: problem.data.reference_temperature.unwrap_or(0.0),
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
            payload_error: S::from(self.payload_error),
            rope: self.rope.as_ref().map(Rope::lift),
            mounting: self.mounting.map(|mounting| mounting.map(S::from)),
            mixing: self.mixing.map(S::from),
            reference_temperature: self.reference_temperature,
        }
    }
}

impl<S: Scalar> Arm<S> {
    /// Whether any joint or link deflects.
    pub fn is_elastic(&self) -> bool {
        let gives = |joint: &Joint<S>| joint.turns() || joint.lateral.is_some() || joint.beam.is_some();
        self.mounting.is_some() || self.joints.iter().any(gives)
    }

    /// Degrees above the reference [K]; 0 where the temperature is not known.
    pub(super) fn warming(&self, setup: &Setup) -> f64 {
        setup.temperature.map_or(0.0, |temperature| temperature - self.reference_temperature)
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
    pub(super) fn payload(&self, setup: &Setup) -> S {
        let declared = setup.payload.unwrap_or(self.payload_mass);
        if declared > 0.0 { self.payload_error + declared } else { S::from(declared) }
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
            nonlinear: None,
            lateral: None,
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
                thermal: None,
                added: None,
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
            nonlinear: self.nonlinear.as_ref().map(Nonlinear::lift),
            lateral: self.lateral.map(|lateral| lateral.map(S::from)),
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
                thermal: beam.thermal.as_ref().map(Thermal::lift),
                added: beam.added.as_ref().map(AddedMass::lift),
            }),
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

    /// What play adds to the joint's coordinate when it came from a known direction [rad] or [m].
    pub(super) fn slip(&self, approach: Option<f64>) -> Option<S> {
        self.nonlinear.as_ref().zip(approach).map(|(nonlinear, approach)| nonlinear.play * (0.5 * approach))
    }

    /// Moves `frame` through the part of `T_i` after the link: Rz(θ + q + `twist`) Tz(d + q) Ry(β), `slip` added to q.
    pub(super) fn turn(&self, frame: &mut Frame<S>, q: f64, slip: Option<S>, twist: Option<S>) {
        let (mut angle, mut offset) = self.coordinates(q);
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

    /// The rigid `T_i` as one motion for each of α, a, θ, d, β.
    #[inline]
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
    #[inline]
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
        self.turn(frame, q, None, None);
    }
}
