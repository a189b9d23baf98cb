//! Rounds of the loop.

use super::super::candidates::{Candidates, joined, parts, same_family};
use super::super::data::Data;
use super::super::fitted::Fitted;
use super::super::trace::Scan;
use super::pick::{LEVEL, Pick, pick};
use super::retest::{p_values, retest};
use crate::measurement::{Measurements, Split};
use crate::problem::{Effect, Problem};
use crate::study::{ErrorSummary, Estimate, Identification, IdentifyError, Options};

/// Rounds after which the loop ends whatever is left.
const MOST_ROUNDS: usize = 24;
/// Rivals that are fitted to decide between them.
const MOST_RIVALS: usize = 5;

/// What the loop came to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// No effect, no structure.
    NothingFound,
    /// Effects were found and what is left passes the checks.
    Explained,
    /// Structure is left.
    Unexplained,
}

/// An effect that the loop added.
#[derive(Debug, Clone)]
pub struct Found {
    /// Which.
    pub effect: Effect,
    /// Probability that it is none, corrected for the number of candidates tried.
    pub p_value: f64,
    /// Its parameters.
    pub estimates: Vec<Estimate>,
    /// Candidates that these data cannot tell from it.
    pub alternatives: Vec<Effect>,
    /// Error on held-out poses once it was in the model.
    pub held_out_after: ErrorSummary,
}

/// The loop from the declared problem to one that leaves nothing to find.
#[derive(Debug, Clone)]
pub struct Closure {
    /// The fit of the declared problem.
    pub before: Identification,
    /// The fit with every effect that was found.
    pub after: Identification,
    /// The problem with what was found declared.
    pub closed: Problem,
    /// In the order in which they were found.
    pub effects: Vec<Found>,
    /// Rounds that were run.
    pub rounds: usize,
}

/// Finds what `problem` lacks, from the identification rows alone.
///
/// # Errors
/// Problem, data and options do not fit each other.
pub fn close(
    problem: &Problem,
    measurements: &Measurements,
    split: &Split,
    options: &Options,
) -> Result<Closure, IdentifyError> {
    let data = Data::new(measurements, split);
    let mut fitted = Fitted::new(problem.clone(), &data, options)?;
    let before = fitted.found.clone();
    let mut history: Vec<(Effect, ErrorSummary)> = Vec::new();
    let mut seen = vec![fitted.effects()];
    let declared = fitted.effects();
    let mut rounds = 0;
    let mut tries = 1;
    while rounds < MOST_ROUNDS {
        let candidates = Candidates::of(&fitted.problem, &data);
        let picks = {
            let library = fitted.library(&data, &candidates.testable);
            let linear = fitted.linear(&library, &[]);
            tries = candidates.testable.len();
            pick(&mut Scan::new(&library, linear, candidates.testable.clone()), &data)
        };
        let Some(next) = added(&fitted, picks, &data, options)? else { break };
        rounds += 1;
        let next = dropped(next, &declared, tries, &data, options)?;
        let mut state = next.effects();
        state.sort_by_key(|effect| format!("{effect:?}"));
        if seen.contains(&state) {
            break;
        }
        seen.push(state);
        for effect in next.effects() {
            if !declared.contains(&effect) && !history.iter().any(|(known, _)| *known == effect) {
                history.push((effect, next.found.fitted.held_out));
            }
        }
        fitted = next;
    }
    let found: Vec<Effect> = fitted.effects().into_iter().filter(|effect| !declared.contains(effect)).collect();
    let library = fitted.library(&data, &[]);
    let p = p_values(&fitted, &library, &found);
    let effects = found
        .iter()
        .zip(p)
        .map(|(effect, p)| Found {
            effect: effect.clone(),
            p_value: (p * tries as f64).min(1.0),
            estimates: fitted.parameters_of(effect).into_iter().map(|k| fitted.found.estimates[k].clone()).collect(),
            alternatives: Vec::new(),
            held_out_after: history
                .iter()
                .find(|(known, _)| known == effect)
                .map_or(fitted.found.fitted.held_out, |(_, errors)| *errors),
        })
        .collect();
    drop(library);
    Ok(Closure { before, closed: fitted.problem.clone(), after: fitted.found, effects, rounds })
}

/// The problem fitted with what a round picked; among rivals the one that fits best.
fn added(fitted: &Fitted, picks: Vec<Pick>, data: &Data, options: &Options) -> Result<Option<Fitted>, IdentifyError> {
    let present = fitted.effects();
    let with = |effects: &[Effect]| Fitted::new(fitted.with_effects(effects), data, options);
    match picks.as_slice() {
        [] => Ok(None),
        [Pick { effect, rivals, .. }] if !rivals.is_empty() => {
            let mut best: Option<(f64, Fitted)> = None;
            let others = rivals.iter().filter(|rival| !same_family(rival, effect) || matches!(rival, Effect::StationShift { .. } | Effect::JointHarmonic { .. }) == matches!(effect, Effect::StationShift { .. } | Effect::JointHarmonic { .. }));
            for candidate in std::iter::once(effect).chain(others.take(MOST_RIVALS)) {
                let next = with(&joined(&present, candidate))?;
                let squares = {
                    let library = next.library(data, &[]);
                    let k = next.unknowns.len() as f64;
                    let rows = 3.0 * data.rows().len() as f64;
                    rows * (next.squares(&library) / rows).ln() + k * rows.ln()
                };
                if best.as_ref().is_none_or(|(least, _)| squares < *least) {
                    best = Some((squares, next));
                }
            }
            Ok(best.map(|(_, next)| next))
        }
        picks => {
            let all = picks.iter().fold(present, |all, pick| joined(&all, &pick.effect));
            Ok(Some(with(&all)?))
        }
    }
}

/// The same without the effects that have lost their significance.
fn dropped(
    mut fitted: Fitted,
    declared: &[Effect],
    tries: usize,
    data: &Data,
    options: &Options,
) -> Result<Fitted, IdentifyError> {
    loop {
        let own: Vec<Effect> = fitted.effects().into_iter().filter(|effect| !declared.contains(effect)).collect();
        let tested = {
            let library = fitted.library(data, &[]);
            retest(&fitted, &library, &own)
        };
        let worst = tested.iter().max_by(|a, b| a.p.total_cmp(&b.p));
        let Some(worst) = worst.filter(|worst| worst.p * tries as f64 >= LEVEL).cloned() else { return Ok(fitted) };
        let kept = own.iter().flat_map(parts).filter(|part| *part != worst.effect);
        let effects = kept.fold(declared.to_vec(), |all, part| joined(&all, &part));
        fitted = Fitted::new(fitted.with_effects(&effects), data, options)?;
    }
}
