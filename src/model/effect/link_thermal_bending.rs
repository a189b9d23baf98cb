//! `link-thermal-bending`: curvature (k_y, k_z)·(T − T₀) along a beam.

use super::coverage::without_temperature;
use super::family::{Candidate, Family, Term, USUAL};
use super::place::{carrier, links, warming};
use crate::model::parameter::{BeamField, ParameterSite};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "link-thermal-bending",
    terms: |effect, problem| match effect {
        Effect::LinkThermalBending { link } => {
            let slots = |joint| {
                [("about_y", BeamField::BowY), ("about_z", BeamField::BowZ)].map(|(name, field)| {
                    Term::driven(name, ParameterSite::Beam { joint, field }, warming(problem), 1e-3)
                })
            };
            carrier(problem, link).map_or_else(Vec::new, |joint| slots(joint).to_vec())
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let effect = |link| Effect::LinkThermalBending { link };
        links(problem)
            .map(|link| Candidate { effect: effect(link), untestable: data.no_temperature })
            .collect()
    },
    describe: |effect| match effect {
        Effect::LinkThermalBending { link } => format!("link {link} bows with temperature"),
        _ => String::new(),
    },
    missing_column: without_temperature,
    ..USUAL
};
