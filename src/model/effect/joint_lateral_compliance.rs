//! `joint-lateral-compliance`: bearings tilt by (c_x M_x, c_y M_y, 0) before the joint turns.

use super::coverage::NO_LOADS;
use super::family::{Candidate, Family, Term, USUAL};
use super::place::commanded;
use crate::model::parameter::{JointField, ParameterSite};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "joint-lateral-compliance",
    terms: |effect, _| match effect {
        Effect::JointLateralCompliance { joint } => {
            let site = |field| ParameterSite::Joint { joint: joint - 1, field };
            vec![
                Term::constant("about_x", site(JointField::LateralX), 1e-3).never_negative(),
                Term::constant("about_y", site(JointField::LateralY), 1e-3).never_negative(),
            ]
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let effect = |joint| Effect::JointLateralCompliance { joint };
        commanded(problem)
            .map(|joint| Candidate::needing(effect(joint), data.weighs(), NO_LOADS))
            .collect()
    },
    describe: |effect| match effect {
        Effect::JointLateralCompliance { joint } => format!("joint {joint} tilts across its axis"),
        _ => String::new(),
    },
    ..USUAL
};
