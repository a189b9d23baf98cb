//! Probabilities of all sets of hypotheses, and the claims that follow.

use super::families::OtherHypotheses;
use super::hypothesis::{Hypothesis, HypothesisKind, HypothesisSet, Site};
use super::sites::tool_joint;
use crate::problem::{Effect, Problem};
use crate::residual_tests::Covariate;

/// Smallest probability of a set that is kept. Even thousands of less probable sets are negligible
/// together.
pub(super) const MIN_KEPT_PROBABILITY: f64 = 1e-10;
/// All sets of hypotheses that were evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// Sets, the most probable first.
    pub sets: Vec<HypothesisSet>,
    /// Pairs of a member of the accepted set and an effect that may replace it.
    pub(super) stand_ins: Vec<(Hypothesis, Hypothesis)>,
    /// Indices of the poses that were left out of the evidence, because each alone supported an
    /// effect.
    pub(in crate::select) left_out: Vec<usize>,
    /// Properties of the other hypotheses on which the prior probability of an effect depends.
    pub(super) others: OtherHypotheses,
}

/// Claims about a hypothesis with their probabilities, from the weakest to the strongest.
#[derive(Debug, Clone, PartialEq)]
pub struct Claims {
    /// Site of the error, and the probability that an error acts there.
    pub place: (Site, f64),
    /// Quantities, and the probability that the error at the site depends on exactly these.
    pub depends_on: (Vec<Covariate>, f64),
    /// Hypothesis, and the probability that its law acts at the site without an additional
    /// function.
    pub law: (Hypothesis, f64),
}

impl Claims {
    /// Returns the claims with the place extended to neighbours that the hypotheses do not tell
    /// apart from it.
    ///
    /// An error of the last joint that depends on no motion moves the target as a displacement of
    /// the tool about the joint's axis does. A law of the grammar is then one of two, at either
    /// part; a law of the catalogue belongs to joints. A free function of the loads at a joint or a
    /// link has no rivals at the parts beside it, which give way under nearly the same loads.
    pub(in crate::select) fn with_neighbours(mut self, problem: &Problem) -> Self {
        let is_motion = |of: &Covariate| {
            matches!(of, Covariate::Command(_) | Covariate::Approach(_) | Covariate::Velocity)
        };
        let effect = self.law.0.effect();
        let is_of_joint = effect.is_some_and(|effect| !effect.is_composed());
        let depends_on = &self.depends_on.0;
        let is_still = !depends_on.is_empty() && !depends_on.iter().any(is_motion);
        let is_function_of_load =
            self.law.0.kind == HypothesisKind::Smooth && depends_on.contains(&Covariate::Load);
        self.place.0 = match self.place.0 {
            Site::Joint(joint) if joint == tool_joint(problem) && is_still && !is_of_joint => {
                self.law.1 *= if effect.is_some() { 0.5 } else { 1.0 };
                Site::LastJointOrTool(joint)
            }
            Site::Joint(joint) if is_function_of_load => Site::JointOrLink(joint),
            Site::LinkBefore(joint) if is_function_of_load => Site::LinkOrJoint(joint),
            site => site,
        };
        self
    }
}

/// Returns the odds (1 − p) / p against a claim of probability p, at most 1.
pub(in crate::select) fn odds_against(probability: f64) -> f64 {
    ((1.0 - probability).max(MIN_KEPT_PROBABILITY) / probability.max(MIN_KEPT_PROBABILITY)).min(1.0)
}

impl Evidence {
    /// Returns the hypotheses of the most probable set; empty if noise alone is most probable.
    pub fn best(&self) -> &[Hypothesis] {
        self.sets.first().map_or(&[], |best| &best.hypotheses)
    }

    /// Returns the probability that at least one hypothesis acts for which `of` returns true.
    pub fn probability(&self, of: impl Fn(&Hypothesis) -> bool) -> f64 {
        let holds = |explanation: &&HypothesisSet| explanation.hypotheses.iter().any(&of);
        self.sets
            .iter()
            .filter(holds)
            .map(|explanation| explanation.probability)
            .sum::<f64>()
            .min(1.0)
    }

    /// Returns the probability that a joint, counted from 1, has a periodic error with many orders.
    pub(in crate::select) fn gear_probability(&self, joint: usize) -> f64 {
        self.probability(|hypothesis| hypothesis.gear_joint() == Some(joint - 1))
    }

    /// Returns the most probable set whose number of members is certain enough: at least so many
    /// hypotheses act with probability `level` or more. `None` if no set is certain enough.
    pub fn certain_set(&self, level: f64) -> Option<&HypothesisSet> {
        self.sets.iter().find(|explanation| self.probability_of_as_many(explanation) >= level)
    }

