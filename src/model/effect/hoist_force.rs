//! `hoist-force`: the rope pulls with F (1 + k).

use super::family::{Candidate, Family, Term, USUAL};
use super::place::is_hoisted;
use crate::model::parameter::{ArmField, ParameterSite};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "hoist-force",
    terms: |effect, _| match effect {
        Effect::HoistForce => {
            vec![Term::constant("error", ParameterSite::Arm(ArmField::HoistForce), 0.3)]
        }
        _ => Vec::new(),
    },
    candidates: |problem, _| {
        is_hoisted(problem).then(|| Candidate::of(Effect::HoistForce)).into_iter().collect()
    },
    describe: |effect| match effect {
        Effect::HoistForce => "the hoist pulls with another force".to_owned(),
        _ => String::new(),
    },
    ..USUAL
};
