//! Search loop: evaluates the evidence about a fit and fits the effects of its most probable set,
//! until the fit contains exactly these effects. Refines their searched arguments on all rows.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::DMatrix;

use super::gears::{ScaleBy, estimated_prior};
use super::state::SearchState;
use crate::fit::IdentifyError;
use crate::problem::Effect;
use crate::select::data::Data;
use crate::select::evidence::{Evidence, Hypothesis, HypothesisSet, evaluate, ln_posterior};
use crate::select::fitted::Fitted;
use crate::select::harmonic_prior::is_periodic_of_many_orders;
use crate::select::neighbourhood::{Linearised, Score};
use crate::select::settings::{LN_ODDS_OF_ANOTHER_ARGUMENT, MAX_RIVALS, MAX_SHIFT_TIMES};

/// End of a search: its final fit, and the evidence about it.
pub(super) type Searched = (Fitted, Option<Evidence>);

/// Runs the search from the fit of the declared problem.
///
/// Returns the final, converged fit and the evidence about it. The evidence is `None` if the
/// residual is not finite, or if the fit changed after the evidence was evaluated. With periodic
/// errors of many orders, evidence is evaluated under the common prior that has the largest
/// evidence. The final fit then has the common prior that predicts best.
///
/// # Errors
/// Returns an error if a fit fails or the search was stopped.
pub(super) fn search(state: &mut SearchState, first: Fitted) -> Result<Searched, IdentifyError> {
    let (fitted, evidence) = settled_set(state, first)?;
    if state.added(&fitted).iter().any(is_periodic_of_many_orders) {
        let used = with_estimated_prior(state, &fitted, ScaleBy::LeftOutRanges)?;
        return Ok((used.converge(state.data, state.options)?, evidence));
    }
    let settled = fitted.clone().converge(state.data, state.options)?;
    let evidence = evidence.filter(|_| !settled.differs_from(&fitted, state.data));
    Ok((settled, evidence))
}

/// Alternates between evaluating evidence and fitting the effects of the most probable set, until
/// both agree or the rounds are used up. Returns the last fit and the evidence about it.
fn settled_set(state: &mut SearchState, first: Fitted) -> Result<Searched, IdentifyError> {
    let rules = state.data.rules;
    let mut fitted = first;
    // This evidence compared each set at a fit of that set and selected the set of the present
    // fit.
    let mut leading: Option<Evidence> = None;
    // The common prior was estimated from the coefficients of these periodic errors with many
    // orders.
    let mut estimated_from: Vec<Effect> = Vec::new();
    let mut is_polished = false;
    while state.rounds.len() < rules.max_rounds {
        state.report_progress(0, 0);
        let Some(evidence) = state.evaluate(&fitted)? else { return Ok((fitted, None)) };
        let Some(best) = evidence.certain_set(rules.inclusion_threshold) else {
            return Ok((fitted, Some(evidence)));
        };
        let reconsidered = state.reconsidered(&fitted);
        // Polished arguments are kept: they explain all rows, while the evidence uses only some
        // rows.
        let stays = has_same_effects(best, &reconsidered, Effect::eq)
            || is_polished && has_same_effects(best, &reconsidered, Effect::is_but_for_search);
        if !stays {
            state.report_progress(1, 1);
            let effects = state.effects_of(&fitted, (&evidence, best));
            let next = state.fit(&fitted, &effects)?;
            if state.register_new(&next) {
                (leading, is_polished) = (None, false);
                state.record(&next);
                fitted = next;
                let gears: Vec<Effect> =
                    state.added(&fitted).into_iter().filter(is_periodic_of_many_orders).collect();
                if gears != estimated_from {
                    estimated_from = gears;
                    fitted = with_estimated_prior(state, &fitted, ScaleBy::Evidence)?;
                }
                continue;
            }
            // The evidence prefers a set that was fitted before, and then was less probable than
            // the present one.
            if let Some(leading) = leading {
                return Ok((fitted, Some(leading)));
            }
        }
        let (evidence, better) = fit_rivals(state, &fitted, evidence)?;
        if let Some(better) = better.filter(|better| state.register_new(better)) {
            (leading, is_polished) = (Some(evidence), false);
            state.record(&better);
            fitted = better;
            continue;
        }
        let next = if is_polished { None } else { polished(state, &fitted)? };
        let Some(better) = next.filter(|better| state.register_new(better)) else {
            return Ok((fitted, Some(evidence)));
        };
        (leading, is_polished) = (None, true);
        state.record(&better);
        fitted = better;
    }
    let evidence = state.evaluate(&fitted)?;
    Ok((fitted, evidence))
}

/// Repeats the fit with the common prior of the harmonics estimated from its coefficients.
fn with_estimated_prior(
    state: &mut SearchState,
    fitted: &Fitted,
    criterion: ScaleBy,
) -> Result<Fitted, IdentifyError> {
    let Some(prior) = state.prior.take() else { return Ok(fitted.clone()) };
    state.prior = Some(estimated_prior(fitted, state.data, (prior, criterion)));
    let next = state.fit(fitted, &state.added(fitted))?;
    state.record(&next);
    Ok(next)
}

