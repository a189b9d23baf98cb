//! Waves whose order is no whole number, as of a stage of a gear: looked for where an explanation holds a function of a joint's own
//! command, at that joint.
//!
//! Orders have no end and neighbours hardly differ, so that no list holds them: along a fine row of orders the one that does best beside
//! the rest of such an explanation becomes a hypothesis like all others. One that the data cannot tell from a whole number is the harmonic of
//! that order.

use std::f64::consts::TAU;

use nalgebra::DMatrix;

use super::block::{Block, Design};
use super::columns::{Candidate, even, turning};
use super::functions::times;
use super::hypotheses::Hypotheses;
use super::hypothesis::{Hypothesis, Law, Part};
use super::marginal::Coefficients;
use super::search::{Target, Weighted, gains_beside};
use crate::diagnose::covariate::Covariate;
use crate::diagnose::rules::SelectionRules;
use crate::model::parameter::{JointField, Slot, holds_all, refuses};
use crate::problem::{Effect, JointKind, Problem};

/// Probability of an explanation from which on waves are looked for in the place of its functions.
const WORTH_A_LOOK: f64 = 0.01;
/// Explanations whose functions waves may stand for, the most probable ones.
const MOST: usize = 12;
/// Steps between orders, as phases \[rad\] from one end of the joint's range to the other: of the first look, and of the second one.
const STEPS: [f64; 2] = [0.5, 0.02];
/// Orders of the first look about which there is a second.
const LOOKED_AT: usize = 3;

/// The joint, from 0, at which a hypothesis is a function of that joint's own command, or of nothing that is known.
fn own_function(of: &Hypothesis, problem: &Problem) -> Option<usize> {
    let Part::Joint(joint) = of.part else { return None };
    let turns = problem.joints[joint].commanded() == JointKind::Revolute;
    let at_coordinate = of.slot == Some(Slot::Joint { joint, field: JointField::Theta });
    let is_own = match &of.law {
        Law::Effect(Effect::JointHarmonic { .. } | Effect::JointWave { .. }) => true,
        Law::Smooth | Law::NearHarmonic(_) => at_coordinate && of.depends_on == [Covariate::Command(joint)],
        Law::PerPose => at_coordinate,
        _ => false,
    };
    (turns && is_own).then_some(joint)
}

/// Sets in which a wave of a joint may stand: explanations without one function of that joint's command, and without any.
fn places(hypotheses: &Hypotheses, weighted: &[Weighted], problem: &Problem) -> Vec<(usize, Vec<usize>)> {
    let mut all: Vec<(usize, Vec<usize>)> = Vec::new();
    let of = |member: usize| own_function(&hypotheses.all[member].hypothesis, problem);
    for set in weighted.iter().filter(|set| set.probability > WORTH_A_LOOK) {
        for &member in &set.members {
            let Some(joint) = of(member) else { continue };
            let without = |gone: &dyn Fn(usize) -> bool| -> Vec<usize> {
                let mut rest: Vec<usize> = set.members.iter().copied().filter(|&other| !gone(other)).collect();
                rest.sort_unstable();
                rest
            };
            for rest in [without(&|other| other == member), without(&|other| of(other) == Some(joint))] {
                if !all.contains(&(joint, rest.clone())) && all.len() < MOST {
                    all.push((joint, rest));
                }
            }
        }
    }
    all
}

/// Whether the rules of the problem let an effect be looked for.
fn is_free(effect: &Effect, problem: &Problem) -> bool {
    let parameters = effect.parameters(problem);
    !holds_all(problem, &parameters) && !refuses(problem, &parameters)
}

/// Orders from `low` to `high` in steps.
fn row(low: f64, high: f64, step: f64) -> Vec<f64> {
    std::iter::successors(Some(low), |order| Some(order + step)).take_while(|order| *order <= high).collect()
}

