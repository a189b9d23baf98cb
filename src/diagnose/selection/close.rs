//! The whole story: before, what was found, after, what remains.

use super::super::candidates::Candidates;
use super::super::data::Data;
use super::super::fitted::Fitted;
use super::super::residual_tests::Findings;
use super::super::rules::SelectionRules;
use super::super::screening::{Trace, check_fit, trace_fit};
use super::super::unexplained::{self, Unexplained};
use super::alternatives::Replacements;
use super::harmonics;
use super::interval::{self, Interval};
pub use super::rounds::Round;
use super::rounds::Rounds;
use crate::identify::{ErrorSummary, Estimate, Identification, IdentifyError, Options};
use crate::measurement::Dataset;
use crate::problem::{Effect, Problem};

/// What the loop came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// No effect, no structure.
    NothingFound,
    /// Effects were found and what is left passes the residual tests.
    Explained,
    /// Structure is left.
    Unexplained,
}

/// An effect that the loop added.
#[derive(Debug, Clone)]
pub struct Found {
    /// Which.
    pub effect: Effect,
    /// Probability that it is none, corrected for the candidates tried.
    pub p_value: f64,
    /// Its parameters.
    pub estimates: Vec<Estimate>,
    /// Candidates that these data cannot tell from it, best first.
    pub alternatives: Vec<Effect>,
    /// Error on held-out poses after the first round whose effects include it and were all kept to the end; that of the final
    /// fit where no round is such.
    pub held_out_after: ErrorSummary,
}

/// The loop from the declared problem to one that leaves nothing to find.
#[derive(Debug, Clone)]
pub struct ClosedLoop {
    /// What it came to.
    pub verdict: Verdict,
    /// The fit of the declared problem, its residual tests, and what its residual points to.
    pub before: Trace,
    /// The fit with every effect that was found.
    pub after: Identification,
    /// Residual tests of what it leaves.
    pub findings: Findings,
    /// The problem with what was found declared.
    pub closed: Problem,
    /// In the order in which they were found.
    pub effects: Vec<Found>,
    /// What each round came to.
    pub rounds: Vec<Round>,
    /// 1 σ of the prior that the closed problem has for the harmonics of joints, where they are many \[rad\].
    pub harmonic_sigma: Option<f64>,
    /// Structure that no effect explains.
    pub unexplained: Option<Unexplained>,
    /// Mean reduction of the error on held-out poses \[m\].
    pub gain: Interval,
}

impl ClosedLoop {
    /// Error on held-out poses once an effect was in the model, where more was added after it.
    pub fn held_out_once(&self, found: &Found) -> Option<ErrorSummary> {
        Some(found.held_out_after).filter(|then| *then != self.after.fitted.held_out)
    }
}

/// Finds what `problem` lacks, from the identification rows alone; held-out rows only measure the outcome.
///
/// # Errors
/// Problem, data and options do not fit each other.
pub fn close(problem: &Problem, data: &Dataset, options: &Options) -> Result<ClosedLoop, IdentifyError> {
    close_by(problem, data, options, &SelectionRules::DEFAULT)
}

/// The same by other rules.
///
/// # Errors
/// Problem, data and options do not fit each other.
pub fn close_by(
    problem: &Problem,
    data: &Dataset,
    options: &Options,
    rules: &SelectionRules,
) -> Result<ClosedLoop, IdentifyError> {
    rules.check()?;
    let data = Data::new(data, rules).with_candidates(&options.candidates);
    let first = Fitted::new(problem.clone(), &data, options)?;
    let before = trace_fit(&first, &data);
    let errors_before = first.errors(&data, &data.split.held_out);
    let mut rounds = Rounds::new(&data, options, first.effects());
    let mut fitted = rounds.run(first)?;
    for _ in 0..rules.exchanges.min(rounds.affordable_fits(&fitted)) {
        let Some(next) = exchanged(&mut rounds, &fitted)? else { break };
        fitted = rounds.run(next)?;
    }
    let (fitted, unexplained) = with_smooth_term(&mut rounds, fitted)?;
    let (fitted, harmonic_sigma, changed) = harmonics::filled(&rounds, fitted)?;
    let unexplained =
        if changed { unexplained::localise(&fitted, &data, rounds.smooth_terms.first()) } else { unexplained };
    let findings = check_fit(&fitted, &data);
    let unexplained = unexplained.or_else(|| unexplained::nowhere(&findings));
    let effects = found(&rounds, &fitted, (findings.is_structured(), harmonic_sigma.is_some()));
    let verdict = match (&unexplained, effects.is_empty()) {
        (Some(_), _) => Verdict::Unexplained,
        (None, true) => Verdict::NothingFound,
        (None, false) => Verdict::Explained,
    };
    let gain = interval::gain(&data, &errors_before, &fitted.errors(&data, &data.split.held_out));
    Ok(ClosedLoop {
        verdict,
        before,
        after: fitted.found,
        findings,
        closed: fitted.problem,
        effects,
        rounds: rounds.done,
        harmonic_sigma,
        unexplained,
        gain,
    })
}

