//! `twist-bending`: a torsional moment bends a beam, and bending moments twist it, by one
//! flexibility in each plane.

use super::coverage::NO_LOADS;
use super::family::{Candidate, Family, Term, USUAL};
use super::place::{carrier, links};
use crate::model::parameter::{BeamField, ParameterSite};
use crate::problem::{Beam, Effect};

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "twist-bending",
    terms: |effect, problem| {
        let Effect::TwistBending { link } = effect else { return Vec::new() };
        let Some(joint) = carrier(problem, link) else { return Vec::new() };
        let Some(beam) = &problem.joints[joint].beam else { return Vec::new() };
        let term = |name, field, ei| {
            Term::constant(name, ParameterSite::Beam { joint, field }, largest(beam, ei))
        };
        vec![
            term("about_y", BeamField::CouplingY, beam.ei_y),
            term("about_z", BeamField::CouplingZ, beam.ei_z),
        ]
    },
    candidates: |problem, data| {
        let effect = |link| Effect::TwistBending { link };
        links(problem)
            .map(|link| Candidate::needing(effect(link), data.weighs(), NO_LOADS))
            .collect()
    },
    describe: |effect| match effect {
        Effect::TwistBending { link } => {
            format!("link {link} twists as it bends, and bends as it twists")
        }
        _ => String::new(),
    },
    ..USUAL
};

/// The largest coupling with which no load gains energy, 1/√(EI GJ) [1/(N·m²)].
///
/// Where one of them is declared rigid it counts as the other; where both are, the prior is that of
/// `link-bending`.
fn largest(beam: &Beam, ei: Option<f64>) -> f64 {
    match (ei, beam.gj) {
        (Some(ei), Some(gj)) => (ei * gj).sqrt().recip(),
        (Some(known), None) | (None, Some(known)) => known.recip(),
        (None, None) => 1e-2,
    }
}
