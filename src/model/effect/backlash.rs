//! `backlash`: play, Δθ = (b/2)·approach; without directions of approach the moment M_z decides.

use super::coverage::NO_LOADS;
use super::family::{Candidate, Family, Term, USUAL};
use super::place::{commanded, slides};
use crate::model::parameter::{JointField, ParameterSite};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "backlash",
    terms: |effect, problem| match effect {
        Effect::Backlash { joint } => {
            let slides = slides(problem, *joint);
            let field = if slides { JointField::SlidingPlay } else { JointField::Play };
            let site = ParameterSite::Joint { joint: joint - 1, field };
            vec![Term::constant("width", site, 0.01)]
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let candidate = |joint: usize| {
            let effect = Effect::Backlash { joint };
            if data.approach {
                let both = data.both_sides.get(joint - 1).copied().unwrap_or(false);
                Candidate::needing(effect, both, "the joint was not approached from both sides")
            } else if slides(problem, joint) {
                Candidate::needing(
                    effect,
                    false,
                    "no directions of approach, and moments move nothing along a slide",
                )
            } else {
                Candidate::needing(effect, data.weighs(), NO_LOADS)
            }
        };
        commanded(problem).map(candidate).collect()
    },
    describe: |effect| match effect {
        Effect::Backlash { joint } => format!("play in joint {joint}"),
        _ => String::new(),
    },
    missing_column: |effect, problem, columns| match effect {
        Effect::Backlash { joint } if slides(problem, *joint) && !columns.approach => {
            Some("columns approach1, …")
        }
        _ => None,
    },
    ..USUAL
};
