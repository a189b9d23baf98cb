//! Search for times at which the instrument may have moved and rotated. The search is made only if
//! probable sets contain a hypothesis that depends on time.

use std::collections::BTreeSet;

use super::candidate::{Candidate, HYPOTHESES_PER_PROJECTION};
use super::hypotheses::Hypotheses;
use super::products::Products;
use super::search::{EvaluatedSet, reduced_by};
use super::set::sorted;
use super::waves::is_free;
use crate::numeric::parallel;
use crate::problem::Effect;
use crate::residual_tests::Covariate;
use crate::select::fitted::Fitted;
use crate::select::settings::{MAX_REVISED_SETS, MIN_REVISED_PROBABILITY};

/// Returns the station moves that best replace the time-dependent members of probable sets: for
/// each set, in place of one of these members, or of all together.
pub(super) fn promising(
    hypotheses: &Hypotheses,
    evaluated_sets: &[EvaluatedSet],
    (products, times): (&Products, &[f64]),
    (fitted, left_out): (&Fitted, &[usize]),
) -> Vec<Candidate> {
    let of = |at_time: f64| Effect::StationMove { at_time };
    let is_listed = |effect: &Effect| {
        hypotheses.candidates.iter().any(|candidate| candidate.hypothesis.effect() == Some(effect))
    };
    let new: Vec<Effect> =
        times.iter().map(|&time| of(time)).filter(|effect| !is_listed(effect)).collect();
    if !new.first().is_some_and(|effect| is_free(effect, &fitted.problem)) {
        return Vec::new();
    }
    let follows_time = |member: &usize| {
        let on = &hypotheses.candidates[*member].hypothesis.depends_on;
        on.iter().any(|covariate| matches!(covariate, Covariate::Time | Covariate::Row))
    };
    let mut reduced_sets: BTreeSet<Vec<usize>> = BTreeSet::new();
    for set in evaluated_sets.iter().filter(|set| set.probability > MIN_REVISED_PROBABILITY) {
        let removed: Vec<usize> = set.members.iter().copied().filter(follows_time).collect();
        for removed in removed
            .iter()
            .map(std::slice::from_ref)
            .chain((removed.len() > 1).then_some(removed.as_slice()))
        {
            if reduced_sets.len() < MAX_REVISED_SETS {
                reduced_sets.insert(sorted(&set.without(|member| removed.contains(&member))));
            }
        }
    }
    let reduced_problems: Vec<_> =
        reduced_sets.iter().filter_map(|rest| reduced_by(rest, products)).collect();
    if reduced_problems.is_empty() {
        return Vec::new();
    }
    let ln_odds_of = |effects: &[Effect]| -> Vec<(Candidate, Vec<f64>)> {
        if products.residual_model.stop.is_requested() {
            return Vec::new();
        }
        let candidate_of_effect = |effect: &Effect| {
            hypotheses.candidate_of_effect(
                effect,
                hypotheses.linearised.columns(effect),
                &fitted.problem,
            )
        };
        let candidates: Vec<Candidate> = effects.iter().filter_map(candidate_of_effect).collect();
        let blocks =
            Candidate::blocks(&candidates, (fitted, &products.residual_model.fit), left_out);
        let odds: Vec<Vec<f64>> =
            reduced_problems.iter().map(|left| left.ln_odds_of(&blocks)).collect();
        candidates
            .into_iter()
            .enumerate()
            .map(|(k, candidate)| (candidate, odds.iter().map(|of| of[k]).collect()))
            .collect()
    };
    let moves_with_odds = parallel::map_chunks(&new, HYPOTHESES_PER_PROJECTION, ln_odds_of);
    let mut found: Vec<Candidate> = Vec::new();
    for k in 0..reduced_problems.len() {
        let best = moves_with_odds
            .iter()
            .filter(|(_, odds)| odds[k] > 0.0)
            .max_by(|a, b| a.1[k].total_cmp(&b.1[k]));
        if let Some((best, _)) = best
            && !found.iter().any(|other| other.hypothesis == best.hypothesis)
        {
            found.push(best.clone());
        }
    }
    found
}
