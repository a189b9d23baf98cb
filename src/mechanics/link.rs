//! Links, and the masses and ropes on them.

use nalgebra::Vector3;

use super::Flexibility;
use super::imperfection::{AddedMass, Strain};
use crate::problem;
use crate::scalar::Scalar;

/// Point mass that a link or a frame carries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointMass {
    /// Size of the mass \[kg\].
    pub mass: f64,
    /// Position in the frame that carries the mass \[m\].
    pub at: Vector3<f64>,
}

/// Suspension force on a beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hoist {
    /// Position of the hook in the beam's frame \[m\].
    pub at: Vector3<f64>,
    /// Suspension force in poses that give none \[N\].
    pub force: f64,
    /// Unit vector of the suspension force, arm base frame.
    pub direction: Vector3<f64>,
}

/// Elastic link along a joint's a, clamped after Rx(α).
#[derive(Debug, Clone, PartialEq)]
pub struct Beam<S> {
    /// Mass of the beam, spread evenly \[kg\].
    pub mass: f64,
    /// Axial, bending and torsional flexibilities.
    pub flexibility: Flexibility<S>,
    /// Point masses on the beam, beam frame.
    pub masses: Vec<PointMass>,
    /// Suspension force, if the beam has a hoist.
    pub hoist: Option<Hoist>,
    /// Strain without load, to which that of each pose adds; `None` if it has none in any pose.
    pub strain: Option<Strain<S>>,
    /// Undeclared mass on the beam.
    pub added: Option<AddedMass<S>>,
}

/// Converts declared bodies to point masses.
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
                coupling: None,
            },
            masses: point_masses(&beam.masses),
            hoist: beam.hoist.as_ref().map(|hoist| Hoist {
                at: hoist.at,
                force: hoist.force,
                direction: hoist.direction,
            }),
            strain: None,
            added: None,
        }
    }

    /// Converts the link to another scalar type, with constant parameters.
    pub(super) fn lift<S: Scalar>(&self) -> Beam<S> {
        Beam {
            mass: self.mass,
            flexibility: Flexibility {
                axial: S::from(self.flexibility.axial),
                about_y: S::from(self.flexibility.about_y),
                about_z: S::from(self.flexibility.about_z),
                twist: S::from(self.flexibility.twist),
                coupling: self.flexibility.coupling.map(|coupling| coupling.map(S::from)),
            },
            masses: self.masses.clone(),
            hoist: self.hoist,
            strain: self.strain.as_ref().map(Strain::lift),
            added: self.added.as_ref().map(AddedMass::lift),
        }
    }
}
