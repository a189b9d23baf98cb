//! `gear-ratio`: the transmission ratio is off, Δθ = ε θ with θ = q as commanded.

use super::coverage::STANDS_STILL;
use super::place::{command, commanded, coordinate};
use super::{Candidate, Family, Term};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "gear-ratio",
    terms: |effect, problem| match effect {
        Effect::GearRatio { joint } => {
            vec![Term::driven("error", coordinate(problem, *joint), command(problem, *joint), 0.01)]
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let candidate = |joint| Candidate::needing(Effect::GearRatio { joint }, data.moves(joint - 1), STANDS_STILL);
        commanded(problem).map(candidate).collect()
    },
    describe: |effect| match effect {
        Effect::GearRatio { joint } => format!("transmission ratio of joint {joint} is off"),
        _ => String::new(),
    },
};
