//! How probable each explanation of a residual is: effects, functions whose law nobody knows, several together, or nothing.
//!
//! Every hypothesis is a block of columns in the linear neighbourhood of a fit, with everything fitted projected out. One
//! closed-form marginal likelihood ([`marginal`]) compares sets of them; the prior gives every family the same chance and every
//! further member of a set the odds of one to two and its share of its family. An effect is a law; beside it stands, in the same
//! sum, what knows no law: smooth functions of the same covariates at the same part, functions of two covariates, harmonics whose
//! height and phase change, another value in every pose. So a law is probable only where it is better than what needs none.

mod again;
mod block;
mod columns;
mod explanation;
mod finer;
mod functions;
mod hypotheses;
mod hypothesis;
mod marginal;
mod sag;
mod search;
mod waves;

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use rayon::prelude::*;

use super::covariate::Covariate;
use super::data::Data;
use super::fitted::Fitted;
use super::rules::SelectionRules;
use crate::identify::Noise;
use crate::problem::Effect;
use again::carried_by_one;
pub(super) use again::stability;
use block::Block;
use columns::Candidate;
pub use explanation::Explanation;
pub(super) use functions::Shape;
pub(super) use hypotheses::Hypotheses;
pub use hypothesis::{Hypothesis, Law, Part};
use search::{Target, Weighted, search};
use waves::Waves;

/// Probability below which an explanation is not kept: thousands of them add up to nothing.
const NEGLIGIBLE: f64 = 1e-10;
/// Shapes that are looked at more closely.
const FINEST: usize = 4;

/// All explanations of a residual that were looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Most probable first.
    pub explanations: Vec<Explanation>,
    /// For hypotheses of the sure explanation, effects that do best in their place.
    stand_ins: Vec<(Hypothesis, Hypothesis)>,
    /// Poses without which it was weighed, among those that are: each alone would have carried an effect.
    pub(super) left_out: Vec<usize>,
}

/// What is claimed of a hypothesis, from the least to the most.
#[derive(Debug, Clone, PartialEq)]
pub struct Claims {
    /// Where, and the probability that something acts there.
    pub place: (Part, f64),
    /// On what it depends, and the probability that what acts there depends on that.
    pub depends_on: (Vec<Covariate>, f64),
    /// The hypothesis, and the probability that its law is at work there and no function that knows none.
    pub law: (Hypothesis, f64),
}

impl Evidence {
    /// The most probable explanation.
    pub fn best(&self) -> &[Hypothesis] {
        self.explanations.first().map_or(&[], |best| &best.hypotheses)
    }

    /// Probability that some hypothesis of a kind is at work.
    pub fn probability(&self, of: impl Fn(&Hypothesis) -> bool) -> f64 {
        let holds = |explanation: &&Explanation| explanation.hypotheses.iter().any(&of);
        self.explanations.iter().filter(holds).map(|explanation| explanation.probability).sum::<f64>().min(1.0)
    }

    /// The most probable explanation that claims no more than is sure: with as many hypotheses as there are with probability
    /// `level`, whichever they are.
    pub fn sure(&self, level: f64) -> Option<&Explanation> {
        let as_many = |count: usize| -> f64 {
            let holds = |explanation: &&Explanation| explanation.hypotheses.len() >= count;
            self.explanations.iter().filter(holds).map(|explanation| explanation.probability).sum()
        };
        self.explanations.iter().find(|explanation| as_many(explanation.hypotheses.len()) >= level)
    }

    /// Chance that fewer hypotheses than `best` has and noise make as many as probable, for all that were looked at together: a ratio
    /// of likelihoods is above B no more than once in B times.          [Ville 1939]
    pub fn chance(&self, best: &Explanation) -> f64 {
        let is_fewer = |known: &&Explanation| known.hypotheses.len() < best.hypotheses.len();
        let fewer: f64 = self.explanations.iter().filter(is_fewer).map(|known| known.probability).sum();
        (fewer.max(NEGLIGIBLE) / (1.0 - fewer).max(NEGLIGIBLE)).min(1.0)
    }

