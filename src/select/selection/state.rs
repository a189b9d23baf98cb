//! State of one search: the fits made so far, and how a set of effects is fitted.

use std::collections::BTreeMap;

use crate::fit::{ErrorSummary, IdentifyError, MisreadEffect, Options, Progress};
use crate::model::parameter::ParameterSite;
use crate::problem::{Effect, ParameterRule, Problem};
use crate::select::candidates::joined;
use crate::select::data::Data;
use crate::select::evidence::{Evidence, HypothesisSet, evaluate};
use crate::select::fitted::Fitted;
use crate::select::harmonic_prior::{HarmonicPrior, is_periodic_of_many_orders};
use crate::select::settings::MAX_RECONSIDERED;

/// Number of solver steps that an intermediate fit may take, as a multiple of the number of fits of
/// this size that the budget `fit_work` allows.
const STEPS_PER_PAID_FIT: u64 = 4;

/// Result of one round of the loop.
#[derive(Debug, Clone)]
pub struct Round {
    /// Effects in the model after the round.
    pub effects: Vec<Effect>,
    /// Error on the identification poses.
    pub identification: ErrorSummary,
    /// Error on held-out poses, which had no influence on the choice of effects.
    pub held_out: ErrorSummary,
}

/// State of one search.
pub(super) struct SearchState<'a> {
    pub data: &'a Data<'a>,
    pub options: &'a Options,
    /// Effects that the declared problem contains; the search keeps them.
    pub declared: Vec<Effect>,
    /// Parameter rules of the declared problem.
    declared_rules: Vec<ParameterRule>,
    /// Common prior of the harmonics for the next fit; `None` if no joint has many orders.
    pub prior: Option<HarmonicPrior>,
    /// Common prior of the harmonics in the latest fit.
    pub prior_of_latest: Option<HarmonicPrior>,
    /// Probability, by joint counted from 1, of the joint's periodic error when it was added to the
    /// fit.
    pub gear_probability: BTreeMap<usize, f64>,
    /// Effect that expresses the misreading of the table; `None` if the search did not start with
    /// one.
    pub misread: Option<MisreadEffect>,
    /// Results of the rounds so far.
    pub rounds: Vec<Round>,
    /// Fit of the latest round; before the first round, that of the declared problem.
    pub latest: Fitted,
    /// Evidence about the latest fit, if it was evaluated.
    pub evidence: Option<Evidence>,
    /// Evidence about the fit of the declared problem, if it was evaluated.
    pub evidence_of_declared: Option<Evidence>,
    /// Sets of effects that were fitted so far.
    fitted_sets: Vec<Vec<Effect>>,
}

impl<'a> SearchState<'a> {
    /// Creates the state before the first round from the fit of the declared problem.
    pub fn new(data: &'a Data<'a>, options: &'a Options, first: &Fitted) -> Self {
        Self {
            data,
            options,
            declared: first.effects(),
            declared_rules: first.problem.parameters.clone(),
            prior: None,
            prior_of_latest: None,
            gear_probability: BTreeMap::new(),
            misread: None,
            rounds: Vec::new(),
            latest: first.clone(),
            evidence: None,
            evidence_of_declared: None,
            fitted_sets: vec![first.effects()],
        }
    }

    /// Reports that the current round begins fit number `fit` of `fits`; both are 0 while it
    /// evaluates evidence.
    pub fn report_progress(&self, fit: usize, fits: usize) {
        let (round, effects) = (self.rounds.len() + 1, || self.added(&self.latest));
        self.options.report_progress(|| Progress::Round { round, effects: effects(), fit, fits });
    }

    /// Returns those effects of a fit that the search added; harmonics of one joint form one
    /// effect.
    pub fn added(&self, fitted: &Fitted) -> Vec<Effect> {
        let declared: Vec<Effect> = self.declared.iter().flat_map(Effect::parts).collect();
        let parts = fitted.effects().into_iter().flat_map(|effect| effect.parts());
        parts
            .filter(|part| !declared.contains(part))
            .fold(Vec::new(), |effects, part| joined(&effects, &part))
    }

    /// Returns the added effects that the evidence removes from the fit and evaluates again.
    /// Periodic errors with many orders stay in the fit. So does the effect that expresses a
    /// misread table, which is far larger than any size that the evidence tries. If there are more
    /// than [`MAX_RECONSIDERED`] effects, all stay.
    pub fn reconsidered(&self, fitted: &Fitted) -> Vec<Effect> {
        let misread = self.misread.as_ref().map(|misread| &misread.effect);
        let stays = |effect: &Effect| is_periodic_of_many_orders(effect) || misread == Some(effect);
        let effects: Vec<Effect> =
            self.added(fitted).into_iter().filter(|effect| !stays(effect)).collect();
        let count = effects.iter().flat_map(Effect::parts).count();
        if count > MAX_RECONSIDERED { Vec::new() } else { effects }
    }

    /// Returns the added effects that stay in the fit while evidence is evaluated.
    fn retained_effects(&self, fitted: &Fitted) -> Vec<Effect> {
        let reconsidered = self.reconsidered(fitted);
        self.added(fitted).into_iter().filter(|effect| !reconsidered.contains(effect)).collect()
    }

    /// Evaluates the evidence about a fit and keeps it in the state; `None` if its residual is not
    /// finite. Added effects that are reconsidered are evaluated as if removed.
    ///
    /// # Errors
    /// Returns an error if the search was stopped.
    pub fn evaluate(&mut self, fitted: &Fitted) -> Result<Option<Evidence>, IdentifyError> {
        let evidence = evaluate(fitted, self.data, &self.reconsidered(fitted));
        if self.data.stop.is_requested() {
            return Err(IdentifyError::interrupted());
        }
        self.evidence.clone_from(&evidence);
        if self.rounds.is_empty() && self.added(fitted).is_empty() {
            self.evidence_of_declared.clone_from(&evidence);
        }
        Ok(evidence)
    }

