//! Search for times at which the instrument may have moved and rotated. It is made if probable sets
//! contain a hypothesis that depends on time.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::candidate::{Candidate, HYPOTHESES_PER_PROJECTION};
use super::hypotheses::Hypotheses;
use super::products::Products;
use super::search::{Weighted, reduced_by};
use super::waves::is_free;
use crate::problem::Effect;
use crate::residual_tests::Covariate;
use crate::select::fitted::Fitted;
use crate::select::settings::{MAX_REVISED_SETS, MIN_REVISED_PROBABILITY};

/// Returns the station moves that best replace the time-dependent members of probable sets: for
/// each set, in place of one of these members, or of all together.
pub(super) fn promising(
    hypotheses: &Hypotheses,
    weighted: &[Weighted],
    (products, times): (&Products, &[f64]),
    (fitted, left_out): (&Fitted, &[usize]),
) -> Vec<Candidate> {
    let of = |at_time: f64| Effect::StationMove { at_time };
    let is_known = |effect: &Effect| {
        hypotheses.all.iter().any(|candidate| candidate.hypothesis.effect() == Some(effect))
    };
    let new: Vec<Effect> =
        times.iter().map(|&time| of(time)).filter(|effect| !is_known(effect)).collect();
    if !new.first().is_some_and(|effect| is_free(effect, &fitted.problem)) {
        return Vec::new();
    }
    let follows_time = |member: &usize| {
        let on = &hypotheses.all[*member].hypothesis.depends_on;
        on.iter().any(|covariate| matches!(covariate, Covariate::Time | Covariate::Row))
    };
    let mut rests: BTreeSet<Vec<usize>> = BTreeSet::new();
    for set in weighted.iter().filter(|set| set.probability > MIN_REVISED_PROBABILITY) {
        let gone: Vec<usize> = set.members.iter().copied().filter(follows_time).collect();
        for gone in
            gone.iter().map(std::slice::from_ref).chain((gone.len() > 1).then_some(gone.as_slice()))
        {
            let mut remaining: Vec<usize> =
                set.members.iter().copied().filter(|member| !gone.contains(member)).collect();
            remaining.sort_unstable();
            if rests.len() < MAX_REVISED_SETS {
                rests.insert(remaining);
            }
        }
    }
    let reduced_problems: Vec<_> =
        rests.iter().filter_map(|rest| reduced_by(rest, products)).collect();
    if reduced_problems.is_empty() {
        return Vec::new();
    }
    let odds_of = |effects: &[Effect]| -> Vec<(Candidate, Vec<f64>)> {
        if products.target.stop.is_requested() {
            return Vec::new();
        }
        let entered = |effect: &Effect| {
            hypotheses.entered(effect, hypotheses.linearised.columns(effect), &fitted.problem)
        };
        let some: Vec<Candidate> = effects.iter().filter_map(entered).collect();
        let blocks = Candidate::blocks(
            &some.iter().collect::<Vec<_>>(),
            (fitted, &products.target.fit),
            left_out,
        );
        let odds: Vec<Vec<f64>> =
            reduced_problems.iter().map(|left| left.odds_of(&blocks)).collect();
        some.into_iter()
            .enumerate()
            .map(|(k, candidate)| (candidate, odds.iter().map(|of| of[k]).collect()))
            .collect()
    };
    let all: Vec<(Candidate, Vec<f64>)> =
        new.par_chunks(HYPOTHESES_PER_PROJECTION).flat_map_iter(odds_of).collect();
    let mut found: Vec<Candidate> = Vec::new();
    for k in 0..reduced_problems.len() {
        let best =
            all.iter().filter(|(_, odds)| odds[k] > 0.0).max_by(|a, b| a.1[k].total_cmp(&b.1[k]));
        if let Some((best, _)) = best
            && !found.iter().any(|known| known.hypothesis == best.hypothesis)
        {
            found.push(best.clone());
        }
    }
    found
}
