//! `slide-bending`: a prismatic joint's slide, a cantilever as long as the joint's d, of uniform
//! flexibility 1/EI.

use super::coverage::{NO_LOADS, STANDS_STILL};
use super::family::{Candidate, Family, Term, USUAL};
use super::place::{commanded, slides};
use crate::model::parameter::{JointField, ParameterSite};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "slide-bending",
    terms: |effect, _| match effect {
        Effect::SlideBending { joint } => {
            let site = ParameterSite::of_joint(*joint, JointField::SlideFlexibility);
            vec![Term::constant("flexibility", site, 1e-2).never_negative()]
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let of = |joint: usize| {
            let effect = Effect::SlideBending { joint };
            if data.moves(joint - 1) {
                Candidate::needing(effect, data.weighs(), NO_LOADS)
            } else {
                Candidate::needing(effect, false, STANDS_STILL)
            }
        };
        commanded(problem).filter(|&joint| slides(problem, joint)).map(of).collect()
    },
    describe: |effect| match effect {
        Effect::SlideBending { joint } => format!("the slide of joint {joint} bends"),
        _ => String::new(),
    },
    ..USUAL
};
