//! What an arm is made of.

use nalgebra::Vector3;

use super::Flexibility;
use super::imperfection::{AddedMass, Rope, Thermal};
use super::joint::Joint;
use crate::problem::{self, Equilibrium, PoseView, Problem};
use crate::scalar::Scalar;
use crate::spatial::Frame;

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

/// Bodies fixed to a carrier.
pub(super) fn point_masses(bodies: &[problem::Body]) -> Vec<PointMass> {
    bodies.iter().map(|body| PointMass { mass: body.mass, at: body.position }).collect()
}

impl Beam<f64> {
    pub(super) fn nominal(beam: &problem::Beam) -> Self {
        let reciprocal = |rigidity: Option<f64>| rigidity.map_or(0.0, f64::recip);
        Self {
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
        }
    }

    /// The same link with its parameters as constants of another scalar.
    pub(super) fn lift<S: Scalar>(&self) -> Beam<S> {
        Beam {
            mass: self.mass,
            flexibility: Flexibility {
                axial: S::from(self.flexibility.axial),
                about_y: S::from(self.flexibility.about_y),
                about_z: S::from(self.flexibility.about_z),
                twist: S::from(self.flexibility.twist),
            },
            masses: self.masses.clone(),
            hoist: self.hoist,
            thermal: self.thermal.as_ref().map(Thermal::lift),
            added: self.added.as_ref().map(AddedMass::lift),
        }
    }
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
    pub(super) fn warming(&self, setup: &PoseView) -> f64 {
        setup.temperature.map_or(0.0, |temperature| temperature - self.reference_temperature)
    }

    /// The last frame of the arm that does not deflect, arm base frame.
    pub(super) fn rigid_frame(&self, setup: &PoseView) -> Frame<S> {
        let mut frame = Frame::identity();
        for (joint, &q) in self.joints.iter().zip(setup.configuration) {
            joint.advance(&mut frame, q);
        }
        frame
    }

    /// Payload of a pose [kg].
    pub(super) fn payload(&self, setup: &PoseView) -> S {
        let declared = setup.payload.unwrap_or(self.payload_mass);
        if declared > 0.0 { self.payload_error + declared } else { S::from(declared) }
    }
}
