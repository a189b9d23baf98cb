//! Waves whose order is no whole number, as of a stage of a gear: looked for where an explanation
//! holds a function of a joint's own command, at that joint.
//!
//! Orders have no end and neighbours hardly differ, so that no list holds them: along a fine row of
//! orders the one that does best beside the rest of such an explanation becomes a hypothesis like
//! all others. It stands for every order about it, integrated out:
//!
//! chance · Σ exp(gain(k) − gain(best)) Δk,
//!
//! with the chance of all orders in a unit together, that harmonics are beside it. So where data
//! cannot tell an order from a whole number the harmonic is the more probable one, by as much as it
//! is the more common and no surer.
//!
//! A joint that slides errs with its screw or rack: sin kq with q in m, of order k = 2π/lead. So
//! short a wave looks like noise to every function that another hypothesis could be, so that it is
//! looked for beside every explanation.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::candidate::{Candidate, TOGETHER, order_of};
use super::functions::times;
use super::hypotheses::Hypotheses;
use super::hypothesis::{Hypothesis, HypothesisKind, Site};
use super::products::{Left, Products};
use super::search::{Weighted, left_by};
use crate::model::effect::HIGHEST_ORDER;
use crate::model::parameter::{ParameterSite, holds_all, refuses};
use crate::problem::{Effect, JointKind, Problem};
use crate::residual_tests::Covariate;
use crate::select::fitted::Fitted;
use crate::select::rules::SelectionRules;

/// Probability of an explanation from which on waves are looked for in the place of its functions.
const WORTH_A_LOOK: f64 = 0.01;
/// Explanations whose functions waves of a joint may stand for, the most probable ones.
const MOST: usize = 6;
/// Steps between orders, as phases \[rad\] from one end of the joint's range to the other: of the
/// first look, and of the second one.
const STEPS: [f64; 2] = [1.0, 0.02];
/// Orders of the first look about which there is a second.
const LOOKED_AT: usize = 3;
/// Orders that a row has at most: of a joint that turns four times and more in the data the highest
/// are not looked for.
const MOST_ORDERS: usize = 8000;
/// The shortest lead of a screw that is looked for \[m\].
const SHORTEST_LEAD: f64 = 0.002;
/// Of orders further and further from one over which its likelihood is integrated, each step over
/// that before it.
const WIDER: f64 = 1.3;

/// The joint, from 0, at which a hypothesis is a function of that joint's own command, or of
/// nothing that is known.
fn own_function(of: &Hypothesis, problem: &Problem) -> Option<usize> {
    let Site::Joint(joint) = of.site else { return None };
    let at_coordinate = of.coordinate == Some(ParameterSite::coordinate(problem, joint + 1));
    let is_own = match &of.kind {
        HypothesisKind::Effect(Effect::JointHarmonic { .. } | Effect::JointWave { .. }) => true,
        HypothesisKind::Smooth | HypothesisKind::NearHarmonic(_) => {
            at_coordinate && of.depends_on == [Covariate::Command(joint)]
        }
        HypothesisKind::PerPose => at_coordinate,
        _ => false,
    };
    is_own.then_some(joint)
}

/// Whether the rules of the problem let an effect be looked for.
pub(super) fn is_free(effect: &Effect, problem: &Problem) -> bool {
    let parameters = effect.parameters(problem);
    !holds_all(problem, &parameters) && !refuses(problem, &parameters)
}

/// Orders from `low` to `high` in steps, so many at most.
fn row(low: f64, high: f64, step: f64) -> Vec<f64> {
    let all = std::iter::successors(Some(low), |order| Some(order + step));
    all.take_while(|order| *order <= high).take(MOST_ORDERS).collect()
}

/// Waves of any order beside the other hypotheses about what a fit leaves.
#[derive(Clone, Copy)]
pub(super) struct Waves<'w, 'h, 'a> {
    pub hypotheses: &'w Hypotheses<'h>,
    pub products: &'w Products<'a>,
    pub fitted: &'w Fitted,
    /// Poses that are left out.
    pub left_out: &'w [usize],
}

