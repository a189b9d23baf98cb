//! `backlash`: play, Δθ = (b/2)·approach; without directions of approach the moment M_z decides.

use super::conditions::NO_LOADS;
use super::place::commanded;
use super::{Candidate, Family, Term};
use crate::parameter::{JointField, Slot};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "backlash",
    terms: |effect, _| match effect {
        Effect::Backlash { joint } => {
            let slot = Slot::Joint { joint: joint - 1, field: JointField::Play };
            vec![Term::constant("width", slot, 0.01)]
        }
        _ => Vec::new(),
    },
    candidates: |problem, conditions| {
        let candidate = |joint: usize| {
            let effect = Effect::Backlash { joint };
            if conditions.approach {
                let both = conditions.both_sides.get(joint - 1).copied().unwrap_or(false);
                Candidate::needing(effect, both, "the joint was not approached from both sides")
            } else {
                Candidate::needing(effect, conditions.weighs(), NO_LOADS)
            }
        };
        commanded(problem).map(candidate).collect()
    },
    describe: |effect| match effect {
        Effect::Backlash { joint } => format!("play in joint {joint}"),
        _ => String::new(),
    },
};