/// Returns true if the effects of a set are the `added` ones, compared by `is_same`, and the set
/// contains no periodic error with many orders that is to be added.
fn has_same_effects(
    set: &HypothesisSet,
    added: &[Effect],
    is_same: impl Fn(&Effect, &Effect) -> bool,
) -> bool {
    let mut unmatched = set.effects();
    let mut is_matched = |part: Effect| {
        let place = unmatched.iter().position(|effect| is_same(effect, &part));
        place.map(|place| unmatched.remove(place)).is_some()
    };
    set.gears().is_empty()
        && added.iter().flat_map(Effect::parts).all(&mut is_matched)
        && unmatched.is_empty()
}

/// Fits the rival sets of the evidence. Returns the evidence with the odds of each rival computed
/// at its fit, and the best of these fits if it is more probable than `fitted`.
fn fit_rivals(
    state: &SearchState,
    fitted: &Fitted,
    evidence: Evidence,
) -> Result<(Evidence, Option<Fitted>), IdentifyError> {
    let (data, rules) = (state.data, state.data.rules);
    let reconsidered = state.reconsidered(fitted);
    let accepted = evidence.certain_set(rules.inclusion_threshold).filter(|best| {
        !best.hypotheses.is_empty() && has_same_effects(best, &reconsidered, Effect::eq)
    });
    let Some(best) = accepted.cloned() else { return Ok((evidence, None)) };
    let ln_posterior_of = |fitted: &Fitted, functions: &[(Hypothesis, usize)], sigma: f64| {
        unless_stopped(data, || {
            ln_posterior(fitted, data, (&state.reconsidered(fitted), &evidence), (functions, sigma))
        })
    };
    let functions = best.without_law();
    let mut rivals = evidence.rival_sets(&best, MAX_RIVALS);
    rivals.truncate(state.affordable_fits(fitted.unknowns.len()) - 1);
    let mut tried: Vec<(HypothesisSet, f64, Fitted)> = Vec::new();
    // The map holds ln posterior of the present set for each set of outliers.
    let mut ln_posterior_by_outliers: BTreeMap<BTreeSet<usize>, Option<f64>> = BTreeMap::new();
    let count = rivals.len();
    for (k, rival) in rivals.into_iter().enumerate() {
        state.report_progress(k + 1, count);
        let kept = state.added(fitted).into_iter().filter(|effect| !reconsidered.contains(effect));
        let effects: Vec<Effect> = kept.chain(rival.effects()).collect();
        let next = state.fit(fitted, &effects)?;
        // Both sets are compared on the same rows.
        let aside: BTreeSet<usize> =
            fitted.set_aside.iter().chain(&next.set_aside).copied().collect();
        let of = |fit: &Fitted, functions: &[(Hypothesis, usize)]| {
            let fit = fit.with_outliers(aside.iter().copied().collect());
            ln_posterior_of(&fit, functions, fitted.sigma)
        };
        let here = match ln_posterior_by_outliers.get(&aside) {
            Some(ln_posterior) => *ln_posterior,
            None => of(fitted, &functions)?,
        };
        if let Some((here, there)) = here.zip(of(&next, &rival.without_law())?) {
            tried.push((rival, there - here, next));
        }
        ln_posterior_by_outliers.insert(aside, here);
    }
    tried.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut ln_odds_of: Vec<(HypothesisSet, f64)> = Vec::new();
    let mut better: Option<Fitted> = None;
    for (rival, ln_odds, next) in tried {
        // A function without a law is linear only about the fit for which it was built. A law that
        // replaces it must therefore also be confirmed by the evidence about the fit with the
        // law.
        let functions_left = rival.without_law().len();
        let is_best = ln_odds > 0.0 && better.is_none();
        if is_best
            && functions_left < functions.len()
            && !is_confirmed(state, &next, functions_left)?
        {
            continue;
        }
        ln_odds_of.push((rival, ln_odds));
        if is_best {
            better = Some(next);
        }
    }
    Ok((evidence.corrected(&best, &ln_odds_of), better))
}

/// Returns true if the set that the evidence about a fit accepts has the effects of the fit and at
/// most `functions` functions without a law.
fn is_confirmed(
    state: &SearchState,
    fitted: &Fitted,
    functions: usize,
) -> Result<bool, IdentifyError> {
    let reconsidered = state.reconsidered(fitted);
    let evidence = unless_stopped(state.data, || evaluate(fitted, state.data, &reconsidered))?;
    let threshold = state.data.rules.inclusion_threshold;
    let best = evidence.as_ref().and_then(|evidence| evidence.certain_set(threshold));
    Ok(best.is_some_and(|best| {
        has_same_effects(best, &reconsidered, Effect::eq) && best.without_law().len() <= functions
    }))
}

