//! `joint-compliance`: a joint declared rigid turns by Δθ = c M_z.

use super::coverage::NO_LOADS;
use super::family::{Candidate, Family, Term, USUAL};
use crate::model::parameter::{JointField, ParameterSite};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "joint-compliance",
    terms: |effect, _| match effect {
        Effect::JointCompliance { joint } => {
            let site = ParameterSite::Joint { joint: joint - 1, field: JointField::Compliance };
            vec![Term::constant("compliance", site, 1e-3).never_negative()]
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let rigid =
            problem.joints.iter().enumerate().filter(|(_, joint)| joint.stiffness.is_none());
        let effect = |(index, _)| Effect::JointCompliance { joint: index + 1 };
        rigid.map(|joint| Candidate::needing(effect(joint), data.weighs(), NO_LOADS)).collect()
    },
    describe: |effect| match effect {
        Effect::JointCompliance { joint } => format!("joint {joint} gives way about its axis"),
        _ => String::new(),
    },
    ..USUAL
};
