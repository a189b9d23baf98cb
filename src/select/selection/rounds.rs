//! Rounds of the loop: pick, fit, test again.

use std::sync::Arc;

use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use super::super::candidates::{Candidates, joined};
use super::super::data::Data;
use super::super::evidence::{Evidence, weigh};
use super::super::fitted::Fitted;
use super::super::neighbourhood::{LinearNeighbourhood, Scan, tries};
use super::pick::{Pick, pick};
use crate::fit::{ErrorSummary, IdentifyError, Options, Progress};
use crate::problem::{Effect, Problem};

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

/// An effect of a fit, and the probability that it is none.
#[derive(Debug, Clone)]
pub(super) struct Retested {
    pub effect: Effect,
    pub p: f64,
}

/// The rounds of one loop.
pub(super) struct Rounds<'a> {
    pub data: &'a Data<'a>,
    pub options: &'a Options,
    /// Effects of the problem itself, which stay.
    pub declared: Vec<Effect>,
    /// What each round came to.
    pub done: Vec<Round>,
    /// The fit of the last of them; of the problem as declared before the first.
    pub taken: Fitted,
    /// The evidence about it, once that was weighed.
    pub known: Option<Evidence>,
    /// Sets of effects that were fitted.
    seen: Vec<Vec<Effect>>,
}

impl<'a> Rounds<'a> {
    /// None yet, from the fit of the problem as declared.
    pub fn new(data: &'a Data<'a>, options: &'a Options, first: &Fitted) -> Self {
        let (done, seen) = (Vec::new(), Vec::new());
        Self {
            data,
            options,
            declared: first.effects(),
            done,
            taken: first.clone(),
            known: None,
            seen,
        }
    }

    /// Tells that the round at hand begins the `fit`-th of so many fits; the 0th while it weighs
    /// candidates.
    pub fn tell(&self, fit: usize, fits: usize) {
        let (round, effects) = (self.done.len() + 1, || self.added(&self.taken));
        self.options.tell(|| Progress::Round { round, effects: effects(), fit, fits });
    }

    /// Effects that the loop added.
    pub fn added(&self, fitted: &Fitted) -> Vec<Effect> {
        let declared: Vec<Effect> = self.declared.iter().flat_map(Effect::parts).collect();
        let own = fitted
            .effects()
            .iter()
            .flat_map(Effect::parts)
            .filter(|part| !declared.contains(part))
            .collect::<Vec<_>>();
        own.iter().fold(Vec::new(), |all, part| joined(&all, part))
    }

    /// Weighs what may explain the residual of the fit that was taken last; `None` where it is not
    /// a finite number.
    pub fn weigh(&mut self, fitted: &Fitted) -> Result<Option<Evidence>, IdentifyError> {
        let evidence = weigh(fitted, self.data, &self.added(fitted));
        if self.data.stop.is_requested() {
            return Err(IdentifyError::interrupted());
        }
        self.known.clone_from(&evidence);
        Ok(evidence)
    }

    /// Adds effects until none stands out.
    pub fn run(&mut self, mut fitted: Fitted) -> Result<Fitted, IdentifyError> {
        self.is_new(&fitted);
        while self.done.len() < self.data.rules.rounds {
            self.tell(0, 0);
            let mut candidates = Candidates::of(&fitted.problem, self.data);
            // One of a place: another time constant or distance comes in its stead, when all others
            // are in.
            let added = self.added(&fitted);
            candidates
                .testable
                .retain(|effect| !added.iter().any(|known| known.remembers_like(effect)));
            let (picks, staying) = {
                let linearised = fitted.linearised(self.data, &candidates.testable);
                let fit = fitted.around(self.data);
                let own = fit.unknowns();
                let mut scan = Scan::new(&linearised, fit, candidates.testable, self.data.rules);
                let picks = pick(&mut scan, self.data, self.affordable_fits(&fitted) > 1);
                let picked: Vec<Effect> = picks.iter().map(|pick| pick.effect.clone()).collect();
                let staying =
                    self.staying(&fitted, (&[], &picked), own, || Arc::clone(&scan.linear));
                (picks, staying)
            };
            if staying.is_some_and(|effects| self.was_fitted(&effects)) {
                break;
            }
            let Some(next) = self.with(&fitted, &picks)? else { break };
            let next = self.without_insignificant(next)?;
            if !self.enter(&next) {
                break;
            }
            fitted = next;
        }
        Ok(fitted)
    }

