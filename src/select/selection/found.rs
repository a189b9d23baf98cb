//! Claims, tests and alternatives for each effect that the search added.

use std::collections::BTreeMap;

use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use super::misread_effect::misread_claims;
use super::state::{Round, SearchState};
use super::status::Status;
use crate::fit::{ErrorSummary, Estimate, FindingCode, Identification};
use crate::numeric::Interval;
use crate::problem::{Effect, PoseView};
use crate::residual_tests::Covariate;
use crate::select::candidates::Candidates;
use crate::select::data::Data;
use crate::select::evidence::{
    Claims, Evidence, Hypothesis, HypothesisSet, SubsetEvidence, subset_evidence,
};
use crate::select::fitted::Fitted;
use crate::select::harmonic_prior::is_periodic_of_many_orders;
use crate::select::left_out_gain::LeftOutGain;
use crate::select::neighbourhood::tries;
use crate::select::reference_check::{ReferenceCheck, reference_check};
use crate::select::separating_pose::random_poses;
use crate::select::separation::are_alike;
use crate::select::settings::{
    MAX_FITTED_ALTERNATIVES, MIN_ALTERNATIVE_ODDS, MIN_SHARE_OF_SUBSETS,
};

/// Smallest number of orders of one harmonic at which only the claim is made that some of the
/// orders act, not all.
const MIN_SEVERAL_ORDERS: usize = 3;

/// Effect that the loop added, with its status and tests.
#[derive(Debug, Clone)]
pub struct Found {
    /// Effect that was added to the model.
    pub effect: Effect,
    /// Status: the strongest claim about the effect that the data allow.
    pub status: Status,
    /// Status of the claim that the effect, or plainer causes that do the same, act. The effect is
    /// used by this status, because each of them would correct the same error.
    pub(super) status_of_any: Status,
    /// Claims with their probabilities; `None` if no evidence about the effect was evaluated, or no
    /// probable set contains it.
    pub claims: Option<Claims>,
    /// p-value of the F test of the fit against the fit without the effect, times the number of
    /// candidates tried.
    pub p_value: f64,
    /// Estimates of the effect's parameters, fitted together with all others.
    pub estimates: Vec<Estimate>,
    /// Effects that the data cannot distinguish from the found one, best first, each with the
    /// probability that it acts instead.
    pub alternatives: Vec<(Effect, f64)>,
    /// The most probable alternatives of a probable effect, each fitted in its place.
    #[doc(hidden)]
    pub compared: Vec<Compared>,
    /// Quantities of a law that the search composed, with their ranges over the identification
    /// poses (SI, temperatures in °C); empty for other effects. Beyond these ranges the law is not
    /// supported by data.
    pub ranges: Vec<(Covariate, (f64, f64))>,
    /// Fraction of random subsets of 80 % of the configurations in which the evidence finds the
    /// effect again; `None` if it was not evaluated on subsets.
    pub stability: Option<f64>,
    /// Check against data that were not fitted; `None` if no such data concern the effect, or if
    /// they do not decide.
    pub reference_check: Option<ReferenceCheck>,
    /// Held-out error after the first round that contains the effect and whose effects all remained
    /// until the end. If there is no such round, it is that of the final fit.
    pub held_out_after: ErrorSummary,
}