    /// Explanations with an effect in the place of another hypothesis of `best`: the most probable ones, and those that do best in the place of
    /// each, which strong effects decide only at a fit of their own; so do laws in the place of a function without one.
    pub(super) fn exchanged(&self, best: &Explanation, most: usize) -> Vec<Explanation> {
        let differ = |one: &Explanation, other: &Explanation| {
            let is_new = |own: &&Hypothesis| !other.hypotheses.iter().any(|known| known.says(own));
            one.hypotheses.iter().filter(is_new).cloned().collect::<Vec<Hypothesis>>()
        };
        let is_exchange = |other: &&Explanation| {
            other.hypotheses.len() == best.hypotheses.len()
                && differ(best, other).len() == 1
                && matches!(differ(other, best).as_slice(), [only] if only.effect().is_some())
        };
        let mut all: Vec<Explanation> = self.explanations.iter().filter(is_exchange).take(most).cloned().collect();
        for (own, other) in &self.stand_ins {
            let Some(place) = best.hypotheses.iter().position(|known| known == own) else { continue };
            let mut exchanged = Explanation { probability: 0.0, ..best.clone() };
            exchanged.hypotheses[place] = other.clone();
            exchanged.functions[place].0 = 0;
            let is_known = |known: &Explanation| known.hypotheses.iter().all(|own| exchanged.hypotheses.contains(own));
            if !all.iter().any(is_known) && !best.hypotheses.contains(other) {
                all.push(exchanged);
            }
        }
        all
    }

    /// The same with other odds for some explanations: ln of those to `best`, each at a fit of its own.
    pub(super) fn corrected(mut self, best: &Explanation, odds: &[(Explanation, f64)]) -> Self {
        let of_best =
            self.explanations.iter().find(|own| own.hypotheses == best.hypotheses).map_or(0.0, |own| own.probability);
        for (explanation, ln_odds) in odds {
            // Beyond that nothing is left of the best one.
            let probability = of_best * ln_odds.min(40.0).exp();
            let is_same = |own: &&mut Explanation| {
                own.hypotheses.len() == explanation.hypotheses.len()
                    && own.hypotheses.iter().all(|known| explanation.hypotheses.contains(known))
            };
            match self.explanations.iter_mut().find(is_same) {
                Some(own) => own.probability = probability,
                None => self.explanations.push(Explanation { probability, ..explanation.clone() }),
            }
        }
        let total: f64 = self.explanations.iter().map(|own| own.probability).sum();
        self.explanations.iter_mut().for_each(|own| own.probability /= total);
        self.explanations.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        self
    }

    /// Effects that may stand in the place of one of an explanation, each as probable without it as the part `beside` of it, best
    /// first.
    pub fn alternatives(&self, effect: &Effect, best: &Explanation, beside: f64) -> Vec<Effect> {
        let others: Vec<Effect> = best.effects().into_iter().filter(|own| own != effect).collect();
        // What an explanation holds beside these; of one that is searched another value stands for it where its own is not there.
        let beside_others = |explanation: &Explanation| {
            let mut rest = explanation.effects();
            for other in &others {
                let exact = rest.iter().position(|known| known == other);
                let place = exact.or_else(|| rest.iter().position(|known| known.is_but_for_search(other)));
                place.map(|place| rest.remove(place));
            }
            rest
        };
        let mut with = 0.0;
        // Each with the value of its argument that was most probable first, for explanations are sorted.
        let mut instead: Vec<(Effect, f64)> = Vec::new();
        for explanation in &self.explanations {
            let rest = beside_others(explanation);
            if rest.iter().any(|known| known.is_but_for_search(effect)) {
                with += explanation.probability;
                continue;
            }
            for other in rest {
                match instead.iter_mut().find(|(known, _)| known.is_but_for_search(&other)) {
                    Some((_, probability)) => *probability += explanation.probability,
                    None => instead.push((other, explanation.probability)),
                }
            }
        }
        if with == 0.0 {
            return Vec::new();
        }
        instead.retain(|(_, probability)| *probability >= with * beside);
        instead.sort_by(|a, b| b.1.total_cmp(&a.1));
        instead.into_iter().map(|(effect, _)| effect).collect()
    }

