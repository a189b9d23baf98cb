//! `payload-backlash`: play that opens with the payload m, Δθ = (w m / 2)·approach.

use super::family::{Candidate, Family, Term, USUAL};
use super::place::commanded;
use crate::model::parameter::{ParameterSite, Regressor};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "payload-backlash",
    terms: |effect, problem| match effect {
        Effect::PayloadBacklash { joint } => {
            vec![Term::driven(
                "width",
                ParameterSite::coordinate(problem, *joint),
                Regressor::LoadedSide { joint: joint - 1, declared: problem.tool.payload_mass },
                0.01,
            )]
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let candidate = |joint: usize| {
            let effect = Effect::PayloadBacklash { joint };
            let both = data.both_sides.get(joint - 1).copied().unwrap_or(false);
            Candidate::needing(
                effect,
                both && data.changes_payload(),
                "no payload that changes, or no approach from both sides",
            )
        };
        commanded(problem).map(candidate).collect()
    },
    describe: |effect| match effect {
        Effect::PayloadBacklash { joint } => {
            format!("play in joint {joint} that opens with the payload")
        }
        _ => String::new(),
    },
    missing_column: |_, _, columns| (!columns.approach).then_some("columns approach1, …"),
    ..USUAL
};