/// Waves of any order that do better than those known in the place of functions of `weighted` explanations.
pub(super) fn promising(
    hypotheses: &Hypotheses,
    weighted: &[Weighted],
    (blocks, target): (&mut Vec<Block>, &Target),
    block: impl Fn(&Candidate) -> Block,
    (problem, rules): (&Problem, &SelectionRules),
) -> Vec<Candidate> {
    let known = blocks.len();
    let mut found: Vec<Candidate> = Vec::new();
    for (joint, rest) in places(hypotheses, weighted, problem) {
        let Some((low, high)) = hypotheses.known(&Covariate::Command(joint)).map(|own| own.range) else { continue };
        if !is_free(&Effect::JointWave { joint: joint + 1, order: rules.wave_orders }, problem) {
            continue;
        }
        // Best first, with ln of the odds to the rest alone.
        let mut tried = |orders: &[f64]| {
            let waves = orders.iter().filter_map(|&order| {
                let effect = Effect::JointWave { joint: joint + 1, order };
                Some((order, hypotheses.wave(&effect, order, problem, rules)?))
            });
            let (orders, waves): (Vec<f64>, Vec<Candidate>) = waves.unzip();
            blocks.extend(waves.iter().map(&block));
            let all: Vec<usize> = (known..blocks.len()).collect();
            let gains = gains_beside(&rest, &all, (blocks, target), rules);
            blocks.truncate(known);
            let mut gains: Vec<(f64, f64)> = gains.into_iter().map(|(k, gain, _)| (orders[k - known], gain)).collect();
            gains.sort_by(|a, b| b.1.total_cmp(&a.1));
            gains
        };
        let [step, finer] = STEPS.map(|phase| phase / (high - low));
        // A wave of which less than one cycle is seen is none.
        let first = tried(&row(TAU / (high - low), rules.wave_orders, step));
        let tens = std::iter::successors(Some(1.0), |digit| Some(digit / 10.0));
        let digits = tens.take_while(|digit| *digit >= 2.0 * finer).count();
        let taken = hypotheses.orders(joint);
        let mut second = taken.clone();
        for (order, _) in first.into_iter().take(LOOKED_AT) {
            second.extend(row(order - step, order + step, finer).into_iter().map(|order| written(order, digits)));
            second.extend([order.floor(), order.ceil()]);
        }
        second.retain(|order| *order > 0.0);
        second.sort_by(f64::total_cmp);
        second.dedup();
        let gains = tried(&second);
        let Some(&(best, most)) = gains.first() else { continue };
        // What is known already, or is a whole number, unless another order does much better.
        let alike = |of: &dyn Fn(f64) -> bool| {
            gains
                .iter()
                .take_while(|(_, gain)| *gain > most - rules.another_order)
                .map(|(order, _)| *order)
                .find(|order| of(*order))
        };
        let whole = alike(&|order| order.fract() == 0.0);
        let is_listed = |order: f64| order <= f64::from(rules.near_orders) || taken.contains(&order);
        if most <= rules.another_order
            || alike(&|order| taken.contains(&order)).is_some()
            || whole.is_some_and(is_listed)
        {
            continue;
        }
        let effect = match whole {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a whole number up to the highest"
            )]
            Some(order) => Effect::JointHarmonic { joint: joint + 1, orders: vec![order as u32] },
            None => Effect::JointWave { joint: joint + 1, order: best },
        };
        if is_free(&effect, problem) && !found.iter().any(|known| known.hypothesis.effect() == Some(&effect)) {
            found.extend(hypotheses.wave(&effect, whole.unwrap_or(best), problem, rules));
        }
    }
    found
}

/// As written with so many digits, not as a product has it.
fn written(order: f64, digits: usize) -> f64 {
    format!("{order:.digits$}").parse().unwrap_or(order)
}

impl Hypotheses<'_> {
    /// Orders of the waves of a joint, counted from 0, that were taken before.
    fn orders(&self, joint: usize) -> Vec<f64> {
        let orders = |effect: &Effect| match effect {
            Effect::JointWave { joint: own, order } if *own == joint + 1 => vec![*order],
            Effect::JointHarmonic { joint: own, orders } if *own == joint + 1 => {
                orders.iter().copied().map(f64::from).collect()
            }
            _ => Vec::new(),
        };
        self.added.iter().flat_map(orders).collect()
    }

    /// The hypothesis of an effect that is a wave of an order.
    fn wave(&self, effect: &Effect, order: f64, problem: &Problem, rules: &SelectionRules) -> Option<Candidate> {
        let (joint, _) = effect.function_of()?;
        let joint = joint - 1;
        let known = self.known(&Covariate::Command(joint))?;
        let at = self.linearised.place(Slot::Joint { joint, field: JointField::Theta })?;
        let waves = DMatrix::from_fn(known.values.len(), 2, |row, k| {
            let (sin, cos) = (order * known.values[row]).sin_cos();
            if k == 0 { sin } else { cos }
        });
        let (columns, largest) = even(times(&[&at], &waves), &effect.terms(problem), self.weighed, rules);
        let design = Design::Dense(columns).scaled(self.weighed)?;
        let coefficients = Coefficients { largest, ..Coefficients::default() };
        let ln_prior = self.ln_family - (effect.tries(&[]) * turning(problem)).ln();
        let hypothesis = Hypothesis::of_effect(effect, problem, true, true);
        Some(Candidate { hypothesis, variant: 0, design, ln_prior, coefficients })
    }
}