    /// Returns the probability that at least as many hypotheses act as `as_in` has members.
    pub(in crate::select) fn probability_of_as_many(&self, as_in: &HypothesisSet) -> f64 {
        let holds =
            |explanation: &&HypothesisSet| explanation.hypotheses.len() >= as_in.hypotheses.len();
        self.sets.iter().filter(holds).map(|explanation| explanation.probability).sum()
    }

    /// Returns an upper limit of the probability that noise and fewer hypotheses than in `best`
    /// cause such strong evidence for as many as in `best`. A likelihood ratio exceeds B at most
    /// with probability 1/B [Ville 1939].
    pub fn p_value_limit(&self, best: &HypothesisSet) -> f64 {
        let is_fewer = |set: &&HypothesisSet| set.hypotheses.len() < best.hypotheses.len();
        let fewer: f64 = self.sets.iter().filter(is_fewer).map(|set| set.probability).sum();
        odds_against(1.0 - fewer)
    }

    /// Returns sets in which an effect replaces one member of `best`: the `most` most probable
    /// ones, and the best replacement of each member. Hypotheses about wrong limits are not
    /// replaced.
    pub(in crate::select) fn rival_sets(
        &self,
        best: &HypothesisSet,
        most: usize,
    ) -> Vec<HypothesisSet> {
        let differ = |one: &HypothesisSet, other: &HypothesisSet| {
            let is_new = |candidate: &&Hypothesis| {
                !other.hypotheses.iter().any(|member| member.is_same_claim(candidate))
            };
            one.hypotheses.iter().filter(is_new).cloned().collect::<Vec<Hypothesis>>()
        };
        let is_exchange = |other: &&HypothesisSet| {
            other.hypotheses.len() == best.hypotheses.len()
                && matches!(differ(best, other).as_slice(), [only] if !only.is_limit())
                && matches!(differ(other, best).as_slice(), [only] if only.effect().is_some())
        };
        let mut alternatives: Vec<HypothesisSet> =
            self.sets.iter().filter(is_exchange).take(most).cloned().collect();
        for (member, other) in self.stand_ins.iter().filter(|(member, _)| !member.is_limit()) {
            let Some(index) = best.hypotheses.iter().position(|of_best| of_best == member) else {
                continue;
            };
            let mut exchanged = HypothesisSet { probability: 0.0, ..best.clone() };
            exchanged.hypotheses[index] = other.clone();
            exchanged.functions[index].0 = 0;
            let is_listed = |set: &HypothesisSet| {
                set.hypotheses.iter().all(|member| exchanged.hypotheses.contains(member))
            };
            if !alternatives.iter().any(is_listed) && !best.hypotheses.contains(other) {
                alternatives.push(exchanged);
            }
        }
        alternatives
    }

    /// Returns the evidence with the probabilities of some sets corrected by `odds`: for each set,
    /// ln of its odds over `best`, computed at a fit of that set.
    pub(in crate::select) fn corrected(
        mut self,
        best: &HypothesisSet,
        odds: &[(HypothesisSet, f64)],
    ) -> Self {
        let of_best = self
            .sets
            .iter()
            .find(|set| set.hypotheses == best.hypotheses)
            .map_or(0.0, |set| set.probability);
        for (explanation, ln_odds) in odds {
            // At larger odds, the best set has a negligible probability.
            let probability = of_best * ln_odds.min(40.0).exp();
            let is_same = |set: &&mut HypothesisSet| {
                set.hypotheses.len() == explanation.hypotheses.len()
                    && set.hypotheses.iter().all(|member| explanation.hypotheses.contains(member))
            };
            match self.sets.iter_mut().find(is_same) {
                Some(set) => set.probability = probability,
                None => self.sets.push(HypothesisSet { probability, ..explanation.clone() }),
            }
        }
        let total: f64 = self.sets.iter().map(|set| set.probability).sum();
        self.sets.iter_mut().for_each(|set| set.probability /= total);
        self.sets.sort_by(|a, b| b.probability.total_cmp(&a.probability));
        self
    }

