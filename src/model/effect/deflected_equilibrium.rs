//! `deflected-equilibrium`: λ from 0, loads on the rigid arm, to 1, loads on the bent arm.

use super::coverage::NO_LOADS;
use super::family::{Candidate, Family, Term, USUAL};
use crate::model::parameter::{ArmField, ParameterSite};
use crate::problem::{Effect, Equilibrium};

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "deflected-equilibrium",
    terms: |effect, _| match effect {
        Effect::DeflectedEquilibrium => {
            vec![
                Term::constant("lambda", ParameterSite::Arm(ArmField::Mixing), 1.0)
                    .never_negative(),
            ]
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let first_order = problem.statics.equilibrium == Equilibrium::Undeflected;
        let effect = Effect::DeflectedEquilibrium;
        first_order
            .then(|| Candidate::needing(effect, data.weighs(), NO_LOADS))
            .into_iter()
            .collect()
    },
    describe: |effect| match effect {
        Effect::DeflectedEquilibrium => "the loads act on the bent arm".to_owned(),
        _ => String::new(),
    },
    ..USUAL
};