    /// Returns the number of fits with this many unknowns that the budget `fit_work` allows; at
    /// least one.
    pub fn affordable_fits(&self, unknowns: usize) -> usize {
        let work = self.data.rows().len() as f64 * (unknowns as f64).powi(2);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
        let count = (self.data.rules.fit_work / work.max(1.0)) as usize;
        count.max(1)
    }

    /// Returns the declared effects followed by the `added` ones.
    pub fn with_declared(&self, added: &[Effect]) -> Vec<Effect> {
        added.iter().fold(self.declared.clone(), |effects, effect| joined(&effects, effect))
    }

    /// Returns the problem with the declared and the `added` effects, with the common prior of the
    /// harmonics if a joint has many orders.
    pub fn problem(&self, fitted: &Fitted, added: &[Effect]) -> Problem {
        let mut problem = fitted.with_effects(&self.with_declared(added));
        problem.parameters.clone_from(&self.declared_rules);
        if added.iter().any(is_periodic_of_many_orders)
            && let Some(prior) = &self.prior
        {
            prior.add_to(&mut problem);
        }
        if let Some(misread) = &self.misread
            && added.contains(&misread.effect)
        {
            misread.free_in(&mut problem);
        }
        problem
    }

    /// Fits the declared problem with the `added` effects, starting from the end of another fit.
    /// The number of steps is limited by `fit_work`.
    ///
    /// # Errors
    /// Returns an error if the fit fails or was stopped.
    pub fn fit(&self, from: &Fitted, added: &[Effect]) -> Result<Fitted, IdentifyError> {
        let problem = self.problem(from, added);
        let parameters = |effects: &[Effect]| -> usize {
            effects.iter().map(|effect| effect.parameters(&problem).len()).sum()
        };
        let more = parameters(added).saturating_sub(parameters(&self.added(from)));
        let paid = self.affordable_fits(from.unknowns.len() + more);
        let steps = STEPS_PER_PAID_FIT * paid as u64;
        let max_steps = Some(self.options.max_steps.map_or(steps, |most| most.min(steps)));
        let provisional = paid == 1;
        let options = from.warm_started_options(self.options, true);
        let options = Options { max_steps, provisional, ..options };
        from.fit_other(problem, self.data, &options)
    }

    /// Returns the effects of a hypothesis set for the next fit. They are its laws, its periodic
    /// errors with many orders, and the effects that stay in the fit. Extends the common prior of
    /// the harmonics if the set contains periodic errors of orders that the prior lacks.
    pub fn effects_of(
        &mut self,
        fitted: &Fitted,
        (evidence, set): (&Evidence, &HypothesisSet),
    ) -> Vec<Effect> {
        let mut effects = self.retained_effects(fitted);
        for effect in set.effects() {
            effects = joined(&effects, &effect);
        }
        for (joint, highest, size) in set.gears() {
            self.gear_probability.insert(joint, evidence.gear_probability(joint));
            let sigma = self.coefficient_sigma(fitted, joint, highest, size);
            self.extend_prior(highest, sigma);
            let is_taken = |order: &u32| {
                let single = Effect::JointHarmonic { joint, orders: vec![*order] };
                self.declared.iter().chain(&effects).any(|other| other.covers(&single))
            };
            let orders: Vec<u32> = (1..=highest).filter(|order| !is_taken(order)).collect();
            effects = joined(&effects, &Effect::JointHarmonic { joint, orders });
        }
        effects
    }

    /// Returns 1 σ \[rad\] of the coefficients of a periodic error at `joint`, counted from 1, with
    /// `highest` orders. Together they displace the target by `size` times the σ of the noise in
    /// root mean square.
    fn coefficient_sigma(&self, fitted: &Fitted, joint: usize, highest: u32, size: f64) -> f64 {
        let rows = self.data.evidence_rows();
        let site = ParameterSite::coordinate(&fitted.problem, joint);
        let linearised = fitted.linearised_with(self.data, &rows, &[], &[site]);
        let lever = linearised.column_at(site).map_or(0.0, |lever| lever.norm_squared());
        let squares = f64::from(highest) * lever / (3 * rows.len()) as f64;
        if squares > 0.0 { size / squares.sqrt() } else { size }
    }

    /// Adds the orders up to `highest` that the prior lacks, with 1 σ = `sigma` \[rad\].
    fn extend_prior(&mut self, highest: u32, sigma: f64) {
        let prior = self.prior.get_or_insert_with(|| HarmonicPrior { by_order: Vec::new() });
        let first = prior.by_order.last().map_or(1, |(order, _)| order + 1);
        prior.by_order.extend((first..=highest).map(|order| (order, sigma)));
        *prior = prior.scaled(1.0);
    }

    /// Records a fit as the result of a round.
    pub fn record(&mut self, fitted: &Fitted) {
        let errors = fitted.found.fitted;
        self.rounds.push(Round {
            effects: self.added(fitted),
            identification: errors.identification,
            held_out: errors.held_out,
        });
        self.latest = fitted.clone();
        self.prior_of_latest.clone_from(&self.prior);
        self.evidence = None;
    }

    /// Returns true if the effects of this fit were not fitted together before, and records that
    /// they now are.
    pub fn register_new(&mut self, fitted: &Fitted) -> bool {
        let effects = fitted.effects();
        let is_same = |other: &Vec<Effect>| {
            other.len() == effects.len() && effects.iter().all(|effect| other.contains(effect))
        };
        let is_new = !self.fitted_sets.iter().any(is_same);
        if is_new {
            self.fitted_sets.push(effects);
        }
        is_new
    }
}