/// Returns the result of `evaluate`, or an error if the search was stopped in the meantime.
pub(super) fn unless_stopped<T>(
    data: &Data,
    evaluate: impl FnOnce() -> T,
) -> Result<T, IdentifyError> {
    let value = evaluate();
    if data.stop.is_requested() { Err(IdentifyError::interrupted()) } else { Ok(value) }
}

/// Maximum number of moves of one argument to the best of its neighbouring values.
const MAX_POLISHING_PASSES: usize = 8;
/// Factors by which a time constant, distance or order is multiplied for its trial values.
const TRIAL_FACTORS: [f64; 10] = [0.8, 0.86, 0.91, 0.95, 0.98, 1.02, 1.05, 1.1, 1.16, 1.25];

/// Returns the fit with refined arguments. Each searched argument is replaced by the value that
/// explains all identification rows best in the linear neighbourhood, if its odds over the present
/// value exceed [`LN_ODDS_OF_ANOTHER_ARGUMENT`]. Returns `None` if no argument changes, or if the
/// evidence already used all rows and times.
///
/// # Errors
/// Returns an error if the fit fails or the search was stopped.
fn polished(state: &SearchState, fitted: &Fitted) -> Result<Option<Fitted>, IdentifyError> {
    let data = state.data;
    // If the evidence used all rows and all times between poses, it has already tried these
    // arguments.
    let saw_all = data.rows().len() == data.evidence_rows().len();
    if saw_all && data.times_between_poses().len() <= MAX_SHIFT_TIMES {
        return Ok(None);
    }
    let added = state.added(fitted);
    let searched: Vec<Effect> =
        added.iter().filter(|effect| effect.is_searched()).cloned().collect();
    if searched.is_empty() {
        return Ok(None);
    }
    // An effect with another argument acts at the same sites.
    let linearised = fitted.linearised_at(data, data.rows(), &searched);
    let polished = |effect: &Effect| {
        let of_effect = || better_argument((fitted, &linearised), data, effect);
        let better = effect.is_searched().then(of_effect);
        better.flatten().unwrap_or_else(|| effect.clone())
    };
    let effects: Vec<Effect> = added.iter().map(polished).collect();
    if effects == added { Ok(None) } else { state.fit(fitted, &effects).map(Some) }
}

/// Returns the effect with the value of its argument that explains all rows best; `None` if that is
/// not clearly better than the present value. The argument moves to the best neighbouring value at
/// most [`MAX_POLISHING_PASSES`] times. `linearised` has the columns of the effect's sites at all
/// rows.
fn better_argument(
    (fitted, linearised): (&Fitted, &Linearised),
    data: &Data,
    effect: &Effect,
) -> Option<Effect> {
    let sums = fitted.neighbourhood_at_rows(data).sums();
    let variance = sums.squares / sums.freedom();
    let fit = fitted.neighbourhood_without(linearised, &fitted.unknowns_of(effect));
    let (mut best, mut gain_of_present) = ((f64::NEG_INFINITY, effect.clone()), f64::INFINITY);
    for _ in 0..MAX_POLISHING_PASSES {
        let tried: Vec<Effect> =
            [vec![best.1.clone()], neighbouring_arguments(data, &best.1)].concat();
        let columns: Vec<DMatrix<f64>> =
            tried.iter().map(|effect| linearised.columns(effect)).collect();
        let gain = |score: &Score| fit.sums().gain(score).map_or(0.0, |gain| gain.squares);
        let gains: Vec<f64> =
            fit.scores(&columns).iter().map(|score| 0.5 * gain(score) / variance).collect();
        if best.0 == f64::NEG_INFINITY {
            (best.0, gain_of_present) = (gains[0], gains[0]);
        }
        let next = gains.into_iter().zip(tried).max_by(|a, b| a.0.total_cmp(&b.0))?;
        if next.0 <= best.0 {
            break;
        }
        best = next;
    }
    (best.0 > gain_of_present + LN_ODDS_OF_ANOTHER_ARGUMENT).then_some(best.1)
}

/// Returns the effect with neighbouring values of its argument. Times move to times between poses,
/// up to the next listed times; others are multiplied by [`TRIAL_FACTORS`].
fn neighbouring_arguments(data: &Data, effect: &Effect) -> Vec<Effect> {
    let time = match effect {
        Effect::StationShift { at_time } | Effect::StationMove { at_time } => *at_time,
        _ => {
            return TRIAL_FACTORS
                .iter()
                .filter_map(|factor| effect.with_scaled_argument(*factor))
                .collect();
        }
    };
    let times = data.times_between_poses();
    // The evidence uses every n-th row, and the list of times contains every m-th time.
    let thinned = data.rows().len().div_ceil(data.evidence_rows().len().max(1));
    let reach = 2 * thinned.max(times.len().div_ceil(MAX_SHIFT_TIMES));
    let index = times.partition_point(|other| *other < time);
    let near = times[index.saturating_sub(reach)..times.len().min(index + reach)].iter();
    let at = |&at_time: &f64| match effect {
        Effect::StationMove { .. } => Effect::StationMove { at_time },
        _ => Effect::StationShift { at_time },
    };
    near.map(at).filter(|other| other != effect).collect()
}
