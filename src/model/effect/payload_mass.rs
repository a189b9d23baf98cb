//! `payload-mass`: the payload is heavier by m whenever one is carried.

use super::family::{Candidate, Family, Term, USUAL};
use crate::model::parameter::{ArmField, ParameterSite};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "payload-mass",
    terms: |effect, _| match effect {
        Effect::PayloadMass => {
            vec![Term::constant("mass", ParameterSite::Arm(ArmField::Payload), 2.0)]
        }
        _ => Vec::new(),
    },
    candidates: |_, data| {
        vec![Candidate::needing(
            Effect::PayloadMass,
            data.carries() && data.weighs(),
            "no payload is carried",
        )]
    },
    describe: |effect| match effect {
        Effect::PayloadMass => "payloads are heavier than declared".to_owned(),
        _ => String::new(),
    },
    ..USUAL
};