    /// What is claimed of an effect; `None` where it is in no explanation.
    pub fn claims_of(&self, effect: &Effect) -> Option<Claims> {
        let mut all = self.explanations.iter().flat_map(|explanation| &explanation.hypotheses);
        all.find(|hypothesis| hypothesis.effect() == Some(effect)).map(|hypothesis| self.claims(hypothesis))
    }

    /// What is claimed of a hypothesis.
    ///
    /// Where its time or order is searched, another one counts for it, but not one that is beside it in the most probable explanation.
    pub fn claims(&self, of: &Hypothesis) -> Claims {
        let most = self.explanations.iter().map(|known| &known.hypotheses).find(|known| known.contains(of));
        let is_beside = |other: &Hypothesis| other != of && most.is_some_and(|most| most.contains(other));
        let place = self.probability(|other| other.part == of.part);
        let depends_on = self.probability(|other| other.part == of.part && other.depends_on == of.depends_on);
        let has_law = |explanation: &&Explanation| {
            let unknown = |other: &Hypothesis| other.part == of.part && other.effect().is_none();
            let is_it = |other: &&Hypothesis| other.law.is_of(&of.law) && other.part == of.part;
            explanation.hypotheses.iter().filter(is_it).any(|other| !is_beside(other))
                && (of.effect().is_none() || !explanation.hypotheses.iter().any(unknown))
        };
        let law = self
            .explanations
            .iter()
            .filter(has_law)
            .map(|explanation| explanation.probability)
            .fold(0.0, |sum, own| sum + own)
            .min(1.0);
        Claims { place: (of.part, place), depends_on: (of.depends_on.clone(), depends_on), law: (of.clone(), law) }
    }
}

/// ln of the marginal likelihood and prior of a fit's own explanation: the effects `added` by the search, and functions without a law.
///
/// The fit is linear about its own optimum: sets whose effects are strong are compared by this, each at a fit of its own. A fit divides
/// its residual by a σ of its own; the density is that of the residual over the common `sigma` \[m\], of ν degrees of freedom:
/// ln p(r/σ') = ln p(r/σ) − ν ln (σ/σ').
pub(super) fn ln_posterior(
    fitted: &Fitted,
    data: &Data,
    (added, left_out): (&[Effect], &[usize]),
    (functions, sigma): (&[(Hypothesis, usize)], f64),
) -> Option<f64> {
    let rows = data.weighed();
    let hypotheses = Hypotheses::of(fitted, data, added, &rows, rows.len());
    let is_own = |candidate: &&Candidate| match candidate.hypothesis.effect() {
        Some(effect) => hypotheses.added.contains(effect),
        None => functions.iter().any(|(own, variant)| candidate.variant == *variant && candidate.hypothesis == *own),
    };
    let own: Vec<&Candidate> = hypotheses.all.iter().filter(is_own).collect();
    let (blocks, target) = blocks(fitted, data, &hypotheses, &own, left_out)?;
    Some(search::ln_posterior(&blocks, &target, data.rules)? - target.noise.freedom * (fitted.sigma / sigma).ln())
}

