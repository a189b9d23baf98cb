//! Waves whose order is no whole number, as of a stage of a gear: looked for where an explanation holds a function of a joint's own
//! command, at that joint.
//!
//! Orders have no end and neighbours hardly differ, so that no list holds them: along a fine row of orders the one that does best beside
//! the rest of such an explanation becomes a hypothesis like all others. One that the data cannot tell from a whole number is the harmonic of
//! that order.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use nalgebra::DMatrix;
use rayon::prelude::*;

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
/// Explanations whose functions waves of a joint may stand for, the most probable ones.
const MOST: usize = 6;
/// Steps between orders, as phases \[rad\] from one end of the joint's range to the other: of the first look, and of the second one.
const STEPS: [f64; 2] = [0.5, 0.02];
/// Orders of the first look about which there is a second.
const LOOKED_AT: usize = 3;
/// Orders that a row has at most: of a joint of many turns the highest are not looked for.
const MOST_ORDERS: usize = 4000;
/// Orders whose columns are kept at once.
const TOGETHER: usize = 256;

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

/// For joints, from 0, the sets in which a wave may stand: explanations without one function of the joint's command, and without any.
fn places(hypotheses: &Hypotheses, weighted: &[Weighted], problem: &Problem) -> BTreeMap<usize, Vec<Vec<usize>>> {
    let mut all: BTreeMap<usize, Vec<Vec<usize>>> = BTreeMap::new();
    let of = |member: usize| own_function(&hypotheses.all[member].hypothesis, problem);
    for set in weighted.iter().filter(|set| set.probability > WORTH_A_LOOK) {
        for &member in &set.members {
            let Some(joint) = of(member) else { continue };
            let without = |gone: &dyn Fn(usize) -> bool| -> Vec<usize> {
                let mut rest: Vec<usize> = set.members.iter().copied().filter(|&other| !gone(other)).collect();
                rest.sort_unstable();
                rest
            };
            let own = all.entry(joint).or_default();
            for rest in [without(&|other| other == member), without(&|other| of(other) == Some(joint))] {
                if !own.contains(&rest) && own.len() < MOST {
                    own.push(rest);
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

/// Orders from `low` to `high` in steps, so many at most.
fn row(low: f64, high: f64, step: f64) -> Vec<f64> {
    let all = std::iter::successors(Some(low), |order| Some(order + step));
    all.take_while(|order| *order <= high).take(MOST_ORDERS).collect()
}

/// Waves of any order that do better than those known in the place of functions of `weighted` explanations.
pub(super) fn promising(
    hypotheses: &Hypotheses,
    weighted: &[Weighted],
    (blocks, target): (&mut Vec<Block>, &Target),
    block: impl Fn(&Candidate) -> Block + Sync,
    (problem, rules): (&Problem, &SelectionRules),
) -> Vec<Candidate> {
    let known = blocks.len();
    let mut found: Vec<Candidate> = Vec::new();
    for (joint, rests) in places(hypotheses, weighted, problem) {
        let Some((low, high)) = hypotheses.known(&Covariate::Command(joint)).map(|own| own.range) else { continue };
        if !is_free(&Effect::JointWave { joint: joint + 1, order: rules.wave_orders }, problem) {
            continue;
        }
        // For each of the sets the orders, best first, with ln of their odds to the set alone.
        let mut tried = |orders: &[f64], rests: &[Vec<usize>]| {
            let mut gains: Vec<Vec<(f64, f64)>> = vec![Vec::new(); rests.len()];
            for some in orders.chunks(TOGETHER).take_while(|_| !target.stop.is_requested()) {
                let wave = |&order: &f64| {
                    let effect = Effect::JointWave { joint: joint + 1, order };
                    Some((order, block(&hypotheses.wave(&effect, order, problem, rules)?)))
                };
                let (orders, waves): (Vec<f64>, Vec<Block>) = some.par_iter().filter_map(wave).unzip();
                blocks.extend(waves);
                let all: Vec<usize> = (known..blocks.len()).collect();
                for (rest, own) in rests.iter().zip(&mut gains) {
                    let of = gains_beside(rest, &all, (blocks, target), rules);
                    own.extend(of.into_iter().map(|(k, gain, _)| (orders[k - known], gain)));
                }
                blocks.truncate(known);
            }
            for own in &mut gains {
                own.sort_by(|a, b| b.1.total_cmp(&a.1));
            }
            gains
        };
        let [step, finer] = STEPS.map(|phase| phase / (high - low));
        // A wave of which less than one cycle is seen is none.
        let first = tried(&row(TAU / (high - low), rules.wave_orders, step), &rests);
        let tens = std::iter::successors(Some(1.0), |digit| Some(digit / 10.0));
        let digits = tens.take_while(|digit| *digit >= 2.0 * finer).count();
        let taken = hypotheses.orders(joint);
        for (rest, first) in rests.iter().zip(first) {
            let mut second = taken.clone();
            for (order, _) in first.into_iter().take(LOOKED_AT) {
                let near = row(order - step, order + step, finer);
                second.extend(near.into_iter().map(|order| written(order, digits)));
                second.extend([order.floor(), order.ceil()]);
            }
            second.retain(|order| *order > 0.0);
            second.sort_by(f64::total_cmp);
            second.dedup();
            let gains = tried(&second, std::slice::from_ref(rest)).concat();
            let Some((effect, order)) = another(joint, &gains, &taken, rules) else { continue };
            if is_free(&effect, problem) && !found.iter().any(|known| known.hypothesis.effect() == Some(&effect)) {
                found.extend(hypotheses.wave(&effect, order, problem, rules));
            }
        }
    }
    found
}

/// The wave of orders, best first, with ln of their odds, that is neither known already nor a whole number that is listed: of a whole number
/// that does as well it is the harmonic.
fn another(joint: usize, gains: &[(f64, f64)], taken: &[f64], rules: &SelectionRules) -> Option<(Effect, f64)> {
    let &(best, most) = gains.first().filter(|(_, most)| *most > rules.another_order)?;
    let as_good = || gains.iter().take_while(|(_, gain)| *gain > most - rules.another_order).map(|(order, _)| *order);
    if as_good().any(|order| taken.contains(&order)) {
        return None;
    }
    let joint = joint + 1;
    match as_good().find(|order| order.fract() == 0.0) {
        Some(order) if order <= f64::from(rules.near_orders) => None,
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a whole number up to the highest")]
        Some(order) => Some((Effect::JointHarmonic { joint, orders: vec![order as u32] }, order)),
        None => Some((Effect::JointWave { joint, order: best }, best)),
    }
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
