//! `gravity-direction`: gravity is turned by (r_x, r_y, 0).

use super::coverage::NO_LOADS;
use super::family::{Candidate, Family, Term, USUAL};
use crate::model::parameter::{ArmField, ParameterSite};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "gravity-direction",
    terms: |effect, _| match effect {
        Effect::GravityDirection => vec![
            Term::constant("about_x", ParameterSite::Arm(ArmField::GravityX), 0.1),
            Term::constant("about_y", ParameterSite::Arm(ArmField::GravityY), 0.1),
        ],
        _ => Vec::new(),
    },
    candidates: |_, data| {
        vec![Candidate::needing(Effect::GravityDirection, data.weighs(), NO_LOADS)]
    },
    describe: |effect| match effect {
        Effect::GravityDirection => "the base does not stand level".to_owned(),
        _ => String::new(),
    },
    ..USUAL
};