/// The most probable form of a function without a law, beside what the fit holds, and 1 σ of the coefficients of its columns: one of
/// `hypotheses`, smooth where it has no shape.
pub(super) fn best_form(
    fitted: &Fitted,
    data: &Data,
    hypotheses: &Hypotheses,
    best: &Explanation,
    hypothesis: &Hypothesis,
) -> Option<(Option<Shape>, f64)> {
    let smooth = hypotheses.candidate(best, hypothesis)?;
    let weighed = hypotheses.linearised.poses().len();
    let gains = |forms: &[&Candidate]| {
        let (blocks, target) = blocks(fitted, data, hypotheses, forms, &[])?;
        let all: Vec<usize> = (0..blocks.len()).collect();
        let mut gains = search::gains_beside(&[], &all, (&blocks, &target), data.rules);
        gains.sort_by(|a, b| b.1.total_cmp(&a.1));
        Some(gains)
    };
    let mut shapes = Shape::all();
    let coarse = hypotheses.shaped(hypothesis, weighed, &shapes);
    let best_of = |(k, ..): &(usize, f64, f64)| coarse[*k].0.finer();
    if !coarse.is_empty() {
        let found = gains(&coarse.iter().map(|(_, own)| own).collect::<Vec<_>>())?;
        shapes = found.iter().take(FINEST).flat_map(best_of).collect();
    }
    let finer = hypotheses.shaped(hypothesis, weighed, &shapes);
    let forms: Vec<&Candidate> = std::iter::once(smooth).chain(finer.iter().map(|(_, own)| own)).collect();
    // Half of the chance for the smooth function, half for all shapes together.
    let even = |(k, gain, size): (usize, f64, f64)| (k, if k == 0 { gain - smooth.ln_prior } else { gain }, size);
    let (k, _, size) = gains(&forms)?.into_iter().map(even).max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some((k.checked_sub(1).map(|shaped| finer[shaped].0), size))
}

/// Hypotheses and the residual with everything that is fitted projected out, some poses left out; `None` where the residual is not
/// a finite number, or the end was asked for.
fn blocks(
    fitted: &Fitted,
    data: &Data,
    hypotheses: &Hypotheses,
    own: &[&Candidate],
    left_out: &[usize],
) -> Option<(Vec<Block>, Target)> {
    let linearised = hypotheses.linearised.without(left_out);
    let neighbourhood = fitted.neighbourhood_with(&linearised, &hypotheses.unknowns, None);
    if !neighbourhood.residual().iter().all(|value| value.is_finite()) {
        return None;
    }
    let is_declared = fitted.found.noise == Noise::Declared;
    let unless_stopped = |candidate: &&Candidate| {
        (!data.stop.is_requested()).then(|| candidate.block((fitted, &neighbourhood), left_out))
    };
    let mut blocks: Vec<Block> = own.par_iter().map(unless_stopped).collect::<Option<_>>()?;
    let rows = data.weighed();
    let is_aside = |&(pose, row): &(usize, &usize)| !left_out.contains(&pose) && fitted.set_aside.contains(row);
    let numbers = |row: usize| data.measurements.observation(row).coordinates();
    let without_weight = left_out.iter().map(|&pose| numbers(rows[pose])).sum::<usize>()
        + rows.iter().enumerate().filter(is_aside).map(|(_, &row)| numbers(row)).sum::<usize>();
    let noise = marginal::Noise {
        freedom: (neighbourhood.sums().freedom() - without_weight as f64).max(1.0),
        trust: if is_declared { data.rules.trust_declared } else { data.rules.trust_estimated },
        least: if is_declared { -fitted.found.sigma_scale.ln() } else { f64::NEG_INFINITY },
    };
    let target = Target { fit: neighbourhood, noise, stop: data.stop.clone() };
    let is_added = |&k: &usize| own[k].hypothesis.effect().is_some_and(|effect| hypotheses.added.contains(effect));
    let added: Vec<usize> = (0..own.len()).filter(is_added).collect();
    let effects: Vec<&Effect> = added.iter().filter_map(|&k| own[k].hypothesis.effect()).collect();
    let waves = Waves { hypotheses, blocks: &blocks, target: &target, fitted, rules: data.rules, left_out };
    for (k, ln_spread) in waves.spreads(&added, &effects) {
        blocks[k].ln_prior += ln_spread;
    }
    Some((blocks, target))
}

/// Weighs what may explain the residual of a fit, the effects `added` by the search taken out of it again. A pose that alone carries an
/// effect, however well, is left out: one row that is off shows no law.
///
/// `None` where the residual is not a finite number, as that of a pose without equilibrium, or the end was asked for.
pub(super) fn weigh(fitted: &Fitted, data: &Data, added: &[Effect]) -> Option<Evidence> {
    let mut left_out = Vec::new();
    loop {
        let (evidence, hypotheses) = weighed_without(fitted, data, added, &left_out)?;
        match carried_by_one(fitted, data, (&evidence, &hypotheses)) {
            Some(pose) if left_out.len() < data.rules.least_side => left_out.push(pose),
            _ => return Some(evidence),
        }
    }
}

