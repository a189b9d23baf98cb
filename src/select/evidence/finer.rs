//! Values of a searched argument between those that are listed, as a time constant: about the
//! effects that explanations hold, the value that does best beside the rest becomes a hypothesis
//! like all others. A strong effect of a value hardly off would else leave structure.

use super::block::{Block, Design};
use super::candidate::{Candidate, even};
use super::hypotheses::Hypotheses;
use super::hypothesis::{Hypothesis, HypothesisKind};
use super::marginal::Coefficients;
use super::products::Products;
use super::search::{Weighted, left_by};
use crate::problem::{Effect, Problem};
use crate::select::rules::SelectionRules;

/// Probability of an explanation from which on its arguments are looked at.
const WORTH_A_LOOK: f64 = 0.01;
/// Explanations that are looked at, the most probable ones.
const MOST: usize = 6;
/// Values to either side.
const STEPS: i32 = 8;
/// How far the last of them is off: listed ones are closer; then as far as from one to the next.
const FARTHEST: [f64; 2] = [1.4, 1.043];
/// ln of the odds by which another value has to do better.
const BETTER: f64 = 0.5;

/// Effects of finer arguments than those known that do better in their places in `weighted`
/// explanations.
pub(super) fn finer(
    hypotheses: &Hypotheses,
    weighted: &[Weighted],
    products: &Products,
    blocks_of: impl Fn(&[Candidate]) -> Vec<Block>,
    problem: &Problem,
) -> Vec<Candidate> {
    let Products { blocks, target, rules, .. } = *products;
    let mut found: Vec<Candidate> = Vec::new();
    for set in weighted.iter().filter(|set| set.probability > WORTH_A_LOOK).take(MOST) {
        for &member in &set.members {
            let own = &hypotheses.all[member];
            if own.hypothesis.effect().is_none_or(|effect| effect.scaled(FARTHEST[0]).is_none()) {
                continue;
            }
            // Beside everything else, and beside what is no such effect of that place: one may do
            // for two.
            let place =
                |k: usize| hypotheses.all[k].hypothesis.effect().map(Effect::name_and_place);
            let without_own =
                set.members.iter().copied().filter(|&other| other != member).collect();
            let without_alike = set
                .members
                .iter()
                .copied()
                .filter(|&other| place(other) != place(member))
                .collect();
            let mut rests: Vec<Vec<usize>> = vec![without_own, without_alike];
            rests.dedup();
            for rest in &rests {
                let Some(left) = left_by(rest, products) else { continue };
                let mut best: Option<Candidate> = None;
                let mut least =
                    left.gain(member).0 + products.ln_prior(&blocks[member], rest) + BETTER;
                for farthest in FARTHEST {
                    let near =
                        hypotheses.near(best.as_ref().unwrap_or(own), farthest, problem, rules);
                    if target.stop.is_requested() {
                        break;
                    }
                    for (candidate, odds) in
                        std::iter::zip(near.iter(), left.odds_of(&blocks_of(&near)))
                    {
                        if odds > least {
                            (best, least) = (Some(candidate.clone()), odds);
                        }
                    }
                }
                found.extend(
                    best.filter(|best| {
                        !found.iter().any(|other| other.hypothesis == best.hypothesis)
                    }),
                );
            }
        }
    }
    found
}

impl Hypotheses<'_> {
    /// The same hypothesis with other values of its searched argument that no candidate has.
    fn near(
        &self,
        own: &Candidate,
        farthest: f64,
        problem: &Problem,
        rules: &SelectionRules,
    ) -> Vec<Candidate> {
        let Some(effect) = own.hypothesis.effect() else { return Vec::new() };
        let factors = (-STEPS..=STEPS)
            .filter(|step| *step != 0)
            .map(|step| farthest.powf(f64::from(step) / f64::from(STEPS)));
        let others = factors.filter_map(|factor| effect.scaled(factor));
        let is_new = |effect: &Effect| {
            !self.all.iter().any(|known| known.hypothesis.effect() == Some(effect))
        };
        others.filter(is_new).filter_map(|effect| self.like(own, effect, problem, rules)).collect()
    }

    /// A hypothesis like another one with an effect of another argument.
    fn like(
        &self,
        own: &Candidate,
        effect: Effect,
        problem: &Problem,
        rules: &SelectionRules,
    ) -> Option<Candidate> {
        let columns = self.linearised.columns(&effect);
        let (columns, largest) = even(columns, &effect.terms(problem), self.weighed, rules);
        let design = Design::Dense(columns).scaled(self.weighed)?;
        let coefficients = Coefficients { largest, ..own.coefficients.clone() };
        let hypothesis =
            Hypothesis { kind: HypothesisKind::Effect(effect), ..own.hypothesis.clone() };
        Some(Candidate { hypothesis, variant: 0, design, ln_prior: own.ln_prior, coefficients })
    }
}
