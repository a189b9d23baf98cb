//! `joint-nonlinear-stiffness`: Δθ = c₃ M_z³ beyond the linear torsion.

use super::coverage::NO_LOADS;
use super::family::{Candidate, Family, Term, USUAL};
use super::place::{LEAST_MOMENT, greatest_moment};
use crate::model::parameter::{JointField, ParameterSite};
use crate::problem::Effect;

/// More than any joint turns under the greatest conceivable moment \[rad\].
const MOST: f64 = 0.1;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "joint-nonlinear-stiffness",
    terms: |effect, problem| match effect {
        Effect::JointNonlinearStiffness { joint } => {
            let site = ParameterSite::Joint { joint: joint - 1, field: JointField::Cubic };
            vec![Term::constant(
                "cubic",
                site,
                MOST / greatest_moment(problem, *joint).max(LEAST_MOMENT).powi(3),
            )]
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let effect = |joint| Effect::JointNonlinearStiffness { joint };
        let candidate = |joint| Candidate::needing(effect(joint), data.weighs(), NO_LOADS);
        (1..=problem.joints.len()).map(candidate).collect()
    },
    describe: |effect| match effect {
        Effect::JointNonlinearStiffness { joint } => {
            format!("stiffness of joint {joint} changes with its load")
        }
        _ => String::new(),
    },
    ..USUAL
};
