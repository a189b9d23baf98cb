//! `joint-coupling`: one joint moves another, Δθ_joint = k q_from.

use super::coverage::STANDS_STILL;
use super::family::{Candidate, Family, Term, USUAL};
use super::place::commanded;
use crate::model::parameter::{ParameterSite, Regressor};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "joint-coupling",
    terms: |effect, problem| match effect {
        Effect::JointCoupling { joint, from } => {
            vec![Term::driven(
                "factor",
                ParameterSite::coordinate(problem, *joint),
                Regressor::command(problem, *from),
                0.01,
            )]
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let pairs =
            commanded(problem).flat_map(|joint| commanded(problem).map(move |from| (joint, from)));
        pairs
            .filter(|(joint, from)| joint != from)
            .map(|(joint, from)| {
                Candidate::needing(
                    Effect::JointCoupling { joint, from },
                    data.moves(from - 1),
                    STANDS_STILL,
                )
            })
            .collect()
    },
    describe: |effect| match effect {
        Effect::JointCoupling { joint, from } => format!("joint {from} moves joint {joint} along"),
        _ => String::new(),
    },
    function_of: |effect| match effect {
        Effect::JointCoupling { joint, from } => Some((*joint, *from)),
        _ => None,
    },
    ..USUAL
};
