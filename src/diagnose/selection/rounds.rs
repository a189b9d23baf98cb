//! Rounds of the loop: pick, fit, test again.

use super::super::candidates::{Candidates, joined};
use super::super::data::Data;
use super::super::fitted::Fitted;
use super::super::neighbourhood::{Scan, tries};
use super::super::smooth_term::SmoothTerm;
use super::pick::{LEAVING, MOST_REFITTED, Pick, pick};
use super::retest::{Retested, retest};
use crate::identify::{ErrorSummary, IdentifyError, Options};
use crate::problem::{Effect, Problem};

/// Rounds after which the loop ends whatever is left.
const MOST_ROUNDS: usize = 24;
/// Steps of a fit to so many poses before the last: what curved valleys still hide decides nothing.
const FEW_STEPS: u64 = 4;
/// Rivals that are fitted to decide between them.
const MOST_RIVALS: usize = 5;

/// One round of the loop.
#[derive(Debug, Clone)]
pub struct Round {
    /// Effects in the model after it.
    pub effects: Vec<Effect>,
    /// Error on the identification poses.
    pub identification: ErrorSummary,
    /// Error on held-out poses, which decided nothing.
    pub held_out: ErrorSummary,
}

/// The rounds of one loop.
pub(super) struct Rounds<'a> {
    pub data: &'a Data<'a>,
    pub options: &'a Options,
    /// Effects of the problem itself, which stay.
    pub declared: Vec<Effect>,
    /// Smooth structure that is known of and kept out of the search.
    pub smooth_terms: Vec<SmoothTerm>,
    pub steps: Vec<Round>,
    /// Sets of effects that were fitted.
    pub seen: Vec<Vec<String>>,
}

