//! The whole story: before, what was found, after, what remains.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::super::candidates::Candidates;
use super::super::data::Data;
use super::super::evidence::{
    Claims, Evidence, Hypothesis, HypothesisSet, ln_posterior, stability, weigh,
};
use super::super::fitted::Fitted;
use super::super::reference_check::{ReferenceCheck, reference_check};
use super::super::rules::SelectionRules;
use super::super::screening::{Trace, check_fit, trace_fit};
use super::super::unexplained::{self, Unexplained};
use super::alternatives::Replacements;
use super::harmonics::{self, HarmonicPrior};
use super::interval;
pub use super::rounds::Round;
use super::rounds::Rounds;
use super::status::{Status, Verdict};
use crate::error::Location;
use crate::fit::{
    ErrorSummary, Errors, Estimate, Identification, IdentifyError, Options, Progress,
};
use crate::measurement::Dataset;
use crate::numeric::Interval;
use crate::problem::{Effect, Problem};
use crate::residual_tests::Findings;

/// An effect that the loop added.
#[derive(Debug, Clone)]
pub struct Found {
    /// Which.
    pub effect: Effect,
    /// What may be claimed of it.
    pub status: Status,
    /// What is claimed of it, each with its probability; `None` where no evidence could be weighed.
    pub claims: Option<Claims>,
    /// Probability that chance alone gains as much, corrected for the candidates tried.
    pub p_value: f64,
    /// Its parameters.
    pub estimates: Vec<Estimate>,
    /// Effects that these data cannot tell from it, best first.
    pub alternatives: Vec<Effect>,
    /// Part of fits to whole configurations drawn anew that name it; `None` where no evidence could
    /// be weighed.
    pub stability: Option<f64>,
    /// What data say that took no part in the fit; `None` where none speak of it.
    pub reference_check: Option<ReferenceCheck>,
    /// Error on held-out poses after the first round whose effects include it and were all kept to
    /// the end; that of the final fit where no round is such.
    pub held_out_after: ErrorSummary,
}

/// The loop from the declared problem to one that leaves nothing to find.
#[derive(Debug, Clone)]
pub struct ClosedLoop {
    /// What it came to.
    pub verdict: Verdict,
    /// Whether it was stopped before the search ended: it is finished as of the last round that was
    /// done, and more may be there.
    pub interrupted: bool,
    /// The fit of the declared problem, its residual tests, and what its residual points to.
    pub before: Trace,
    /// The fit with every effect that was found.
    pub after: Identification,
    /// Errors with the effects of status [`Status::Found`] alone.
    pub with_found: Errors,
    /// Residual tests of what it leaves.
    pub findings: Findings,
    /// The problem with what was found declared.
    pub closed: Problem,
    /// In the order in which they were found.
    pub effects: Vec<Found>,
    /// What each round came to.
    pub rounds: Vec<Round>,
    /// The prior that the closed problem has for the harmonics of joints, where they are many.
    pub harmonic_prior: Option<HarmonicPrior>,
    /// Structure whose law is not known, the surest first.
    pub unexplained: Vec<Unexplained>,
    /// Mean reduction of the error on held-out poses \[m\].
    pub gain: Interval,
    /// Identification rows too far off to be noise: they took no part in the choice of effects.
    pub set_aside: Vec<Location>,
}

impl ClosedLoop {
    /// Error on held-out poses once an effect was in the model, where more was added after it.
    pub fn held_out_once(&self, found: &Found) -> Option<ErrorSummary> {
        Some(found.held_out_after).filter(|then| *then != self.after.fitted.held_out)
    }
}

/// Finds what `problem` lacks, from the identification rows alone; held-out rows only measure the
/// outcome.
///
/// Stopped by [`Options::stop`], it leaves the round under way and finishes with what the rounds
/// before came to.
///
/// # Errors
/// Problem, data and options do not fit each other, or it was stopped before the problem as
/// declared was fitted.
pub fn close(
    problem: &Problem,
    data: &Dataset,
    options: &Options,
) -> Result<ClosedLoop, IdentifyError> {
    close_by(problem, data, options, &SelectionRules::DEFAULT)
}

