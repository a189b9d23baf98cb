//! `link-thermal-expansion`: strain α (T − T₀) of a beam.

use super::coverage::without_temperature;
use super::family::{Candidate, Family, Term, USUAL};
use super::place::{carrier, links, warming};
use crate::model::parameter::{BeamField, ParameterSite};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "link-thermal-expansion",
    terms: |effect, problem| match effect {
        Effect::LinkThermalExpansion { link } => {
            let site = |joint| ParameterSite::Beam { joint, field: BeamField::Stretch };
            let term = |joint| Term::driven("strain", site(joint), warming(problem), 1e-3);
            carrier(problem, link).map(term).into_iter().collect()
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let effect = |link| Effect::LinkThermalExpansion { link };
        links(problem)
            .map(|link| Candidate { effect: effect(link), untestable: data.no_temperature })
            .collect()
    },
    describe: |effect| match effect {
        Effect::LinkThermalExpansion { link } => format!("link {link} grows with temperature"),
        _ => String::new(),
    },
    missing_column: without_temperature,
    ..USUAL
};