    /// Returns effects that may replace `effect` in a model with the effects `held`, best first.
    /// Each has the probability of the sets that contain it instead of `effect`, at least
    /// `min_ratio` times that of the sets with `effect`, or with the best of them if more.
    pub fn alternatives(
        &self,
        effect: &Effect,
        held: &[Effect],
        min_ratio: f64,
    ) -> Vec<(Effect, f64)> {
        // If a model has very many effects, most are in no set, and the search below is not
        // needed.
        let mut hypotheses = self.sets.iter().flat_map(|explanation| &explanation.hypotheses);
        if !hypotheses
            .by_ref()
            .filter_map(Hypothesis::effect)
            .any(|other_effect| other_effect.is_but_for_search(effect))
        {
            return Vec::new();
        }
        let others: Vec<&Effect> = held.iter().filter(|other| *other != effect).collect();
        // Returns the effects of a set without the held ones. The searched argument of a held
        // effect may have another value in the set.
        let without_others = |explanation: &HypothesisSet| {
            let mut remaining = explanation.effects();
            for other in &others {
                let exact = remaining.iter().position(|other_effect| other_effect == *other);
                let place = exact.or_else(|| {
                    remaining.iter().position(|other_effect| other_effect.is_but_for_search(other))
                });
                place.map(|place| remaining.remove(place));
            }
            remaining
        };
        let mut with = 0.0;
        // Sets are sorted by probability, so each effect gets the value of its searched argument in
        // the most probable set.
        let mut instead: Vec<(Effect, f64)> = Vec::new();
        for explanation in &self.sets {
            let remaining = without_others(explanation);
            if remaining.iter().any(|other_effect| other_effect.is_but_for_search(effect)) {
                with += explanation.probability;
                continue;
            }
            for other in remaining {
                match instead
                    .iter_mut()
                    .find(|(other_effect, _)| other_effect.is_but_for_search(&other))
                {
                    Some((_, probability)) => *probability += explanation.probability,
                    None => instead.push((other, explanation.probability)),
                }
            }
        }
        if with == 0.0 {
            return Vec::new();
        }
        let most = instead.iter().fold(with, |most, (_, probability)| most.max(*probability));
        instead.retain(|(_, probability)| *probability >= most * min_ratio);
        instead.sort_by(|a, b| b.1.total_cmp(&a.1));
        instead
    }

    /// Returns place, quantities and law of an effect with their probabilities; `None` if no set
    /// contains the effect.
    pub fn claims_of(&self, effect: &Effect) -> Option<Claims> {
        let mut hypotheses = self.sets.iter().flat_map(|explanation| &explanation.hypotheses);
        hypotheses
            .find(|hypothesis| hypothesis.effect() == Some(effect))
            .map(|hypothesis| self.claims(hypothesis))
    }

