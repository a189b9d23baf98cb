//! `base-compliance`: the base turns by (C_x M_x, C_y M_y, 0) under the moments at the base.

use super::coverage::NO_LOADS;
use super::family::{Candidate, Family, Term, USUAL};
use crate::model::parameter::{ArmField, ParameterSite};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "base-compliance",
    terms: |effect, _| match effect {
        Effect::BaseCompliance => vec![
            Term::constant("about_x", ParameterSite::Arm(ArmField::MountingX), 1e-4)
                .never_negative(),
            Term::constant("about_y", ParameterSite::Arm(ArmField::MountingY), 1e-4)
                .never_negative(),
        ],
        _ => Vec::new(),
    },
    candidates: |_, data| vec![Candidate::needing(Effect::BaseCompliance, data.weighs(), NO_LOADS)],
    describe: |effect| match effect {
        Effect::BaseCompliance => "the base tilts under the load".to_owned(),
        _ => String::new(),
    },
    ..USUAL
};