/// The same by other rules.
///
/// # Errors
/// As of [`close`].
pub fn close_by(
    problem: &Problem,
    data: &Dataset,
    options: &Options,
    rules: &SelectionRules,
) -> Result<ClosedLoop, IdentifyError> {
    rules.check()?;
    // What was found is finished in any case: the search alone is stopped.
    let data = Data::new(data, rules).with_candidates(&options.candidates);
    let (hurried, unhurried) = (
        data.clone().with_stop(options.stop.clone().unwrap_or_default()),
        options.clone().with_stop(None),
    );
    // Evidence is of positions: so are the fits.
    let first = Fitted::new(problem.positions_alone(), &data, options)?;
    let before = trace_fit(&first, &data);
    let errors_before = first.errors(&data, &data.split.held_out);
    let mut rounds = Rounds::new(&hurried, options, &first);
    let declared = first.clone();
    let result = chosen(&mut rounds, first);
    let interrupted = result.as_ref().is_err_and(IdentifyError::is_interrupted);
    options.tell(|| Progress::Finishing);
    rounds.data = &data;
    let (fitted, harmonic_prior, evidence) = if interrupted {
        (rounds.taken.clone().settled(&data, &unhurried)?, None, rounds.known.take())
    } else {
        result?
    };
    // What was missing at first may have driven a parameter to where no step leads back from: such
    // a fit begins anew.
    let anew = if fitted.found.describes_arm() {
        None
    } else {
        Some(Fitted::new(fitted.problem.clone(), &data, &unhurried)?)
    };
    let anew = anew.filter(|anew| anew.found.describes_arm());
    let evidence = evidence.filter(|_| anew.is_none());
    let fitted = anew.unwrap_or(fitted);
    // Beside a fit that is not to be trusted nothing is found: its residual may be that of a
    // mistake in the data.
    let trusted = fitted.found.describes_arm();
    let (fitted, harmonic_prior, evidence) =
        if trusted { (fitted, harmonic_prior, evidence) } else { (declared, None, None) };
    let findings = check_fit(&fitted, &data);
    let added = rounds.added(&fitted);
    // Of very many effects none is taken out again: what is left beside all of them is weighed.
    let crowded = added.iter().flat_map(Effect::parts).count() > rules.crowd;
    let taken_out: &[Effect] = if crowded { &[] } else { &added };
    // Where nothing was found before it was stopped, nothing is weighed to say so.
    let is_wanted = trusted && !(interrupted && added.is_empty());
    let evidence =
        evidence.or_else(|| if is_wanted { weigh(&fitted, &data, taken_out) } else { None });
    let best = evidence.as_ref().and_then(|all| Some((all, all.sure(rules.sure)?)));
    let mut unexplained =
        best.map_or_else(Vec::new, |best| unexplained::without_law(&fitted, &data, best));
    let effects = found(&rounds, &fitted, best, harmonic_prior.is_some());
    if unexplained.is_empty() {
        unexplained.extend(unexplained::nowhere(&findings));
    }
    let statuses: Vec<Status> = effects.iter().map(|found| found.status).collect();
    let with_found = if statuses.iter().all(|status| *status == Status::Found) {
        None
    } else {
        Some(fit_with_found(&rounds, &fitted, &effects, &unhurried)?)
    };
    let is_noise_with_found =
        with_found.as_ref().is_none_or(|sure| !check_fit(sure, &data).is_structured());
    let verdict = Verdict::of(&statuses, unexplained.is_empty(), is_noise_with_found);
    let with_found = with_found.map_or(fitted.found.fitted, |sure| sure.found.fitted);
    let gain = interval::gain(&data, &errors_before, &fitted.errors(&data, &data.split.held_out));
    let weighed = data.weighed();
    let carried = evidence.iter().flat_map(|all| &all.left_out).map(|&pose| weighed[pose]);
    let aside: BTreeSet<usize> = fitted.set_aside.iter().copied().chain(carried).collect();
    let set_aside = aside.into_iter().map(|row| data.measurements.location(row)).collect();
    Ok(ClosedLoop {
        verdict,
        interrupted,
        before,
        after: fitted.found,
        with_found,
        findings,
        closed: fitted.problem,
        effects,
        rounds: rounds.done,
        harmonic_prior,
        unexplained,
        gain,
        set_aside,
    })
}

