//! `hoist-direction`: the rope leans, direction ∝ that declared + (t_x + k x, t_y + k y, 0) with
//! the hook at x, y.

use super::family::{Candidate, Family, Term, USUAL};
use super::place::is_hoisted;
use crate::model::parameter::{ArmField, ParameterSite};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "hoist-direction",
    terms: |effect, _| match effect {
        Effect::HoistDirection => vec![
            Term::constant("lean_x", ParameterSite::Arm(ArmField::HoistLeanX), 0.1),
            Term::constant("lean_y", ParameterSite::Arm(ArmField::HoistLeanY), 0.1),
            Term::constant("trolley", ParameterSite::Arm(ArmField::HoistTrolley), 0.1),
        ],
        _ => Vec::new(),
    },
    candidates: |problem, _| {
        is_hoisted(problem).then(|| Candidate::of(Effect::HoistDirection)).into_iter().collect()
    },
    describe: |effect| match effect {
        Effect::HoistDirection => "the rope of the hoist leans".to_owned(),
        _ => String::new(),
    },
    ..USUAL
};