/// The same without some poses, and the hypotheses that were weighed.
fn weighed_without<'a>(
    fitted: &'a Fitted,
    data: &Data<'a>,
    added: &[Effect],
    left_out: &[usize],
) -> Option<(Evidence, Hypotheses<'a>)> {
    let rows = data.weighed();
    let mut hypotheses = Hypotheses::of(fitted, data, added, &rows, rows.len());
    let (mut blocks, target) = blocks(fitted, data, &hypotheses, &hypotheses.all.iter().collect::<Vec<_>>(), left_out)?;
    let is_present = |own: &Candidate| own.hypothesis.effect().is_some_and(|effect| hypotheses.added.contains(effect));
    let present: Vec<usize> = (0..blocks.len()).filter(|&k| is_present(&hypotheses.all[k])).collect();
    let mut explanations: Vec<Explanation> = Vec::new();
    let mut weighted = search(&blocks, &target, data.rules, &present);
    if data.stop.is_requested() {
        return None;
    }
    let (own, rules) = (&hypotheses, data.rules);
    let waves = Waves { hypotheses: own, blocks: &blocks, target: &target, fitted, rules, left_out };
    let waves = waves.promising(&weighted);
    if !waves.is_empty() {
        blocks.extend(waves.iter().map(|wave| wave.block((fitted, &target.fit), left_out)));
        hypotheses.all.extend(waves);
        weighted = search(&blocks, &target, data.rules, &present);
    }
    let block = |own: &Candidate| own.block((fitted, &target.fit), left_out);
    let finer = finer::finer(&hypotheses, &weighted, (&mut blocks, &target), block, (&fitted.problem, data.rules));
    if !finer.is_empty() {
        blocks.extend(finer.iter().map(block));
        hypotheses.all.extend(finer);
        weighted = search(&blocks, &target, data.rules, &present);
    }
    let of = |k: usize| &hypotheses.all[k].hypothesis;
    if data.stop.is_requested() {
        return None;
    }
    // Functions of one covariate that change over other lengths are one hypothesis.
    let (mut numbers, mut distinct): (BTreeMap<usize, usize>, Vec<usize>) = (BTreeMap::new(), Vec::new());
    let mut number = |member: usize| {
        *numbers.entry(member).or_insert_with(|| {
            let known = distinct.iter().position(|&known| of(known).says(of(member)));
            known.unwrap_or_else(|| {
                distinct.push(member);
                distinct.len() - 1
            })
        })
    };
    let mut places: BTreeMap<Vec<usize>, usize> = BTreeMap::new();
    for Weighted { members, sizes, probability } in weighted.into_iter().filter(|set| set.probability > NEGLIGIBLE) {
        let mut own: Vec<usize> = members.iter().map(|&member| number(member)).collect();
        own.sort_unstable();
        match places.entry(own) {
            Entry::Occupied(place) => explanations[*place.get()].probability += probability,
            Entry::Vacant(place) => {
                place.insert(explanations.len());
                let own = members.iter().map(|&member| of(member).clone()).collect();
                let variants = members.into_iter().map(|member| hypotheses.all[member].variant);
                let functions = variants.zip(sizes).collect();
                explanations.push(Explanation { hypotheses: own, probability, functions });
            }
        }
    }
    explanations.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let mut evidence = Evidence { explanations, stand_ins: Vec::new(), left_out: left_out.to_vec() };
    if let Some(best) = evidence.sure(data.rules.sure) {
        evidence.stand_ins = stand_ins(best, &hypotheses, (&blocks, &target), data.rules);
    }
    Some((evidence, hypotheses))
}