/// The fit with what evidence or rounds found, the prior that many harmonics share, and the
/// evidence about it where it led.
///
/// Evidence leads on up to `led_poses` poses. It holds few hypotheses together: where many poses
/// show structure beside them, as the waves of many orders that a gear has, rounds are tried, and
/// taken where they leave noise.
fn chosen(
    rounds: &mut Rounds,
    first: Fitted,
) -> Result<(Fitted, Option<HarmonicPrior>, Option<Evidence>), IdentifyError> {
    let (data, rules) = (rounds.data, rounds.data.rules);
    let noise = |fitted: &Fitted| !check_fit(fitted, data).is_structured();
    let mut led = None;
    if data.is_led() {
        let (fitted, evidence) = weighed(rounds, first.clone())?;
        let evidence = evidence.filter(|_| fitted.found.termination.converged());
        let fitted = fitted.settled(data, rounds.options)?;
        if data.rows().len() <= rules.weighed_poses || noise(&fitted) {
            return Ok((fitted, None, evidence));
        }
        led = Some((
            fitted,
            evidence,
            std::mem::replace(rounds, Rounds::new(data, rounds.options, &first)),
        ));
    }
    match (tried(rounds, first), led) {
        (Ok((fitted, _)), Some((led, evidence, story))) if !noise(&fitted) => {
            *rounds = story;
            Ok((led, None, evidence))
        }
        (Err(error), Some((led, _, story))) => {
            *rounds = story;
            rounds.taken = led;
            Err(error)
        }
        (result, _) => result.map(|(fitted, sigma)| (fitted, sigma, None)),
    }
}

/// The fit with what rounds found, and the prior that many harmonics share.
fn tried(
    rounds: &mut Rounds,
    first: Fitted,
) -> Result<(Fitted, Option<HarmonicPrior>), IdentifyError> {
    let mut fitted = rounds.run(first)?;
    for _ in 0..rounds.data.rules.exchanges.min(rounds.affordable_fits(&fitted)) {
        let Some(next) = exchanged(rounds, &fitted)? else { break };
        fitted = rounds.run(next)?;
    }
    harmonics::filled(rounds, fitted)
}

/// The fit with the effects of the explanation that is sure, weighed again about every fit until
/// that is what the model holds; and the evidence about it.
fn weighed(
    rounds: &mut Rounds,
    first: Fitted,
) -> Result<(Fitted, Option<Evidence>), IdentifyError> {
    rounds.is_new(&first);
    let mut fitted = first;
    // What led to the fit at hand, if that were odds of fits of their own.
    let mut led: Option<Evidence> = None;
    while rounds.done.len() < rounds.data.rules.rounds {
        rounds.tell(0, 0);
        let added = rounds.added(&fitted);
        let Some(evidence) = rounds.weigh(&fitted)? else { return Ok((fitted, None)) };
        let Some(best) = evidence.sure(rounds.data.rules.sure) else {
            return Ok((fitted, Some(evidence)));
        };
        let mut next = None;
        if !is_held(best, &added) {
            rounds.tell(1, 1);
            next = Some(rounds.fit(&fitted, &best.effects())?).filter(|next| rounds.is_new(next));
            // Back to what did less well at a fit of its own: that is known better than what the
            // fit at hand says of it from afar.
            if let (None, Some(led)) = (&next, led) {
                return Ok((fitted, Some(led)));
            }
        }
        // Where the model holds what is sure: is there a better one at a fit of its own?
        let next = if let Some(next) = next {
            led = None;
            next
        } else {
            let (evidence, better) = refitted(rounds, &fitted, evidence)?;
            let Some(better) = better.filter(|better| rounds.is_new(better)) else {
                return Ok((fitted, Some(evidence)));
            };
            led = Some(evidence);
            better
        };
        rounds.note(&next);
        fitted = next;
    }
    let evidence = rounds.weigh(&fitted)?;
    Ok((fitted, evidence))
}

/// Whether the effects of an explanation are those that were added.
fn is_held(explanation: &HypothesisSet, added: &[Effect]) -> bool {
    let own = explanation.effects();
    let parts: Vec<Effect> = added.iter().flat_map(Effect::parts).collect();
    own.len() == parts.len() && parts.iter().all(|part| own.contains(part))
}

