//! Links and the masses and ropes on them.

use nalgebra::Vector3;

use super::Flexibility;
use super::imperfection::{AddedMass, Strain};
use crate::problem;
use crate::scalar::Scalar;

/// A point mass on its carrier.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointMass {
    /// Mass \[kg\].
    pub mass: f64,
    /// Position in the carrier's frame \[m\].
    pub at: Vector3<f64>,
}

/// A suspension force on a beam.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hoist {
    /// Hook in the beam's frame \[m\].
    pub at: Vector3<f64>,
    /// Force where the pose gives none \[N\].
    pub force: f64,
    /// Unit direction, arm base frame.
    pub direction: Vector3<f64>,
}

/// An elastic link along a joint's a, clamped after Rx(α).
#[derive(Debug, Clone, PartialEq)]
pub struct Beam<S> {
    /// Own mass, spread evenly \[kg\].
    pub mass: f64,
    /// Flexibilities.
    pub flexibility: Flexibility<S>,
    /// Carried masses, beam frame.
    pub masses: Vec<PointMass>,
    /// Suspension.
    pub hoist: Option<Hoist>,
    /// Strain without load, beside that of each pose; `None`: it has none in any pose.
    pub strain: Option<Strain<S>>,
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

    /// The same link with its parameters as constants of another scalar.
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
