//! `gear-ratio`: the transmission ratio is off, Δθ = ε θ with θ = q as commanded.

use super::coverage::STANDS_STILL;
use super::family::{Candidate, Family, Term, USUAL};
use super::place::commanded;
use crate::model::parameter::{ParameterSite, Regressor};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "gear-ratio",
    terms: |effect, problem| match effect {
        Effect::GearRatio { joint } => {
            vec![Term::driven(
                "error",
                ParameterSite::coordinate(problem, *joint),
                Regressor::command(problem, *joint),
                0.01,
            )]
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let candidate = |joint| {
            Candidate::needing(Effect::GearRatio { joint }, data.moves(joint - 1), STANDS_STILL)
        };
        commanded(problem).map(candidate).collect()
    },
    describe: |effect| match effect {
        Effect::GearRatio { joint } => format!("transmission ratio of joint {joint} is off"),
        _ => String::new(),
    },
    function_of: |effect| match effect {
        Effect::GearRatio { joint } => Some((*joint, *joint)),
        _ => None,
    },
    ..USUAL
};