/// The evidence with what may stand in the place of an effect weighed at a fit of its own, and the
/// best of these fits where it is better than the one given.
fn refitted(
    rounds: &Rounds,
    fitted: &Fitted,
    evidence: Evidence,
) -> Result<(Evidence, Option<Fitted>), IdentifyError> {
    let (data, rules) = (rounds.data, rounds.data.rules);
    let added = rounds.added(fitted);
    let held = evidence
        .sure(rules.sure)
        .filter(|best| !best.hypotheses.is_empty() && is_held(best, &added));
    let Some(best) = held.cloned() else { return Ok((evidence, None)) };
    let left_out = evidence.left_out.clone();
    let odds_of = |fitted: &Fitted, functions: &[(Hypothesis, usize)], sigma: f64| {
        unless_stopped(data, || {
            ln_posterior(fitted, data, (&rounds.added(fitted), &left_out), (functions, sigma))
        })
    };
    let functions = best.without_law();
    let Some(own) = odds_of(fitted, &functions, fitted.sigma)? else { return Ok((evidence, None)) };
    let rivals = evidence.exchanged(&best, rules.rivals);
    let mut tried: Vec<(HypothesisSet, f64, Fitted)> = Vec::new();
    let count = rivals.len();
    for (k, rival) in rivals.into_iter().enumerate() {
        rounds.tell(k + 1, count);
        let next = rounds.fit(fitted, &rival.effects())?;
        let other = odds_of(&next, &rival.without_law(), fitted.sigma)?;
        tried.extend(other.map(|other| (rival, other - own, next)));
    }
    tried.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut odds: Vec<(HypothesisSet, f64)> = Vec::new();
    let mut better: Option<Fitted> = None;
    for (rival, ln_odds, next) in tried {
        // A law in the place of a function must be what its own fit speaks for: functions are never
        // fitted but linear about another fit.
        let left = rival.without_law().len();
        let is_best = ln_odds > 0.0 && better.is_none();
        if is_best && left < functions.len() && !stands(&next, data, &rounds.added(&next), left)? {
            continue;
        }
        odds.push((rival, ln_odds));
        if is_best {
            better = Some(next);
        }
    }
    Ok((evidence.corrected(&best, &odds), better))
}

/// What evidence says, unless the wish to end made it say nothing.
fn unless_stopped<T>(data: &Data, evidence: impl FnOnce() -> T) -> Result<T, IdentifyError> {
    let said = evidence();
    if data.stop.is_requested() { Err(IdentifyError::interrupted()) } else { Ok(said) }
}

/// Whether what explains the residual of a fit is what was added, and no more functions than these.
fn stands(
    fitted: &Fitted,
    data: &Data,
    added: &[Effect],
    functions: usize,
) -> Result<bool, IdentifyError> {
    let evidence = unless_stopped(data, || weigh(fitted, data, added))?;
    let best = evidence.as_ref().and_then(|evidence| evidence.sure(data.rules.sure));
    Ok(best.is_some_and(|best| is_held(best, added) && best.without_law().len() <= functions))
}

/// Factors of a time constant or distance that are tried in its place, where they are none of the
/// list: between one and the next.
const FINER: [f64; 10] = [0.8, 0.86, 0.91, 0.95, 0.98, 1.02, 1.05, 1.1, 1.16, 1.25];

/// The fit with an added effect exchanged for a better one, if there is one, once all others are
/// in.
fn exchanged(rounds: &mut Rounds, fitted: &Fitted) -> Result<Option<Fitted>, IdentifyError> {
    let added = rounds.added(fitted);
    if added.len() < 2 && !added.iter().any(Effect::has_memory) {
        return Ok(None);
    }
    let mut candidates = Candidates::of(&fitted.problem, rounds.data).testable;
    // Of a time constant or distance those between the listed ones too.
    let nearer = |effect: &Effect| {
        FINER.iter().filter_map(|factor| effect.scaled(*factor)).collect::<Vec<_>>()
    };
    let finer: Vec<Effect> =
        added.iter().filter(|effect| effect.has_memory()).flat_map(nearer).collect();
    let finer = finer.into_iter().filter(|effect| !candidates.contains(effect)).collect::<Vec<_>>();
    candidates.extend(finer);
    let linearised = fitted.linearised(rounds.data, &candidates);
    let replacements = Replacements::new(fitted, &linearised, &candidates, rounds.data);
    for effect in &added {
        if let Some(better) = replacements.better_than(effect) {
            let gone = std::slice::from_ref(effect);
            let change = (gone, std::slice::from_ref(&better));
            let staying = rounds.staying(fitted, change, replacements.unknowns(), || {
                Arc::new(replacements.with(&better))
            });
            if staying.as_ref().is_some_and(|effects| rounds.was_fitted(effects)) {
                continue;
            }
            let all = added.iter().filter(|known| *known != effect).chain([&better]);
            let kept: Vec<Effect> = staying.unwrap_or_else(|| all.cloned().collect());
            let next = rounds.without_insignificant(rounds.fit(fitted, &kept)?)?;
            if rounds.enter(&next) {
                return Ok(Some(next));
            }
        }
    }
    Ok(None)
}