/// Returns every effect that a fit contains in addition to the declared ones, with its tests. If
/// the fit has cautions (`is_trusted` is false), no effect is more than probable. If the residual
/// of the fit is not noise (`is_structured`), or if few random subsets contain the effect, its
/// probabilities are limited to their means over the subsets. They are also limited to those of the
/// evidence `of_all_rows`, which includes rows that are outliers only of the fit with the effects.
///
/// `is_used` receives the best [`Found::status_of_any`] and returns true if the result is used; if
/// true for one status, it is true for every better one. Subsets only reduce the probabilities.
/// They are therefore not evaluated if the result on all rows is not used.
pub(super) fn found(
    state: &SearchState,
    fitted: &Fitted,
    (best, of_all_rows): (Option<(&Evidence, &HypothesisSet)>, Option<&Evidence>),
    (is_trusted, is_structured): (bool, bool),
    is_used: impl Fn(Option<Status>) -> bool,
) -> Vec<Found> {
    let (data, rules) = (state.data, state.data.rules);
    let added = state.added(fitted);
    let parts: Vec<Effect> = added.iter().flat_map(Effect::parts).collect();
    let reconsidered = state.reconsidered(fitted);
    let p_values = p_values(state, fitted, &added);
    let plainer = compare_with_plainer(state, fitted);
    let held_out_after = |effect: &Effect| {
        let stays = |other: &Effect| added.iter().any(|kept| kept.covers(other));
        let holds = |round: &&Round| round.effects.iter().any(|other| effect.covers(other));
        let round =
            state.rounds.iter().find(|round| holds(round) && round.effects.iter().all(stays));
        round.map_or(fitted.found.fitted.held_out, |round| round.held_out)
    };
    let found_effect = |(effect, p_value): (Effect, f64), subsets: &[SubsetEvidence]| {
        let alternatives = best.map_or_else(Vec::new, |(evidence, _)| {
            alternatives(evidence, &effect, &parts, MIN_ALTERNATIVE_ODDS)
        });
        let rivals = if let Effect::Law(law) = &effect { law.rivals() } else { &[] };
        let of_parts: Vec<&SubsetEvidence> =
            subsets.iter().filter(|subset| effect.covers(&subset.effect)).collect();
        let share = of_parts.iter().map(|subset| subset.share).reduce(f64::min);
        // If a searched argument was refined after the evidence was evaluated, the evidence is
        // about the earlier value.
        let claims = best.and_then(|(evidence, set)| {
            let is_alike = |other: &Effect| other.is_but_for_search(&effect);
            let alike = || set.effects().into_iter().find(is_alike);
            let claims = claims(evidence, &effect).or_else(|| claims(evidence, &alike()?))?;
            let is_steady =
                !is_structured && share.is_none_or(|share| share >= MIN_SHARE_OF_SUBSETS);
            let claims = if is_steady { claims } else { over_subsets(claims, &of_parts) };
            Some(match of_all_rows {
                Some(all) => {
                    let others =
                        self::claims(all, &effect).or_else(|| self::claims(all, &alike()?));
                    let others = others.map(|c| [c.place.1, c.depends_on.1, c.law.1]);
                    limited_to(claims, others.unwrap_or_default())
                }
                None => claims,
            })
        });
        let of_class = claims.as_ref().map_or(0.0, |claims| claims.law.1);
        let shares = rivals.iter().map(|(_, share)| share).sum::<f64>();
        let claims = claims.map(|mut claims| {
            claims.law.1 *= (1.0 - shares).max(0.0);
            claims
        });
        let rivals = rivals.iter().map(|(law, share)| (Effect::Law(law.clone()), of_class * share));
        let alternatives = with_rivals(alternatives, rivals);
        let check = reference_check(fitted, data, &effect);
        let verdict = check.as_ref().map(|check| check.verdict);
        let gear_probability = match &effect {
            Effect::JointHarmonic { joint, .. } if is_periodic_of_many_orders(&effect) => {
                state.gear_probability.get(joint).copied()
            }
            _ => None,
        };
        // An effect that was evaluated but belongs to no probable set has no claims.
        let is_evaluated = best.is_some() && reconsidered.iter().any(|other| effect.covers(other));
        let rival = plainer.iter().find(|plainer| plainer.effect == effect);
        let claims = claims.map(|mut claims| {
            if let Some(rival) = rival {
                let claimed = [&mut claims.place.1, &mut claims.depends_on.1, &mut claims.law.1];
                for probability in claimed {
                    *probability *= rival.share;
                }
            }
            claims
        });
        let is_probable =
            |rival: &&Plainer| 1.0 - rival.share >= MIN_ALTERNATIVE_ODDS * rival.share;
        let instead = rival.into_iter().filter(is_probable).flat_map(|rival| {
            // The causes act together; their probability is divided equally among them.
            let each = of_class * (1.0 - rival.share) / rival.instead.len() as f64;
            rival.instead.iter().map(move |cause| (cause.clone(), each))
        });
        let alternatives = with_rivals(alternatives, instead);
        let misread = state.misread.as_ref().filter(|misread| misread.effect == effect);
        let claims = match misread {
            Some(misread) => Some(misread_claims(misread, &fitted.problem)),
            None => claims.map(|claims| claims.with_neighbours(&fitted.problem)),
        };
        let law = claims.as_ref().map(|claims| claims.law.1).or(gear_probability);
        let law = law.or_else(|| is_evaluated.then_some(0.0));
        let status_at = |law: Option<f64>| {
            let status = Status::of(law, rules, (p_value, verdict));
            if is_trusted { status } else { status.max(Status::Probable) }
        };
        Found {
            stability: share,
            status: status_at(law),
            status_of_any: status_at(if rival.is_some() { Some(of_class) } else { law }),
            claims,
            p_value,
            estimates: fitted
                .parameters_of(&effect)
                .into_iter()
                .map(|k| fitted.found.estimates[k].clone())
                .collect(),
            held_out_after: held_out_after(&effect),
            ranges: if effect.is_composed() { ranges(fitted, data, &effect) } else { Vec::new() },
            alternatives,
            compared: Vec::new(),
            reference_check: check,
            effect,
        }
    };
    let all = |subsets: &[SubsetEvidence]| -> Vec<Found> {
        let tested = added.iter().cloned().zip(p_values.iter().copied());
        tested.map(|effect| found_effect(effect, subsets)).collect()
    };
    let on_all_rows = all(&[]);
    match best {
        Some(best) if is_used(on_all_rows.iter().map(|found| found.status_of_any).min()) => {
            let subsets = subset_evidence(fitted, data, best, &reconsidered);
            let mut effects = if subsets.is_empty() { on_all_rows } else { all(&subsets) };
            for found in effects.iter_mut().filter(|found| found.status == Status::Probable) {
                found.compared = compare_alternatives(state, fitted, found);
            }
            effects
        }
        _ => on_all_rows,
    }
}

