//! `covariate`: what moves in proportion to a quantity of one's own, Δθ = k c; the base turns and
//! moves by (k c, d c).

use super::family::{Candidate, Family, Term, USUAL};
use super::place::commanded;
use crate::model::parameter::{ParameterSite, Regressor};
use crate::problem::{Effect, Mount, Problem};

/// The family.
pub(super) const FAMILY: Family = Family {
    name: "covariate",
    terms: |effect, problem| match effect {
        Effect::Covariate { joint, of } => terms(*joint, of, problem),
        _ => Vec::new(),
    },
    candidates: |problem, data| {
        let places = || commanded(problem).map(Mount::Joint).chain([Mount::Base]);
        let all = problem.data.covariates.iter().enumerate().flat_map(|(which, own)| {
            let varies = data.covariates.get(which).copied().unwrap_or(false);
            places().map(move |joint| {
                let effect = Effect::Covariate { joint, of: own.name.clone() };
                Candidate::needing(effect, varies, "the covariate does not change in these poses")
            })
        });
        all.collect()
    },
    describe: |effect| match effect {
        Effect::Covariate { joint: Mount::Joint(joint), of } => {
            format!("zero of joint {joint} moves with {of}")
        }
        Effect::Covariate { joint: Mount::Base, of } => format!("the base moves with {of}"),
        _ => String::new(),
    },
    missing_column: |_, _, columns| {
        (!columns.covariates).then_some("the columns of [data.covariates]")
    },
    ..USUAL
};

/// The unit of a covariate is its owner's: no size of its parameters is too great.
fn terms(place: Mount, of: &str, problem: &Problem) -> Vec<Term> {
    let Some(which) = problem.data.covariates.iter().position(|own| own.name == of) else {
        return Vec::new();
    };
    let term = |name, site| Term::driven(name, site, Regressor::Covariate(which), f64::INFINITY);
    match place {
        Mount::Joint(joint) => vec![term("rate", ParameterSite::coordinate(problem, joint))],
        Mount::Base => ["rx", "ry", "rz"]
            .into_iter()
            .enumerate()
            .map(|(axis, name)| term(name, ParameterSite::Turn { axis }))
            .chain(
                ["x", "y", "z"]
                    .into_iter()
                    .enumerate()
                    .map(|(axis, name)| term(name, ParameterSite::Shift { axis })),
            )
            .collect(),
    }
}