    /// Fits of as many parameters as this one that the work of a round pays for, one at least.
    pub fn affordable_fits(&self, fitted: &Fitted) -> usize {
        let one = self.data.rows().len() as f64 * (fitted.unknowns.len() as f64).powi(2);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
        let count = (self.data.rules.round_work / one.max(1.0)) as usize;
        count.max(1)
    }

    /// A problem with the same effects but for few fitted from where another fit ended: in passing,
    /// and beginning with the σ that that one took, where a round pays for one fit alone.
    pub fn fit_towards(&self, problem: Problem, from: &Fitted) -> Result<Fitted, IdentifyError> {
        if self.affordable_fits(from) == 1 {
            return self.fit_some_steps(problem, from, true);
        }
        Fitted::new(problem, self.data, &from.onwards(self.options))
    }

    /// The same in as many steps as a round pays for.
    pub fn fit_on(&self, problem: Problem, from: &Fitted) -> Result<Fitted, IdentifyError> {
        self.fit_some_steps(problem, from, false)
    }

    /// In passing where a round pays for one fit alone.
    fn fit_some_steps(
        &self,
        problem: Problem,
        from: &Fitted,
        alike: bool,
    ) -> Result<Fitted, IdentifyError> {
        let affordable = self.affordable_fits(from);
        let paid = self.data.rules.few_steps * affordable as u64;
        let max_steps = Some(self.options.max_steps.map_or(paid, |most| most.min(paid)));
        let (single, plain) = (affordable == 1, from.onwards(self.options));
        let options = if single { from.succeeding(self.options, alike) } else { plain };
        Fitted::new(problem, self.data, &Options { max_steps, provisional: single, ..options })
    }

    /// Enters a fit into the story, if its effects were not fitted together before.
    pub fn enter(&mut self, fitted: &Fitted) -> bool {
        let new = self.is_new(fitted);
        if new {
            self.note(fitted);
        }
        new
    }

    /// Enters a fit into the story.
    pub fn note(&mut self, fitted: &Fitted) {
        let errors = fitted.found.fitted;
        let effects = self.added(fitted);
        self.done.push(Round {
            effects,
            identification: errors.identification,
            held_out: errors.held_out,
        });
        self.taken = fitted.clone();
        self.known = None;
    }

    /// Whether these effects were not fitted together before.
    pub fn is_new(&mut self, fitted: &Fitted) -> bool {
        let effects = fitted.effects();
        let new = !self.is_seen(&effects);
        if new {
            self.seen.push(effects);
        }
        new
    }

    fn is_seen(&self, effects: &[Effect]) -> bool {
        let is_same = |seen: &Vec<Effect>| {
            seen.len() == effects.len() && effects.iter().all(|own| seen.contains(own))
        };
        self.seen.iter().any(is_same)
    }

    /// Whether the problem was fitted with these effects added.
    pub fn was_fitted(&self, added: &[Effect]) -> bool {
        self.is_seen(&self.with_declared(added))
    }

    /// Returns the declared effects with the added ones, parts of one harmonic joined.
    pub fn with_declared(&self, added: &[Effect]) -> Vec<Effect> {
        added.iter().fold(self.declared.clone(), |all, effect| joined(&all, effect))
    }

    /// The problem fitted with these effects added.
    pub fn fit(&self, fitted: &Fitted, added: &[Effect]) -> Result<Fitted, IdentifyError> {
        self.fit_on(fitted.with_effects(&self.with_declared(added)), fitted)
    }