/// For each hypothesis of an explanation the few other effects, one of a family at each place, that do best in its place, if at least half as
/// well.
fn stand_ins(
    best: &Explanation,
    hypotheses: &Hypotheses,
    (blocks, target): (&[Block], &Target),
    rules: &SelectionRules,
) -> Vec<(Hypothesis, Hypothesis)> {
    let effect = |k: usize| hypotheses.all[k].hypothesis.effect();
    let tried: Vec<usize> = (0..blocks.len()).filter(|&k| effect(k).is_some()).collect();
    let number = |(own, (variant, _)): (&Hypothesis, &(usize, f64))| {
        hypotheses.all.iter().position(|known| known.variant == *variant && known.hypothesis == *own)
    };
    let members: Vec<usize> = best.hypotheses.iter().zip(&best.functions).filter_map(number).collect();
    let mut all = Vec::new();
    for &own in &members {
        let others: Vec<usize> = members.iter().copied().filter(|&other| other != own).collect();
        let mut gains = search::gains_beside(&others, &tried, (blocks, target), rules);
        let of_own = search::gains_beside(&others, &[own], (blocks, target), rules);
        let least = of_own.first().map_or(f64::INFINITY, |(_, gain, _)| 0.5 * gain);
        gains.retain(|(k, gain, _)| *gain > least && !members.contains(k));
        gains.sort_by(|a, b| b.1.total_cmp(&a.1));
        let name = |k: usize| effect(k).map(Effect::name_and_place).unwrap_or_default();
        let mut known = vec![name(own)];
        for (k, ..) in gains {
            if !known.contains(&name(k)) && known.len() <= rules.stand_ins {
                known.push(name(k));
                all.push((hypotheses.all[own].hypothesis.clone(), hypotheses.all[k].hypothesis.clone()));
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_for_one_effect_is_none_of_the_others_with_it() {
        let shift = |time: f64| Effect::StationShift { at_time: time };
        let drift = || Effect::TrackerDrift;
        let settling = || Effect::TrackerSettling { time_constant: 50.0 };
        let of = |effects: &[Effect], probability: f64| Explanation {
            hypotheses: effects
                .iter()
                .map(|effect| Hypothesis {
                    law: Law::Effect(effect.clone()),
                    part: Part::Measurement,
                    slot: None,
                    depends_on: vec![Covariate::Time],
                })
                .collect(),
            probability,
            functions: vec![(0, 1.0); effects.len()],
        };
        let explanations = vec![
            of(&[shift(10.0), drift()], 0.6),
            of(&[shift(10.0), shift(30.0)], 0.1),
            of(&[shift(31.0), shift(10.0)], 0.1),
            of(&[shift(12.0), drift()], 0.1),
            of(&[settling(), shift(10.0)], 0.1),
        ];
        let best = explanations[0].clone();
        let evidence = Evidence { explanations, stand_ins: Vec::new(), left_out: Vec::new() };
        // Two later moves together are twice as probable as settling.
        assert_eq!(evidence.alternatives(&drift(), &best, 0.1), [shift(30.0), settling()]);
        assert_eq!(evidence.alternatives(&shift(10.0), &best, 0.1), []);
    }

    #[test]
    fn a_wave_is_as_sure_as_it_is_and_not_as_another_beside_it() {
        let wave = |order: f64| Hypothesis {
            law: Law::Effect(Effect::JointWave { joint: 1, order }),
            part: Part::Joint(0),
            slot: None,
            depends_on: vec![Covariate::Command(0)],
        };
        let of = |orders: &[f64], probability: f64| Explanation {
            hypotheses: orders.iter().copied().map(wave).collect(),
            probability,
            functions: vec![(0, 1.0); orders.len()],
        };
        let explanations =
            vec![of(&[6.4, 1.5], 0.5), of(&[6.4], 0.25), of(&[6.41, 1.5], 0.125), of(&[1.6, 6.4], 0.125)];
        let evidence = Evidence { explanations, stand_ins: Vec::new(), left_out: Vec::new() };
        let law = |order: f64| evidence.claims(&wave(order)).law.1;
        // 6.41 stands for 6.4 and 1.6 for 1.5, but neither 6.4 for 1.5 nor the reverse.
        assert!((law(6.4) - 1.0).abs() < 1e-12, "{}", law(6.4));
        assert!((law(1.5) - 0.75).abs() < 1e-12, "{}", law(1.5));
    }
}
