//! Search for waves of non-integer order, such as errors of an inner gear stage. A joint is
//! searched if a probable set contains a function of its command.
//!
//! The possible orders are unbounded and neighbouring ones hardly differ, so no list can contain
//! them. A fine grid of orders is scanned, and the best order in addition to the other members of
//! the set becomes a hypothesis. It represents all orders near it, over which the likelihood is
//! integrated:
//!
//! chance · Σ exp(gain(k) − gain(best)) Δk,
//!
//! where chance is the prior probability of all orders between k and k + 1 together, relative to
//! that of a harmonic. If the data cannot distinguish an order from an integer, the harmonic is
//! therefore more probable.
//!
//! A prismatic joint errs with its screw or rack: sin kq with q in m, of order k = 2π/lead. No
//! other function can describe such a short wave, so it is searched for in addition to every
//! probable set.

use crate::numeric::parallel;
use crate::select::settings::{
    LN_ODDS_OF_ANOTHER_ARGUMENT, MAX_REVISED_SETS, MAX_WAVE_ORDER, MIN_REVISED_PROBABILITY,
};
use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use nalgebra::DMatrix;

use super::candidate::{Candidate, HYPOTHESES_PER_PROJECTION, joint_and_order};
use super::functions::expand;
use super::hypotheses::Hypotheses;
use super::hypothesis::{Hypothesis, HypothesisKind, Site};
use super::products::{Products, ReducedProblem};
use super::search::{EvaluatedSet, reduced_by};
use super::set::sorted;
use crate::model::effect::HIGHEST_ORDER;
use crate::model::parameter::{ParameterSite, are_all_fixed, makes_rule_invalid};
use crate::problem::{Effect, Problem};
use crate::residual_tests::Covariate;
use crate::select::fitted::Fitted;
use crate::select::harmonic_prior::is_periodic_of_many_orders_at;

/// Steps between orders of the first and of the second scan, as phase differences \[rad\] over the
/// joint's range.
const PHASE_STEPS: [f64; 2] = [1.0, 0.02];
/// Number of best orders of the first scan that a finer scan refines.
const MAX_REFINED_ORDERS: usize = 3;
/// Maximum number of orders in a scan. The step between orders is inverse to the joint's range;
/// over more than four turns, the scan therefore ends below the highest order.
const MAX_SCANNED_ORDERS: usize = 8000;
/// Shortest lead of a screw that is searched for \[m\].
const MIN_LEAD: f64 = 0.002;
/// Ratio of successive distances from an order in the grid over which its likelihood is integrated.
const DISTANCE_RATIO: f64 = 1.3;

/// Returns the joint, counted from 0, at which a hypothesis is a function of that joint's command,
/// or a free value in every pose; `None` for others.
fn function_of_command(of: &Hypothesis, problem: &Problem) -> Option<usize> {
    let Site::Joint(joint) = of.site else { return None };
    let at_coordinate = of.coordinate == Some(ParameterSite::coordinate(problem, joint + 1));
    let depends_on_command = match &of.kind {
        HypothesisKind::Effect(Effect::JointHarmonic { .. } | Effect::JointWave { .. }) => true,
        HypothesisKind::Smooth | HypothesisKind::NearHarmonic(_) | HypothesisKind::Gear(_) => {
            at_coordinate && of.depends_on == [Covariate::Command(joint)]
        }
        HypothesisKind::PerPose => at_coordinate,
        _ => false,
    };
    depends_on_command.then_some(joint)
}

/// Returns true if the rules of the problem neither fix nor reject the parameters of an effect.
pub(super) fn is_free(effect: &Effect, problem: &Problem) -> bool {
    let parameters = effect.parameters(problem);
    !are_all_fixed(problem, &parameters) && !makes_rule_invalid(problem, &parameters)
}

/// Returns orders from `low` to `high` in equal steps, at most [`MAX_SCANNED_ORDERS`].
fn equidistant(low: f64, high: f64, step: f64) -> Vec<f64> {
    let orders = std::iter::successors(Some(low), |order| Some(order + step));
    orders.take_while(|order| *order <= high).take(MAX_SCANNED_ORDERS).collect()
}

