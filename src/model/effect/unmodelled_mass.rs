//! `unmodelled-mass`: a mass m at s along a beam.

use super::coverage::NO_LOADS;
use super::family::{Candidate, Family, Term, USUAL};
use super::place::{carrier, links};
use crate::model::parameter::{BeamField, ParameterSite};
use crate::problem::Effect;

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "unmodelled-mass",
    terms: |effect, problem| match effect {
        Effect::UnmodelledMass { link } => {
            let site = |joint, field| ParameterSite::Beam { joint, field };
            let terms = |joint: usize| {
                let length = problem.joints[joint].a.abs();
                let at = Term::constant("at", site(joint, BeamField::AddedAt), length / 2.0);
                vec![
                    Term::constant("mass", site(joint, BeamField::AddedMass), 5.0).never_negative(),
                    Term { nominal: length / 2.0, ..at },
                ]
            };
            carrier(problem, link).map_or_else(Vec::new, terms)
        }
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let effect = |link| Effect::UnmodelledMass { link };
        links(problem)
            .map(|link| Candidate::needing(effect(link), data.weighs(), NO_LOADS))
            .collect()
    },
    describe: |effect| match effect {
        Effect::UnmodelledMass { link } => {
            format!("link {link} carries a mass that is not declared")
        }
        _ => String::new(),
    },
    ..USUAL
};