    /// What stays of the effects of a fit, those that are `gone` left out, and of others beside
    /// them, in its linear neighbourhood `with` the columns of those others behind those of its
    /// `first` unknowns: what would leave again at once needs no fit to show that.
    ///
    /// `None` where a round pays for several fits, or where that neighbourhood does not decide: of
    /// others that stay a fit has to show what is significant beside them, unless they were fitted
    /// together before.
    pub fn staying(
        &self,
        fitted: &Fitted,
        (gone, others): (&[Effect], &[Effect]),
        first: usize,
        with: impl FnOnce() -> Arc<LinearNeighbourhood>,
    ) -> Option<Vec<Effect>> {
        if self.affordable_fits(fitted) > 1 || others.is_empty() {
            return None;
        }
        let kept = self.added(fitted).into_iter().flat_map(|effect| effect.parts());
        let kept: Vec<Effect> =
            kept.filter(|part| !gone.iter().any(|own| own.covers(part))).collect();
        let new: Vec<Effect> = others.iter().flat_map(Effect::parts).collect();
        let problem_of = |parts: &[Effect]| fitted.with_effects(&self.with_declared(parts));
        let whole = problem_of(&[kept.as_slice(), &new].concat());
        let priors = new.iter().map(|effect| fitted.priors_in(&whole, self.data, effect));
        let priors: Vec<Vec<Option<f64>>> = priors.collect::<Option<_>>()?;
        let linear = with();
        if linear.unknowns() != first + priors.iter().map(Vec::len).sum::<usize>() {
            return None;
        }
        let freedom = linear.sums().freedom();
        let mut estimated = linear.estimated();
        let mut parts: Vec<(Effect, Vec<usize>)> =
            kept.into_iter().map(|part| (part.clone(), fitted.unknowns_of(&part))).collect();
        let mut place = first;
        for (effect, priors) in new.into_iter().zip(priors) {
            let own: Vec<usize> = (place..place + priors.len()).collect();
            place += priors.len();
            own.iter().zip(priors).filter_map(|(&k, sigma)| Some((k, sigma?))).for_each(
                |(k, sigma)| {
                    estimated.with_prior(k, sigma);
                },
            );
            parts.push((effect, own));
        }
        for effect in gone {
            estimated.leave_out(&fitted.unknowns_of(effect));
        }
        loop {
            let effects: Vec<Effect> = parts.iter().map(|(part, _)| part.clone()).collect();
            let tries = self.tries(&problem_of(&effects), &effects);
            let left = (estimated.squares(), freedom);
            let p = |((_, own), tries): (&(Effect, Vec<usize>), f64)| {
                chance_of_loss(estimated.loss_without(own), own.len(), left, tries)
            };
            let worst =
                parts.iter().zip(tries).map(p).enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
            match worst {
                Some((least, p)) if p >= self.data.rules.leaving_level => {
                    let (_, own) = parts.remove(least);
                    estimated.leave_out(&own);
                }
                _ => break,
            }
        }
        let effects = parts.iter().fold(Vec::new(), |all, (part, _)| joined(&all, part));
        let none = !parts.iter().any(|(part, _)| others.iter().any(|other| other.covers(part)));
        (none || self.was_fitted(&effects)).then_some(effects)
    }

    /// The problem fitted with what was picked; among the best of the rivals of a single pick the
    /// one that fits best.
    fn with(&self, fitted: &Fitted, picks: &[Pick]) -> Result<Option<Fitted>, IdentifyError> {
        let present = self.added(fitted);
        let rivals = self.data.rules.rivals.min(self.affordable_fits(fitted) - 1);
        match picks {
            [] => Ok(None),
            [Pick { effect, rivals: others }] if !others.is_empty() && rivals > 0 => {
                let mut best: Option<(f64, Fitted)> = None;
                let tried: Vec<&Effect> =
                    std::iter::once(effect).chain(others.iter().take(rivals)).collect();
                for (k, candidate) in tried.iter().enumerate() {
                    self.tell(k + 1, tried.len());
                    let next = self.fit(fitted, &joined(&present, candidate))?;
                    let criterion = self.criterion(&next, candidate);
                    if best.as_ref().is_none_or(|(least, _)| criterion < *least) {
                        best = Some((criterion, next));
                    }
                }
                Ok(best.map(|(_, next)| next))
            }
            picks => {
                self.tell(1, 1);
                let all = picks.iter().fold(present, |all, pick| joined(&all, &pick.effect));
                Ok(Some(self.fit(fitted, &all)?))
            }
        }
    }