/// Search for waves of any order at the joints, in addition to the other hypotheses about a fit.
#[derive(Clone, Copy)]
pub(super) struct Waves<'w, 'h, 'a> {
    pub hypotheses: &'w Hypotheses<'h>,
    pub products: &'w Products<'a>,
    pub fitted: &'w Fitted,
    /// Indices of the poses that are left out of the evidence.
    pub left_out: &'w [usize],
}

impl Waves<'_, '_, '_> {
    /// Returns waves of any order, and harmonics of unlisted orders, that may replace functions in
    /// probable sets.
    pub fn promising(&self, evaluated_sets: &[EvaluatedSet]) -> Vec<Candidate> {
        let mut found: Vec<Candidate> = Vec::new();
        for (joint, rests) in self.sets_without_functions(evaluated_sets) {
            // If the fit contains a periodic error of many orders at the joint, its orders need not
            // be searched.
            let effects = &self.fitted.problem.effects;
            if effects
                .iter()
                .any(|declared| is_periodic_of_many_orders_at(&declared.effect, joint + 1))
            {
                continue;
            }
            let Some((low, high)) = self.range(joint) else { continue };
            let (is_prismatic, highest) = (self.is_prismatic(joint), self.highest_order(joint));
            if !is_free(
                &Effect::JointWave { joint: joint + 1, order: highest },
                &self.fitted.problem,
            ) {
                continue;
            }
            let reduced_problems: Vec<ReducedProblem> =
                rests.iter().filter_map(|rest| reduced_by(rest, self.products)).collect();
            let [step, finer] = PHASE_STEPS.map(|phase| phase / (high - low));
            // Orders with less than one cycle over the range of the joint are not searched.
            let first = self.gains(
                joint,
                &equidistant(TAU / (high - low), highest, step),
                &reduced_problems,
            );
            let tens = std::iter::successors(Some(1.0), |digit| Some(digit / 10.0));
            let digits = tens.take_while(|digit| *digit >= 2.0 * finer).count();
            for (left, first) in reduced_problems.iter().zip(first) {
                // A wave that was found for one set represents all orders near its order for every
                // set.
                let listed_effects = || {
                    self.hypotheses
                        .candidates
                        .iter()
                        .chain(&found)
                        .filter_map(|candidate| candidate.hypothesis.effect())
                };
                let listed_orders = listed_effects()
                    .filter_map(joint_and_order)
                    .filter(|(of, _)| *of == joint)
                    .map(|(_, order)| order);
                let listed_orders: Vec<f64> = listed_orders.collect();
                let mut second = listed_orders.clone();
                for (order, _) in first.into_iter().take(MAX_REFINED_ORDERS) {
                    let near = equidistant(order - step, order + step, finer);
                    second.extend(near.into_iter().map(|order| rounded_order(order, digits)));
                    if !is_prismatic {
                        second.extend([order.floor(), order.ceil()]);
                    }
                }
                second.retain(|order| (TAU / (high - low)..=highest).contains(order));
                second.sort_by(f64::total_cmp);
                second.dedup();
                let gains = self.gains(joint, &second, std::slice::from_ref(left)).concat();
                let is_new = |effect: &Effect| listed_effects().all(|listed| listed != effect);
                let new: Vec<Effect> = self
                    .effects_of_best_orders(joint, &gains, &listed_orders)
                    .into_iter()
                    .filter(is_new)
                    .collect();
                for effect in new.into_iter().filter(|effect| is_free(effect, &self.fitted.problem))
                {
                    let width = joint_and_order(&effect)
                        .map_or(1.0, |(_, order)| self.likelihood_width(joint, order, left));
                    let candidate = self.hypotheses.wave_candidate(&effect, &self.fitted.problem);
                    found.extend(candidate.map(|candidate| Candidate {
                        ln_prior: candidate.ln_prior + width.ln(),
                        ..candidate
                    }));
                }
            }
        }
        found
    }

    /// Returns, for each wave among `effects`, its number in `numbers` and ln of the width of its
    /// likelihood \[orders\]. Its prior is multiplied by this width, because it represents all
    /// orders near its order.
    pub fn ln_likelihood_widths(
        &self,
        numbers: &[usize],
        effects: &[&Effect],
    ) -> Vec<(usize, f64)> {
        let ln_width = |(&number, effect): (&usize, &&Effect)| {
            let (joint, order) = joint_and_order(effect)?;
            let others: Vec<usize> =
                numbers.iter().copied().filter(|&other| other != number).collect();
            let reduced = reduced_by(&others, self.products)?;
            Some((number, self.likelihood_width(joint, order, &reduced).ln()))
        };
        numbers.iter().zip(effects).filter_map(ln_width).collect()
    }

    /// Returns true if a joint, counted from 0, is prismatic.
    fn is_prismatic(&self, joint: usize) -> bool {
        self.fitted.problem.joints[joint].takes_length()
    }

    /// Returns the highest order that is searched at a joint: [cycles per revolution], for a
    /// prismatic joint \[rad/m\].
    fn highest_order(&self, joint: usize) -> f64 {
        if self.is_prismatic(joint) { TAU / MIN_LEAD } else { MAX_WAVE_ORDER }
    }

    /// Returns the smallest and largest command of a joint \[rad\] or \[m\]; `None` if the joint
    /// does not move.
    fn range(&self, joint: usize) -> Option<(f64, f64)> {
        self.hypotheses.sampled(&Covariate::Command(joint)).map(|entry| entry.range)
    }

    /// Returns, for each joint (from 0), the sets to which a wave may be added. They are probable
    /// sets without one function of the joint's command, and without all of them; for prismatic
    /// joints also the whole sets.
    fn sets_without_functions(
        &self,
        evaluated_sets: &[EvaluatedSet],
    ) -> BTreeMap<usize, Vec<Vec<usize>>> {
        let mut sets_of_function: BTreeMap<usize, Vec<Vec<usize>>> = BTreeMap::new();
        let candidates = &self.hypotheses.candidates;
        let of = |k: usize| function_of_command(&candidates[k].hypothesis, &self.fitted.problem);
        let mut add = |joint: usize, rest: &[usize]| {
            let (rest, sets) = (sorted(rest), sets_of_function.entry(joint).or_default());
            if !sets.contains(&rest) && sets.len() < MAX_REVISED_SETS {
                sets.push(rest);
            }
        };
        for set in evaluated_sets.iter().filter(|set| set.probability > MIN_REVISED_PROBABILITY) {
            for joint in (0..self.fitted.problem.joints.len()).filter(|&j| self.is_prismatic(j)) {
                add(joint, &set.members);
            }
            for &member in &set.members {
                let Some(joint) = of(member) else { continue };
                add(joint, &set.without(|other| other == member));
                add(joint, &set.without(|other| of(other) == Some(joint)));
            }
        }
        sets_of_function
    }

    /// Returns, for each residual problem, the orders, each with ln of the odds that a wave of that
    /// order acts, best first.
    fn gains(
        &self,
        joint: usize,
        orders: &[f64],
        reduced_problems: &[ReducedProblem],
    ) -> Vec<Vec<(f64, f64)>> {
        let problem = &self.fitted.problem;
        let of = |orders: &[f64]| {
            if self.products.residual_model.stop.is_requested() {
                return Vec::new();
            }
            let wave = |&order: &f64| {
                let effect = Effect::JointWave { joint: joint + 1, order };
                Some((order, self.hypotheses.wave_candidate(&effect, problem)?))
            };
            let (orders, waves): (Vec<f64>, Vec<Candidate>) =
                orders.iter().filter_map(wave).unzip();
            let fit = (self.fitted, &self.products.residual_model.fit);
            let blocks = Candidate::blocks(&waves, fit, self.left_out);
            let of_sets: Vec<Vec<f64>> =
                reduced_problems.iter().map(|left| left.ln_odds_of(&blocks)).collect();
            let odds = |k: usize| of_sets.iter().map(|odds| odds[k]).collect::<Vec<f64>>();
            orders.into_iter().enumerate().map(|(k, order)| (order, odds(k))).collect()
        };
        let odds_of_orders = parallel::map_chunks(orders, HYPOTHESES_PER_PROJECTION, of);
        let of_set = |k: usize| {
            let mut of_orders: Vec<(f64, f64)> =
                odds_of_orders.iter().map(|(order, odds)| (*order, odds[k])).collect();
            of_orders.sort_by(|a, b| b.1.total_cmp(&a.1));
            of_orders
        };
        (0..reduced_problems.len()).map(of_set).collect()
    }

    /// Returns effects for the best orders. `gains` contains orders with ln of their odds, best
    /// first.
    ///
    /// One is the wave with the best non-integer order, unless an order in `listed_orders` is about
    /// as good. The others are the unlisted harmonics that are about as good as the best order.
    fn effects_of_best_orders(
        &self,
        joint: usize,
        gains: &[(f64, f64)],
        listed_orders: &[f64],
    ) -> Vec<Effect> {
        let Some(&(_, most)) = gains.first().filter(|(_, most)| *most > 0.0) else {
            return Vec::new();
        };
        let as_good = || {
            let near =
                gains.iter().take_while(|(_, gain)| *gain > most - LN_ODDS_OF_ANOTHER_ARGUMENT);
            near.map(|(order, _)| *order)
        };
        let (joint, is_prismatic) = (joint + 1, self.is_prismatic(joint));
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a whole number up to the highest"
        )]
        let harmonic = |order: f64| Effect::JointHarmonic { joint, orders: vec![order as u32] };
        let is_whole = |order: f64| !is_prismatic && order.fract() == 0.0;
        let is_beyond = |order: &f64| is_whole(*order) && *order > f64::from(HIGHEST_ORDER);
        let mut effects: Vec<Effect> = as_good().filter(is_beyond).map(harmonic).collect();
        if !as_good().any(|order| listed_orders.contains(&order)) {
            let wave = gains.iter().find(|(order, _)| !is_whole(*order));
            effects.extend(wave.map(|&(order, _)| Effect::JointWave { joint, order }));
        }
        effects
    }

    /// Returns the width of the likelihood about an order \[orders\]: its integral over its
    /// maximum, by the trapezoid rule.
    fn likelihood_width(&self, joint: usize, order: f64, reduced: &ReducedProblem) -> f64 {
        let Some((low, high)) = self.range(joint) else { return 1.0 };
        let range = high - low;
        let away =
            std::iter::successors(Some(PHASE_STEPS[1]), |phase| Some(phase * DISTANCE_RATIO))
                .take_while(|phase| *phase < PI);
        let orders = away.flat_map(|phase| [order - phase / range, order + phase / range]);
        let is_searched = |order: &f64| (TAU / range..=self.highest_order(joint)).contains(order);
        let mut orders: Vec<f64> = orders.filter(is_searched).chain([order]).collect();
        orders.sort_by(f64::total_cmp);
        let mut gains = self.gains(joint, &orders, std::slice::from_ref(reduced)).concat();
        gains.sort_by(|a, b| a.0.total_cmp(&b.0));
        let reference = gains
            .iter()
            .find(|(reference, _)| reference.total_cmp(&order).is_eq())
            .map_or(0.0, |(_, gain)| *gain);
        let weight = |gain: f64| (gain - reference).min(0.0).exp();
        let between = |pair: &[(f64, f64)]| {
            0.5 * (weight(pair[0].1) + weight(pair[1].1)) * (pair[1].0 - pair[0].0)
        };
        // If the likelihood is zero at both neighbours, its width is taken as one step.
        gains.windows(2).map(between).sum::<f64>().max(PHASE_STEPS[1] / range)
    }
}

/// Rounds an order to a number of decimals.
fn rounded_order(order: f64, digits: usize) -> f64 {
    format!("{order:.digits$}").parse().unwrap_or(order)
}

impl Hypotheses<'_> {
    /// Returns the candidate for an effect that is a wave of its joint's command, with its columns;
    /// `None` if the effect is no such wave, or the command does not vary.
    fn wave_candidate(&self, effect: &Effect, problem: &Problem) -> Option<Candidate> {
        let (joint, order) = match effect {
            Effect::JointHarmonic { joint, orders } => (joint - 1, f64::from(*orders.first()?)),
            other => joint_and_order(other)?,
        };
        let command = self.sampled(&Covariate::Command(joint))?;
        let at = self.linearised.column_at(ParameterSite::coordinate(problem, joint + 1))?;
        let waves = DMatrix::from_fn(command.values.len(), 2, |row, k| {
            let (sin, cos) = (order * command.values[row]).sin_cos();
            if k == 0 { sin } else { cos }
        });
        self.candidate_of_effect(effect, expand(&[&at], &waves), problem)
    }
}