/// Fits the declared problem with the effects of status [`Status::Found`] alone.
fn fit_with_found(
    rounds: &Rounds,
    fitted: &Fitted,
    effects: &[Found],
    options: &Options,
) -> Result<Fitted, IdentifyError> {
    let sure = effects.iter().filter(|found| found.status == Status::Found);
    let sure: Vec<Effect> = sure.map(|found| found.effect.clone()).collect();
    let problem = fitted.with_effects(&rounds.with_declared(&sure));
    Fitted::new(problem, rounds.data, &fitted.onwards(options))
}

/// Every added effect with what is known of it; harmonics may share a prior.
fn found(
    rounds: &Rounds,
    fitted: &Fitted,
    best: Option<(&Evidence, &HypothesisSet)>,
    common_prior: bool,
) -> Vec<Found> {
    let added = rounds.added(fitted);
    let parts: Vec<Effect> = added.iter().flat_map(Effect::parts).collect();
    let stable = best.map(|best| stability(fitted, rounds.data, best, &added)).unwrap_or_default();
    // Of many orders under one prior none may stand out by itself.
    let tested =
        if common_prior { rounds.test(fitted, added.clone()) } else { rounds.tested(fitted) };
    let first_with = |effect: &Effect| {
        let stays = |known: &Effect| added.iter().any(|own| own.covers(known));
        let holds = |step: &&Round| step.effects.iter().any(|known| effect.covers(known));
        let step = rounds.done.iter().find(|step| holds(step) && step.effects.iter().all(stays));
        step.map_or(fitted.found.fitted.held_out, |step| step.held_out)
    };
    let one = |effect: Effect| {
        let alternatives = best.map_or_else(Vec::new, |(evidence, _)| {
            alternatives(evidence, &effect, &parts, rounds.data.rules.beside)
        });
        let own = stable.iter().filter(|(part, _)| effect.covers(part)).map(|(_, share)| *share);
        let rules = rounds.data.rules;
        let claims = best.and_then(|(evidence, _)| claims(evidence, &effect, rules.several_orders));
        let tested = tested.iter().filter(|part| effect.covers(&part.effect));
        let p_value = tested.map(|part| part.p).fold(1.0, f64::min);
        let check = reference_check(fitted, rounds.data, &effect);
        // Of many orders under one prior none may be significant by itself.
        let is_significant = common_prior || p_value < rules.leaving_level;
        let says = check.as_ref().map(|check| check.verdict);
        let law = claims.as_ref().map(|claims| claims.law.1);
        Found {
            stability: own.reduce(f64::min),
            status: Status::of(law, rules.stated, (is_significant, says)),
            claims,
            p_value,
            estimates: fitted
                .parameters_of(&effect)
                .into_iter()
                .map(|k| fitted.found.estimates[k].clone())
                .collect(),
            held_out_after: first_with(&effect),
            alternatives,
            reference_check: check,
            effect,
        }
    };
    added.iter().cloned().map(one).collect()
}

/// What is claimed of an effect: of a few orders of a harmonic that of the least sure, of many that
/// some order is at work.
fn claims(evidence: &Evidence, effect: &Effect, several: usize) -> Option<Claims> {
    let parts = effect.parts();
    let claims =
        parts.iter().map(|part| evidence.claims_of(part)).collect::<Option<Vec<Claims>>>()?;
    let by_law = |a: &Claims, b: &Claims| a.law.1.total_cmp(&b.law.1);
    if parts.len() >= several {
        claims.into_iter().max_by(by_law)
    } else {
        claims.into_iter().min_by(by_law)
    }
}

/// What may stand in the place of an effect: of a family at one place the most probable.
fn alternatives(evidence: &Evidence, effect: &Effect, held: &[Effect], beside: f64) -> Vec<Effect> {
    let mut all: Vec<Effect> = Vec::new();
    for other in effect.parts().iter().flat_map(|part| evidence.alternatives(part, held, beside)) {
        let is_known = |known: &Effect| known.name_and_place() == other.name_and_place();
        if !all.iter().any(is_known) {
            all.push(other);
        }
    }
    all
}