/// Returns, for each effect of a fit, the p-value of the F test of the fit against the fit without
/// the effect, times the number of candidates tried. For a harmonic that is no periodic error with
/// many orders, it is the smallest p-value of its orders.
fn p_values(state: &SearchState, fitted: &Fitted, effects: &[Effect]) -> Vec<f64> {
    let fit = fitted.neighbourhood_at_rows(state.data);
    let tested: Vec<Vec<Effect>> =
        effects
            .iter()
            .map(|effect| {
                if is_periodic_of_many_orders(effect) {
                    vec![effect.clone()]
                } else {
                    effect.parts()
                }
            })
            .collect();
    let parts: Vec<Effect> = tested.iter().flatten().flat_map(Effect::parts).collect();
    let mut everything = Candidates::new(&fitted.problem, state.data).testable;
    let first = everything.len();
    everything.extend(parts.iter().cloned());
    let (all_tries, families) = tries(&everything, &fitted.problem);
    let mut tries_left = all_tries[first..].iter();
    let (squares, dof) = (fit.sums().squares, fit.sums().freedom());
    let p_value = |effect: &Effect| {
        let tries = tries_left.by_ref().take(effect.parts().len()).sum::<f64>() * families as f64;
        let k = fitted.parameters_of(effect).len();
        let lost = fit.loss_without(&fitted.unknowns_of(effect));
        let ratio = lost.map(|lost| lost / k as f64 / (squares / dof)).filter(|f| !f.is_nan());
        let chance = FisherSnedecor::new(k as f64, dof).ok().zip(ratio);
        let p = chance.map_or(1.0, |(chance, ratio)| chance.sf(ratio).max(f64::MIN_POSITIVE));
        (p * tries).min(1.0)
    };
    let by_part: Vec<f64> = tested.iter().flatten().map(p_value).collect();
    let mut by_part = by_part.into_iter();
    tested.iter().map(|parts| by_part.by_ref().take(parts.len()).fold(1.0, f64::min)).collect()
}

/// Returns the claims about an effect. For a harmonic of fewer than [`MIN_SEVERAL_ORDERS`] orders
/// they are those of the least probable order, for one of more orders those of the most probable
/// one. `None` if the evidence does not contain the effect.
fn claims(evidence: &Evidence, effect: &Effect) -> Option<Claims> {
    let parts = effect.parts();
    let claims =
        parts.iter().map(|part| evidence.claims_of(part)).collect::<Option<Vec<Claims>>>()?;
    let by_law = |a: &Claims, b: &Claims| a.law.1.total_cmp(&b.law.1);
    if parts.len() >= MIN_SEVERAL_ORDERS {
        claims.into_iter().max_by(by_law)
    } else {
        claims.into_iter().min_by(by_law)
    }
}

/// Returns the claims with each probability limited to its mean over random subsets of the
/// configurations. The means are those of the order that [`claims`] chooses.
///
/// If no set of hypotheses describes the data, the posterior overstates the probability of the best
/// one. Its mean over resampled data does not. [Huggins and Miller 2023]
fn over_subsets(claims: Claims, of_parts: &[&SubsetEvidence]) -> Claims {
    let by_law = |a: &&&SubsetEvidence, b: &&&SubsetEvidence| a.means[2].total_cmp(&b.means[2]);
    let part = if of_parts.len() >= MIN_SEVERAL_ORDERS {
        of_parts.iter().max_by(by_law)
    } else {
        of_parts.iter().min_by(by_law)
    };
    match part {
        Some(part) => limited_to(claims, part.means),
        None => claims,
    }
}