impl<'w, 'a> Waves<'w, '_, 'a> {
    /// Waves of any order, and harmonics of orders that no list has, that may stand in the place of
    /// functions of `weighted` explanations.
    pub fn promising(&self, weighted: &[Weighted]) -> Vec<Candidate> {
        let mut found: Vec<Candidate> = Vec::new();
        for (joint, rests) in self.places(weighted) {
            let Some((low, high)) = self.range(joint) else { continue };
            let (slides, highest) = (self.slides(joint), self.highest(joint));
            if !is_free(
                &Effect::JointWave { joint: joint + 1, order: highest },
                &self.fitted.problem,
            ) {
                continue;
            }
            let left: Vec<Left> = rests.iter().filter_map(|rest| self.beside(rest)).collect();
            let [step, finer] = STEPS.map(|phase| phase / (high - low));
            // A wave of which less than one cycle is seen is none.
            let first = self.gains(joint, &row(TAU / (high - low), highest, step), &left);
            let tens = std::iter::successors(Some(1.0), |digit| Some(digit / 10.0));
            let digits = tens.take_while(|digit| *digit >= 2.0 * finer).count();
            for (left, first) in left.iter().zip(first) {
                // One wave stands for all orders about it, whatever explanation it was found in.
                let known = || {
                    self.hypotheses
                        .all
                        .iter()
                        .chain(&found)
                        .filter_map(|own| own.hypothesis.effect())
                };
                let taken = known()
                    .filter_map(order_of)
                    .filter(|(own, _)| *own == joint)
                    .map(|(_, order)| order);
                let taken: Vec<f64> = taken.collect();
                let mut second = taken.clone();
                for (order, _) in first.into_iter().take(LOOKED_AT) {
                    let near = row(order - step, order + step, finer);
                    second.extend(near.into_iter().map(|order| written(order, digits)));
                    if !slides {
                        second.extend([order.floor(), order.ceil()]);
                    }
                }
                second.retain(|order| (TAU / (high - low)..=highest).contains(order));
                second.sort_by(f64::total_cmp);
                second.dedup();
                let gains = self.gains(joint, &second, std::slice::from_ref(left)).concat();
                let is_new = |effect: &Effect| known().all(|known| known != effect);
                let new: Vec<Effect> =
                    self.another(joint, &gains, &taken).into_iter().filter(is_new).collect();
                for effect in new.into_iter().filter(|effect| is_free(effect, &self.fitted.problem))
                {
                    let spread =
                        order_of(&effect).map_or(1.0, |(_, order)| self.spread(joint, order, left));
                    let candidate = self
                        .hypotheses
                        .function_of(&effect, (&self.fitted.problem, self.products.rules));
                    found.extend(
                        candidate
                            .map(|own| Candidate { ln_prior: own.ln_prior + spread.ln(), ..own }),
                    );
                }
            }
        }
        found
    }

    /// ln of what the chance of a wave gains as it stands for every order about its own, for those
    /// of some hypotheses, by number, beside the others of them.
    pub fn spreads(&self, numbers: &[usize], effects: &[&Effect]) -> Vec<(usize, f64)> {
        let one = |(&number, effect): (&usize, &&Effect)| {
            let (joint, order) = order_of(effect)?;
            let rest: Vec<usize> =
                numbers.iter().copied().filter(|&other| other != number).collect();
            Some((number, self.spread(joint, order, &self.beside(&rest)?).ln()))
        };
        numbers.iter().zip(effects).filter_map(one).collect()
    }

    /// What some hypotheses leave.
    fn beside(&self, rest: &[usize]) -> Option<Left<'w, 'a>> {
        left_by(rest, self.products)
    }

    /// Whether a joint slides.
    fn slides(&self, joint: usize) -> bool {
        self.fitted.problem.joints[joint].command_kind() == JointKind::Prismatic
    }

    /// The highest order of a wave of a joint that is looked for; of one that slides \[rad/m\].
    fn highest(&self, joint: usize) -> f64 {
        if self.slides(joint) { TAU / SHORTEST_LEAD } else { self.products.rules.wave_orders }
    }

    /// Least and greatest command of a joint \[rad\], \[m\].
    fn range(&self, joint: usize) -> Option<(f64, f64)> {
        self.hypotheses.known(&Covariate::Command(joint)).map(|own| own.range)
    }

    /// For joints, from 0, the sets in which a wave may stand: explanations without one function of
    /// the joint's command, and without any; of joints that slide each explanation, too.
    fn places(&self, weighted: &[Weighted]) -> BTreeMap<usize, Vec<Vec<usize>>> {
        let mut all: BTreeMap<usize, Vec<Vec<usize>>> = BTreeMap::new();
        let of = |member: usize| {
            own_function(&self.hypotheses.all[member].hypothesis, &self.fitted.problem)
        };
        let sliding: Vec<usize> =
            (0..self.fitted.problem.joints.len()).filter(|&joint| self.slides(joint)).collect();
        for set in weighted.iter().filter(|set| set.probability > WORTH_A_LOOK) {
            let mut whole = set.members.clone();
            whole.sort_unstable();
            for &joint in &sliding {
                let own = all.entry(joint).or_default();
                if !own.contains(&whole) && own.len() < MOST {
                    own.push(whole.clone());
                }
            }
            for &member in &set.members {
                let Some(joint) = of(member) else { continue };
                let without = |gone: &dyn Fn(usize) -> bool| -> Vec<usize> {
                    let mut rest: Vec<usize> =
                        set.members.iter().copied().filter(|&other| !gone(other)).collect();
                    rest.sort_unstable();
                    rest
                };
                let own = all.entry(joint).or_default();
                for rest in
                    [without(&|other| other == member), without(&|other| of(other) == Some(joint))]
                {
                    if !own.contains(&rest) && own.len() < MOST {
                        own.push(rest);
                    }
                }
            }
        }
        all
    }

    /// For what each of some sets leaves the orders, best first, with ln of the odds of such a wave
    /// to the set alone.
    fn gains(&self, joint: usize, orders: &[f64], left: &[Left]) -> Vec<Vec<(f64, f64)>> {
        let how = (&self.fitted.problem, self.products.rules);
        let of = |orders: &[f64]| {
            if self.products.target.stop.is_requested() {
                return Vec::new();
            }
            let wave = |&order: &f64| {
                Some((
                    order,
                    self.hypotheses
                        .function_of(&Effect::JointWave { joint: joint + 1, order }, how)?,
                ))
            };
            let (orders, waves): (Vec<f64>, Vec<Candidate>) =
                orders.iter().filter_map(wave).unzip();
            let fit = (self.fitted, &self.products.target.fit);
            let blocks = Candidate::blocks(&waves.iter().collect::<Vec<_>>(), fit, self.left_out);
            let of_sets: Vec<Vec<f64>> = left.iter().map(|left| left.odds_of(&blocks)).collect();
            let odds = |k: usize| of_sets.iter().map(|own| own[k]).collect();
            orders.into_iter().enumerate().map(|(k, order)| (order, odds(k))).collect()
        };
        let all: Vec<(f64, Vec<f64>)> = orders.par_chunks(TOGETHER).flat_map_iter(of).collect();
        let of_set = |k: usize| {
            let mut own: Vec<(f64, f64)> =
                all.iter().map(|(order, odds)| (*order, odds[k])).collect();
            own.sort_by(|a, b| b.1.total_cmp(&a.1));
            own
        };
        (0..left.len()).map(of_set).collect()
    }

    /// Of orders, best first, with ln of their odds: the best that is no whole number, unless one
    /// does as well that was taken before; and harmonics beyond those that are listed, where they
    /// do as well as the best.
    fn another(&self, joint: usize, gains: &[(f64, f64)], taken: &[f64]) -> Vec<Effect> {
        let Some(&(_, most)) = gains.first().filter(|(_, most)| *most > 0.0) else {
            return Vec::new();
        };
        let as_good = || {
            let near = gains
                .iter()
                .take_while(|(_, gain)| *gain > most - self.products.rules.another_order);
            near.map(|(order, _)| *order)
        };
        let (joint, slides) = (joint + 1, self.slides(joint));
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a whole number up to the highest"
        )]
        let harmonic = |order: f64| Effect::JointHarmonic { joint, orders: vec![order as u32] };
        let is_whole = |order: f64| !slides && order.fract() == 0.0;
        let is_beyond = |order: &f64| is_whole(*order) && *order > f64::from(HIGHEST_ORDER);
        let mut all: Vec<Effect> = as_good().filter(is_beyond).map(harmonic).collect();
        if !as_good().any(|order| taken.contains(&order)) {
            let wave = gains.iter().find(|(order, _)| !is_whole(*order));
            all.extend(wave.map(|&(order, _)| Effect::JointWave { joint, order }));
        }
        all
    }

    /// Orders about one, in units of orders, each by how well it does beside it: by the trapezoid
    /// rule, none more than it.
    fn spread(&self, joint: usize, order: f64, left: &Left) -> f64 {
        let Some((low, high)) = self.range(joint) else { return 1.0 };
        let range = high - low;
        let away = std::iter::successors(Some(STEPS[1]), |phase| Some(phase * WIDER))
            .take_while(|phase| *phase < PI);
        let orders = away.flat_map(|phase| [order - phase / range, order + phase / range]);
        let is_looked_for = |order: &f64| (TAU / range..=self.highest(joint)).contains(order);
        let mut orders: Vec<f64> = orders.filter(is_looked_for).chain([order]).collect();
        orders.sort_by(f64::total_cmp);
        let mut gains = self.gains(joint, &orders, std::slice::from_ref(left)).concat();
        gains.sort_by(|a, b| a.0.total_cmp(&b.0));
        let own = gains
            .iter()
            .find(|(own, _)| own.total_cmp(&order).is_eq())
            .map_or(0.0, |(_, gain)| *gain);
        let weight = |gain: f64| (gain - own).min(0.0).exp();
        let between = |pair: &[(f64, f64)]| {
            0.5 * (weight(pair[0].1) + weight(pair[1].1)) * (pair[1].0 - pair[0].0)
        };
        // An order that no neighbour comes near is told to a step.
        gains.windows(2).map(between).sum::<f64>().max(STEPS[1] / range)
    }
}

/// As written with so many digits, not as a product has it.
fn written(order: f64, digits: usize) -> f64 {
    format!("{order:.digits$}").parse().unwrap_or(order)
}

impl Hypotheses<'_> {
    /// The hypothesis of an effect that is a wave of the command of its joint.
    fn function_of(&self, effect: &Effect, how: (&Problem, &SelectionRules)) -> Option<Candidate> {
        let (joint, order) = match effect {
            Effect::JointHarmonic { joint, orders } => (joint - 1, f64::from(*orders.first()?)),
            other => order_of(other)?,
        };
        let known = self.known(&Covariate::Command(joint))?;
        let at = self.linearised.place(ParameterSite::coordinate(how.0, joint + 1))?;
        let waves = DMatrix::from_fn(known.values.len(), 2, |row, k| {
            let (sin, cos) = (order * known.values[row]).sin_cos();
            if k == 0 { sin } else { cos }
        });
        self.entered(effect, times(&[&at], &waves), how)
    }
}
