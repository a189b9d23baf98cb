//! Prior sizes of effect parameters on an arm.

use super::place::{MIN_MOMENT, greatest_moment};
use crate::laws::{Argument, Effect, Prior};
use crate::problem::{Body, Problem};

/// Prior size of the coupling of twist and bending for a beam declared rigid in both [1/(N·m²)].
const RIGID_COUPLING: f64 = 1e-2;

impl Effect {
    /// Returns the prior size (1 σ, SI) that `prior` gives on the arm of `problem`; `None` if the
    /// arm lacks the joint, beam or argument that the rule refers to.
    pub(super) fn size(&self, prior: Prior, problem: &Problem) -> Option<f64> {
        let moment = || Some(greatest_moment(problem, self.joint()?).max(MIN_MOMENT));
        let length = |key: &str| match self.argument(key) {
            Some(Argument::Point([x, y])) => Some(x.hypot(y)),
            _ => None,
        };
        Some(match prior {
            Prior::Size(size) => size,
            Prior::OfCubedMoment(angle) => angle / moment()?.powi(3),
            // The moment of a spring is l h times its rate, or h times its preload. l h is at most
            // |A| |B|, and h, the distance of the line of pull from the axis, at most the shorter
            // lever.
            Prior::SpringRate => moment()? / (length("anchor_m")? * length("lever_m")?),
            Prior::SpringPreload => moment()? / length("anchor_m")?.min(length("lever_m")?),
            Prior::TwistCoupling { about_z } => {
                let beam = problem.joints.get(self.beam(problem)?)?.beam.as_ref()?;
                // The size is 1/√(EI GJ). If one rigidity is not declared, the other one is used
                // for both.
                match (if about_z { beam.ei_z } else { beam.ei_y }, beam.gj) {
                    (Some(ei), Some(gj)) => (ei * gj).sqrt().recip(),
                    (Some(rigidity), None) | (None, Some(rigidity)) => rigidity.recip(),
                    (None, None) => RIGID_COUPLING,
                }
            }
            Prior::HalfLength => problem.joints.get(self.beam(problem)?)?.a.abs() / 2.0,
            Prior::BodyMass => Body::total_mass(&problem.joints.get(self.joint()? - 1)?.bodies),
        })
    }
}
