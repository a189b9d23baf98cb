//! `joint-nonlinear-stiffness`: Δθ = c₃ M_z³ beyond the linear torsion.

use super::conditions::NO_LOADS;
use super::{Candidate, Family, Term};
use crate::parameter::{JointField, Slot};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "joint-nonlinear-stiffness",
    terms: |effect, _| match effect {
        Effect::JointNonlinearStiffness { joint } => {
            let slot = Slot::Joint { joint: joint - 1, field: JointField::Cubic };
            vec![Term::constant("cubic", slot, 1e-6)]
        }
        _ => Vec::new(),
    },
    candidates: |problem, conditions| {
        let effect = |joint| Effect::JointNonlinearStiffness { joint };
        let candidate = |joint| Candidate::needing(effect(joint), conditions.weighs(), NO_LOADS);
        (1..=problem.joints.len()).map(candidate).collect()
    },
    describe: |effect| match effect {
        Effect::JointNonlinearStiffness { joint } => format!("stiffness of joint {joint} changes with its load"),
        _ => String::new(),
    },
};