    /// ν ln(squares) + k ln ν of a fit, squares in metres whatever σ they were divided by, with 2
    /// ln(tries) for the effect that was picked.
    fn criterion(&self, fitted: &Fitted, picked: &Effect) -> f64 {
        let fit = fitted.around(self.data);
        let candidates = Candidates::of(&fitted.problem, self.data).testable;
        let everything: Vec<Effect> = candidates.into_iter().chain([picked.clone()]).collect();
        let tries = tries(&everything, &fitted.problem).0.last().copied().unwrap_or(1.0);
        let rows = fit.rows() as f64;
        let squares = fit.sums().squares.ln() + 2.0 * fitted.sigma.ln();
        rows * squares + fitted.unknowns.len() as f64 * rows.ln() + 2.0 * tries.ln()
    }

    /// The same without the effects that have lost their significance: one by one, for what one
    /// loses another may gain, or as many at once as bring it down to what a round pays for.
    pub fn without_insignificant(&self, mut fitted: Fitted) -> Result<Fitted, IdentifyError> {
        loop {
            let added = self.added(&fitted);
            let level = self.data.rules.leaving_level;
            let mut leaving: Vec<Retested> =
                self.tested(&fitted).into_iter().filter(|tested| tested.p >= level).collect();
            leaving.sort_by(|a, b| b.p.total_cmp(&a.p));
            leaving.truncate(leaving.len().div_ceil(self.affordable_fits(&fitted)));
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

    /// Effects of a fit with the p of what it would lose without each, corrected for the tries:
    /// those of all orders of a harmonic together.
    pub fn test(&self, fitted: &Fitted, own: Vec<Effect>) -> Vec<Retested> {
        let fit = fitted.around(self.data);
        let tries = self.tries(&fitted.problem, &own);
        let left = (fit.sums().squares, fit.sums().freedom());
        let test = |(effect, tries): (Effect, f64)| {
            let lost = fit.loss_without(&fitted.unknowns_of(&effect));
            let p = chance_of_loss(lost, fitted.parameters_of(&effect).len(), left, tries);
            Retested { effect, p }
        };
        own.into_iter().zip(tries).map(test).collect()
    }

    /// How often chance has a try at each of some effects of a problem, in all families together.
    fn tries(&self, problem: &Problem, own: &[Effect]) -> Vec<f64> {
        let mut everything = Candidates::of(problem, self.data).testable;
        let first = everything.len();
        everything.extend(own.iter().flat_map(Effect::parts));
        let (all_tries, families) = tries(&everything, problem);
        let mut all_tries = all_tries[first..].iter();
        let sum = |effect: &Effect| {
            all_tries.by_ref().take(effect.parts().len()).sum::<f64>() * families as f64
        };
        own.iter().map(sum).collect()
    }
}

/// Probability that one of so many `tries` of chance would lose as much without k parameters;
/// `left` are squares and degrees of freedom.
fn chance_of_loss(lost: Option<f64>, k: usize, (squares, freedom): (f64, f64), tries: f64) -> f64 {
    let ratio =
        lost.map(|lost| lost / k as f64 / (squares / freedom)).filter(|ratio| !ratio.is_nan());
    let chance = FisherSnedecor::new(k as f64, freedom).ok().zip(ratio);
    let chance = chance.map_or(1.0, |(chance, ratio)| chance.sf(ratio).max(f64::MIN_POSITIVE));
    (chance * tries).min(1.0)
}