/// Returns the claims with each probability (of place, quantities and law) limited to the one in
/// `others`.
fn limited_to(mut claims: Claims, others: [f64; 3]) -> Claims {
    let limited = [&mut claims.place.1, &mut claims.depends_on.1, &mut claims.law.1];
    limited.into_iter().zip(others).for_each(|(p, other)| *p = p.min(other));
    claims
}

/// Returns the alternatives with `rivals` added, the most probable first. The probability of a
/// rival that is already an alternative is added to that of the alternative.
fn with_rivals(
    mut alternatives: Vec<(Effect, f64)>,
    rivals: impl Iterator<Item = (Effect, f64)>,
) -> Vec<(Effect, f64)> {
    for (rival, probability) in rivals {
        match alternatives.iter_mut().find(|(other, _)| other.is_same_as(&rival)) {
            Some((_, sum)) => *sum += probability,
            None => alternatives.push((rival, probability)),
        }
    }
    alternatives.sort_by(|a, b| b.1.total_cmp(&a.1));
    alternatives
}

/// Returns effects that may replace `effect` in a model with the effects `held`; of each family at
/// a place, only the most probable. Each is at least `min_ratio` times as probable as the most
/// probable one of `effect` and them.
fn alternatives(
    evidence: &Evidence,
    effect: &Effect,
    held: &[Effect],
    min_ratio: f64,
) -> Vec<(Effect, f64)> {
    let mut by_place: BTreeMap<String, usize> = BTreeMap::new();
    let mut found: Vec<(Effect, f64)> = Vec::new();
    for other in effect.parts().iter().flat_map(|part| evidence.alternatives(part, held, min_ratio))
    {
        by_place.entry(other.0.name_and_place()).or_insert_with(|| {
            found.push(other);
            found.len()
        });
    }
    found
}

/// Alternative of an effect, fitted in its place.
#[derive(Debug, Clone)]
pub struct Compared {
    /// Effect that was fitted.
    pub effect: Effect,
    /// ln of the odds of the found effect over this one by their predictions of poses that are left
    /// out, without the prior probabilities of the two.
    pub ln_odds: f64,
    /// Estimates of its parameters.
    pub estimates: Vec<Estimate>,
    /// True if no pose within the measured ranges distinguishes the two.
    pub is_alike: bool,
}

/// Fits the most probable alternatives of a found effect in its place, and compares the predictions
/// of left-out poses.
fn compare_alternatives(state: &SearchState, fitted: &Fitted, found: &Found) -> Vec<Compared> {
    let mut others = state.added(fitted);
    others.retain(|other| *other != found.effect);
    let compared = |(effect, _): &(Effect, f64)| {
        let effects = [others.as_slice(), std::slice::from_ref(effect)].concat();
        let rival = state.fit(fitted, &effects).ok()?;
        let gain = LeftOutGain::new(fitted, &rival, state.data)?;
        let parameters = rival.parameters_of(effect).into_iter();
        let without = state.problem(fitted, &others);
        let pair = [found.effect.clone(), effect.clone()];
        let mut poses = std::iter::once(state.data.measurements.select(state.data.rows()))
            .chain(std::iter::once_with(|| random_poses(state.data)));
        Some(Compared {
            is_alike: poses.all(|poses| are_alike(&without, &poses, &pair)),
            effect: effect.clone(),
            ln_odds: gain.ln_odds(fitted.sigma.min(rival.sigma)),
            estimates: parameters.map(|k| rival.found.estimates[k].clone()).collect(),
        })
    };
    found.alternatives.iter().take(MAX_FITTED_ALTERNATIVES).filter_map(compared).collect()
}

/// Effect of a fit, and plainer effects that may act in its place.
#[derive(Debug, Clone)]
struct Plainer {
    /// Effect of the fit.
    pub effect: Effect,
    /// Simpler effects that together explain the residual as well as the effect of the fit.
    pub instead: Vec<Effect>,
    /// Probability of the effect if either the effect or all of `instead` act; both have the same
    /// prior probability.
    pub share: f64,
}