impl Rounds<'_> {
    /// Effects that the loop added.
    pub fn added(&self, fitted: &Fitted) -> Vec<Effect> {
        let declared: Vec<Effect> = self.declared.iter().flat_map(Effect::parts).collect();
        let own =
            fitted.effects().iter().flat_map(Effect::parts).filter(|part| !declared.contains(part)).collect::<Vec<_>>();
        own.iter().fold(Vec::new(), |all, part| joined(&all, part))
    }

    /// Adds effects until none stands out.
    pub fn run(&mut self, mut fitted: Fitted) -> Result<Fitted, IdentifyError> {
        self.is_new(&fitted);
        while self.steps.len() < MOST_ROUNDS {
            let candidates = Candidates::of(&fitted.problem, self.data);
            let picks = {
                let library = fitted.library(self.data, &candidates.testable, &self.smooth_terms);
                let linear = fitted.linear(&library, &[], &self.smooth_terms);
                pick(&mut Scan::new(&library, linear, candidates.testable), self.data)
            };
            let Some(next) = self.with(&fitted, &picks)? else { break };
            let next = self.without_insignificant(next)?;
            if !self.is_new(&next) {
                break;
            }
            self.note(&next);
            fitted = next;
        }
        Ok(fitted)
    }

    /// Whether there are so many poses that the linear neighbourhood decides.
    pub fn has_many_poses(&self) -> bool {
        self.data.rows().len() > MOST_REFITTED
    }

    /// Fits on until it converges, if the rounds stopped before that.
    pub fn settled(&self, fitted: Fitted) -> Result<Fitted, IdentifyError> {
        if fitted.found.termination.converged() {
            return Ok(fitted);
        }
        self.fit_whole(fitted.problem.clone(), &fitted)
    }

    /// A problem fitted from where another fit ended.
    pub fn fit_whole(&self, problem: Problem, from: &Fitted) -> Result<Fitted, IdentifyError> {
        Fitted::new(problem, self.data, &from.onwards(self.options))
    }

    /// The same in a few steps where there are many poses.
    pub fn fit_few(&self, problem: Problem, from: &Fitted) -> Result<Fitted, IdentifyError> {
        let max_steps = self.has_many_poses().then_some(FEW_STEPS);
        Fitted::new(problem, self.data, &Options { max_steps, ..from.onwards(self.options) })
    }

    /// Enters a fit into the story.
    pub fn note(&mut self, fitted: &Fitted) {
        let errors = fitted.found.fitted;
        self.steps.push(Round {
            effects: self.added(fitted),
            identification: errors.identification,
            held_out: errors.held_out,
        });
    }

    /// Whether these effects were not fitted together before.
    pub fn is_new(&mut self, fitted: &Fitted) -> bool {
        let mut state: Vec<String> = fitted.effects().iter().map(|effect| format!("{effect:?}")).collect();
        state.sort();
        let new = !self.seen.contains(&state);
        if new {
            self.seen.push(state);
        }
        new
    }

    /// The problem fitted with these effects added.
    pub fn fit(&self, fitted: &Fitted, added: &[Effect]) -> Result<Fitted, IdentifyError> {
        let effects = added.iter().fold(self.declared.clone(), |all, effect| joined(&all, effect));
        self.fit_few(fitted.with_effects(&effects), fitted)
    }

    /// The problem fitted with what was picked; among rivals the one that fits best.
    fn with(&self, fitted: &Fitted, picks: &[Pick]) -> Result<Option<Fitted>, IdentifyError> {
        let present = self.added(fitted);
        match picks {
            [] => Ok(None),
            [Pick { effect, rivals }] if !rivals.is_empty() && !self.has_many_poses() => {
                let mut best: Option<(f64, Fitted)> = None;
                for candidate in std::iter::once(effect).chain(rivals.iter().take(MOST_RIVALS)) {
                    let next = self.fit(fitted, &joined(&present, candidate))?;
                    let criterion = self.criterion(&next, candidate);
                    if best.as_ref().is_none_or(|(least, _)| criterion < *least) {
                        best = Some((criterion, next));
                    }
                }
                Ok(best.map(|(_, next)| next))
            }
            picks => {
                let all = picks.iter().fold(present, |all, pick| joined(&all, &pick.effect));
                Ok(Some(self.fit(fitted, &all)?))
            }
        }
    }

    /// ν ln(squares) + k ln ν of a fit, squares in metres whatever σ they were divided by, with 2 ln(tries) for the effect that was picked.
    fn criterion(&self, fitted: &Fitted, picked: &Effect) -> f64 {
        let library = fitted.library(self.data, &[], &self.smooth_terms);
        let linear = fitted.linear(&library, &[], &self.smooth_terms);
        let candidates = Candidates::of(&fitted.problem, self.data).testable;
        let everything: Vec<Effect> = candidates.into_iter().chain([picked.clone()]).collect();
        let tries = tries(&everything).0.last().copied().unwrap_or(1.0);
        let rows = linear.rows() as f64;
        let squares = linear.sums().squares.ln() + 2.0 * fitted.sigma.ln();
        rows * squares + fitted.unknowns.len() as f64 * rows.ln() + 2.0 * tries.ln()
    }

    /// The same without the effects that have lost their significance.
    pub fn without_insignificant(&self, mut fitted: Fitted) -> Result<Fitted, IdentifyError> {
        loop {
            let added = self.added(&fitted);
            let mut leaving: Vec<Retested> =
                self.tested(&fitted).into_iter().filter(|tested| tested.p >= LEAVING).collect();
            leaving.sort_by(|a, b| b.p.total_cmp(&a.p));
            // One by one, for what one loses another may gain; with many poses all at once.
            leaving.truncate(if self.has_many_poses() { leaving.len() } else { 1 });
            if leaving.is_empty() {
                return Ok(fitted);
            }
            let stays = |part: &Effect| leaving.iter().all(|leaving| leaving.effect != *part);
            let kept: Vec<Effect> = added.iter().flat_map(Effect::parts).filter(stays).collect();
            fitted = self.fit(&fitted, &kept)?;
        }
    }

    /// Every added effect with its p, corrected for the tries, harmonics order by order.
    pub fn tested(&self, fitted: &Fitted) -> Vec<Retested> {
        self.test(fitted, self.added(fitted).iter().flat_map(Effect::parts).collect())
    }

    /// Effects of a fit with their p, corrected for the tries: those of all orders of a harmonic together.
    pub fn test(&self, fitted: &Fitted, own: Vec<Effect>) -> Vec<Retested> {
        let library = fitted.library(self.data, &[], &self.smooth_terms);
        let mut everything = Candidates::of(&fitted.problem, self.data).testable;
        let first = everything.len();
        everything.extend(own.iter().flat_map(Effect::parts));
        let (tries, families) = tries(&everything);
        let mut tries = tries[first..].iter();
        let mut tested = retest(fitted, &library, &self.smooth_terms, own);
        for tested in &mut tested {
            let own: f64 = tries.by_ref().take(tested.effect.parts().len()).sum();
            tested.p = (tested.p * own * families as f64).min(1.0);
        }
        tested
    }
}