    /// Returns place, quantities and law of a hypothesis with their probabilities.
    ///
    /// A hypothesis with another value of its searched argument is the same claim, unless the most
    /// probable set contains both.
    pub fn claims(&self, of: &Hypothesis) -> Claims {
        let most = self.sets.iter().map(|set| &set.hypotheses).find(|members| members.contains(of));
        let is_beside =
            |other: &Hypothesis| other != of && most.is_some_and(|most| most.contains(other));
        // If a limit is wrong, it explains the error at its site alone.
        let is_there =
            |other: &Hypothesis| other.site == of.site && (of.is_limit() || !other.is_limit());
        let place = self.probability(is_there);
        let depends_on =
            self.probability(|other| is_there(other) && other.depends_on == of.depends_on);
        let has_law = |explanation: &&HypothesisSet| {
            let unknown = |other: &Hypothesis| is_there(other) && other.effect().is_none();
            // All functions without a law make the same claim that the law is unknown. Errors that
            // wander in time, and sag under undeclared masses, are separate claims.
            let is_separate_claim = of.effect().is_some()
                || of.is_limit()
                || matches!(of.kind, HypothesisKind::Sag | HypothesisKind::Wandering);
            let is_it = |other: &&Hypothesis| {
                if is_separate_claim {
                    other.kind.has_same_law_as(&of.kind) && other.site == of.site
                } else {
                    unknown(other)
                }
            };
            explanation.hypotheses.iter().filter(is_it).any(|other| !is_beside(other))
                && (of.effect().is_none() || !explanation.hypotheses.iter().any(unknown))
        };
        let law = self
            .sets
            .iter()
            .filter(has_law)
            .map(|explanation| explanation.probability)
            .fold(0.0, |sum, probability| sum + probability)
            .min(1.0);
        Claims {
            place: (of.site, place),
            depends_on: (of.depends_on.clone(), depends_on),
            law: (of.clone(), law),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn a_place_is_stated_with_the_neighbours_that_do_the_same() {
        let text = "name = 'two'\n[[joint]]\nd_m = 0.3\n[[joint]]\na_m = 0.4\n[tool]\ntarget_m = [0.1, 0, 0]\n\
                    [[effect]]\nlaw = { name = 'slip', at = 'joint2', terms = ['step(t - 10)'] }\n\
                    [data]\nfiles = ['m.csv']\nposition_sigma_mm = 0.1\n";
        let problem = Problem::parse(text, Path::new("problem.toml")).unwrap();
        let stated = |kind: HypothesisKind, site: Site, covariate: Covariate| {
            let law = (Hypothesis::new(kind, site, None, vec![covariate.clone()]), 0.96);
            let claims = Claims { place: (site, 1.0), depends_on: (vec![covariate], 1.0), law };
            let claims = claims.with_neighbours(&problem);
            format!("{} {:.2}", claims.place.0, claims.law.1)
        };
        let smooth = |site, covariate| stated(HypothesisKind::Smooth, site, covariate);
        assert_eq!(smooth(Site::Joint(1), Covariate::Time), "joint 2 or the tool 0.96");
        assert_eq!(smooth(Site::Joint(1), Covariate::Command(0)), "joint 2 0.96");
        assert_eq!(smooth(Site::Joint(0), Covariate::Time), "joint 1 0.96");
        assert_eq!(smooth(Site::Joint(0), Covariate::Load), "joint 1 or a link beside it 0.96");
        let link = smooth(Site::LinkBefore(1), Covariate::Load);
        assert_eq!(link, "link before joint 2 or a joint at its ends 0.96");
        let law = |effect: Effect| {
            stated(HypothesisKind::Effect(effect), Site::Joint(1), Covariate::Time)
        };
        let Effect::Law(declared) = problem.effects[0].effect.clone() else {
            unreachable!("the problem declares a law")
        };
        let composed = Effect::Law(declared.clone().composed(0.0, Vec::new()));
        assert_eq!(law(composed), "joint 2 or the tool 0.48");
        assert_eq!(law(Effect::Law(declared)), "joint 2 0.96");
        let harmonic = Effect::JointHarmonic { joint: 2, orders: vec![1] };
        assert_eq!(law(harmonic), "joint 2 0.96");
    }

    #[test]
    fn what_stands_for_one_effect_is_none_of_the_others_with_it() {
        let shift = |time: f64| Effect::StationShift { at_time: time };
        let drift = || Effect::TrackerDrift;
        let settling = || Effect::TrackerSettling { time_constant: 50.0 };
        let of = |effects: &[Effect], probability: f64| HypothesisSet {
            hypotheses: effects
                .iter()
                .map(|effect| {
                    Hypothesis::new(
                        HypothesisKind::Effect(effect.clone()),
                        Site::Measurement,
                        None,
                        vec![Covariate::Time],
                    )
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
        let held = explanations[0].effects();
        let evidence = Evidence {
            sets: explanations,
            stand_ins: Vec::new(),
            left_out: Vec::new(),
            others: OtherHypotheses::default(),
        };
        // The two later shifts together are twice as probable as settling.
        let alternatives = evidence.alternatives(&drift(), &held, 0.1);
        assert_eq!(alternatives, [(shift(30.0), 0.2), (settling(), 0.1)]);
        assert_eq!(evidence.alternatives(&shift(10.0), &held, 0.1), []);
        // An improbable effect is compared with the most probable one that may replace it.
        let improbable = vec![
            of(&[shift(10.0)], 0.75),
            of(&[settling()], 0.2),
            of(&[Effect::StationMove { at_time: 10.0 }], 0.04),
            of(&[drift()], 0.01),
        ];
        let held = [drift()];
        let evidence = Evidence { sets: improbable, ..evidence };
        let alternatives = evidence.alternatives(&drift(), &held, 0.1);
        assert_eq!(alternatives, [(shift(10.0), 0.75), (settling(), 0.2)]);
    }

    #[test]
    fn a_wave_is_as_sure_as_it_is_and_not_as_another_beside_it() {
        let wave = |order: f64| {
            Hypothesis::new(
                HypothesisKind::Effect(Effect::JointWave { joint: 1, order }),
                Site::Joint(0),
                None,
                vec![Covariate::Command(0)],
            )
        };
        let of = |orders: &[f64], probability: f64| HypothesisSet {
            hypotheses: orders.iter().copied().map(wave).collect(),
            probability,
            functions: vec![(0, 1.0); orders.len()],
        };
        let explanations = vec![
            of(&[6.4, 1.5], 0.5),
            of(&[6.4], 0.25),
            of(&[6.41, 1.5], 0.125),
            of(&[1.6, 6.4], 0.125),
        ];
        let evidence = Evidence {
            sets: explanations,
            stand_ins: Vec::new(),
            left_out: Vec::new(),
            others: OtherHypotheses::default(),
        };
        let law = |order: f64| evidence.claims(&wave(order)).law.1;
        // Order 6.41 is the same claim as 6.4, and 1.6 as 1.5, but 6.4 is another claim than 1.5.
        assert!((law(6.4) - 1.0).abs() < 1e-12, "{}", law(6.4));
        assert!((law(1.5) - 0.75).abs() < 1e-12, "{}", law(1.5));
    }
}