/// Returns the plainer causes that together displace the target almost as an effect does: bending
/// of a link rotates and shifts its end, as compliance of the joints at both ends does.
fn plainer_causes(effect: &Effect) -> Vec<Effect> {
    match *effect {
        Effect::LinkBending { joint } if joint > 1 => {
            [joint - 1, joint].map(|joint| Effect::JointCompliance { joint }).into()
        }
        _ => Vec::new(),
    }
}

/// Fits the plainer causes of each added effect in its place, and compares the predictions of
/// left-out poses. Effects without plainer causes are left out.
fn compare_with_plainer(state: &SearchState, fitted: &Fitted) -> Vec<Plainer> {
    let added = state.added(fitted);
    let compared = |effect: &Effect| {
        let others: Vec<Effect> = added.iter().filter(|other| *other != effect).cloned().collect();
        let without = state.problem(fitted, &others);
        let candidates = Candidates::new(&without, state.data);
        let is_tested = |cause: &Effect| candidates.testable.contains(cause);
        let instead: Vec<Effect> = plainer_causes(effect).into_iter().filter(is_tested).collect();
        if instead.is_empty() {
            return None;
        }
        let effects = [others.as_slice(), instead.as_slice()].concat();
        let rival = state.fit(fitted, &effects).ok()?;
        // The σ of the noise is that of the better fit.
        let sigma = fitted.sigma.min(rival.sigma);
        let gain = LeftOutGain::new(fitted, &rival, state.data)?;
        let share = (1.0 + (-gain.ln_odds(sigma)).exp()).recip();
        Some(Plainer { effect: effect.clone(), instead, share })
    };
    added.iter().filter_map(compared).collect()
}

/// Lowers the status of effects to `at_most`, unless it is lower.
pub(super) fn lower<'a>(effects: impl Iterator<Item = &'a mut Found>, at_most: Status) {
    effects.for_each(|found| found.status = found.status.max(at_most));
}

/// Lowers the status of effects that data contradict: of all, to probable, if held-out rows
/// contradict the fit and do not `gain` beyond chance; of composed laws, to located, if another
/// direction of gravity explains as much.
pub(super) fn lower_contradicted(
    effects: &mut [Found],
    fit: &Identification,
    (gain, has_other_gravity): (Interval, bool),
) {
    if fit.has(FindingCode::HeldOutBeyondPrediction) && gain.low <= 0.0 {
        lower(effects.iter_mut(), Status::Probable);
    }
    if has_other_gravity {
        lower(effects.iter_mut().filter(|found| found.effect.is_composed()), Status::Located);
    }
}

/// Returns the recorded quantities on which an effect depends, with their ranges over the
/// identification poses (SI, temperatures in °C).
pub(super) fn ranges(
    fitted: &Fitted,
    data: &Data,
    effect: &Effect,
) -> Vec<(Covariate, (f64, f64))> {
    let poses = fitted.poses(data, data.rows());
    let has_approach = poses.iter().any(|pose| pose.setup.approach.is_some());
    let coverage = (has_approach, data.measurements.time_measured);
    let names = fitted.problem.covariate_names();
    let range = |covariate: Covariate| {
        let values = poses.iter().map(|pose| value(&covariate, &pose.setup, &names));
        let values = values.collect::<Option<Vec<f64>>>()?;
        let extreme = |of: fn(f64, f64) -> f64| values.iter().copied().reduce(of);
        Some((covariate, (extreme(f64::min)?, extreme(f64::max)?)))
    };
    let depends_on = Hypothesis::of_effect(effect, &fitted.problem, coverage).depends_on;
    depends_on.into_iter().filter_map(range).collect()
}

/// Returns the value of a covariate in a pose; `None` if the table does not record it. `names` are
/// those of the declared covariates.
fn value(covariate: &Covariate, setup: &PoseView, names: &[String]) -> Option<f64> {
    match covariate {
        Covariate::Command(joint) => setup.configuration.get(*joint).copied(),
        Covariate::Temperature => setup.temperature.copied(),
        Covariate::Payload => setup.payload.copied(),
        Covariate::Hoist => setup.hoist.copied(),
        Covariate::Time | Covariate::Row => Some(setup.elapsed),
        Covariate::Approach(joint) => setup.approach.map(|sides| sides[*joint]),
        Covariate::Load | Covariate::Position | Covariate::Velocity => None,
        Covariate::Declared(name) => {
            let index = names.iter().position(|other| other.as_str() == &**name)?;
            setup.covariates.get(index).copied()
        }
    }
}