/// The fit without effects that only stood in for a smooth function, and the structure that this leaves; the fit as it was
/// where in the end there is none.
fn with_smooth_term(rounds: &mut Rounds, fitted: Fitted) -> Result<(Fitted, Option<Unexplained>), IdentifyError> {
    let data = rounds.data;
    let candidates = Candidates::of(&fitted.problem, data).testable;
    let without = if let Some((term, rest)) = unexplained::withdraw(&fitted, data, &rounds.added(&fitted), &candidates)
    {
        rounds.smooth_terms.push(term);
        let without = rounds.fit(&fitted, &rest)?;
        let without = rounds.without_insignificant(without)?;
        rounds.forget();
        rounds.note(&without);
        rounds.run(without)?
    } else if let Some(tried) = unexplained::strongest(&fitted, data, None) {
        rounds.smooth_terms.push(tried.smooth_term);
        let without = rounds.without_insignificant(fitted.clone())?;
        rounds.enter(&without);
        without
    } else {
        return Ok((fitted, None));
    };
    let left = unexplained::localise(&without, data, rounds.smooth_terms.first());
    if left.is_some() {
        return Ok((without, left));
    }
    rounds.smooth_terms.clear();
    rounds.note(&fitted);
    Ok((fitted, None))
}

/// The fit with an added effect exchanged for a better one, if there is one, once all others are in.
fn exchanged(rounds: &mut Rounds, fitted: &Fitted) -> Result<Option<Fitted>, IdentifyError> {
    let added = rounds.added(fitted);
    if added.len() < 2 {
        return Ok(None);
    }
    let candidates = Candidates::of(&fitted.problem, rounds.data).testable;
    let linearised = fitted.linearised(rounds.data, &candidates, &rounds.smooth_terms);
    let taken_in = rounds.smooth_terms.clone();
    let replacements = Replacements::new(fitted, &linearised, (&candidates, &taken_in), rounds.data);
    for effect in &added {
        if let Some(better) = replacements.of(effect, false).better {
            let kept: Vec<Effect> = added.iter().filter(|known| *known != effect).chain([&better]).cloned().collect();
            let next = rounds.without_insignificant(rounds.fit(fitted, &kept)?)?;
            if rounds.enter(&next) {
                return Ok(Some(next));
            }
        }
    }
    Ok(None)
}

/// Every added effect with what is known of it, where structure is left, and where harmonics share a prior.
fn found(rounds: &Rounds, fitted: &Fitted, (structured, common_prior): (bool, bool)) -> Vec<Found> {
    let candidates = Candidates::of(&fitted.problem, rounds.data).testable;
    let linearised = fitted.linearised(rounds.data, &candidates, &rounds.smooth_terms);
    let replacements = Replacements::new(fitted, &linearised, (&candidates, &rounds.smooth_terms), rounds.data);
    let added = rounds.added(fitted);
    // Of many orders under one prior none may stand out by itself.
    let tested = if common_prior { rounds.test(fitted, added.clone()) } else { rounds.tested(fitted) };
    let first_with = |effect: &Effect| {
        let stays = |known: &Effect| added.iter().any(|own| own.covers(known));
        let holds = |step: &&Round| step.effects.iter().any(|known| effect.covers(known));
        let step = rounds.done.iter().find(|step| holds(step) && step.effects.iter().all(stays));
        step.map_or(fitted.found.fitted.held_out, |step| step.held_out)
    };
    let one = |effect: Effect| Found {
        p_value: tested.iter().filter(|part| effect.covers(&part.effect)).map(|part| part.p).fold(1.0, f64::min),
        estimates: fitted.parameters_of(&effect).into_iter().map(|k| fitted.found.estimates[k].clone()).collect(),
        alternatives: replacements.of(&effect, structured).effects,
        held_out_after: first_with(&effect),
        effect,
    };
    added.iter().cloned().map(one).collect()
}
