//! Search for values of a searched argument, such as a time constant, between those of the listed
//! candidates.
//!
//! For each effect in a probable set, the value that explains the residual best together with the
//! other members becomes a candidate. Otherwise a strong effect with a slightly wrong value would
//! leave structure.

use super::block::Block;
use super::candidate::{Candidate, scaled_to_equal_length};
use super::hypotheses::Hypotheses;
use super::hypothesis::{Hypothesis, HypothesisKind};
use super::marginal::Coefficients;
use super::products::Products;
use super::search::{EvaluatedSet, reduced_by};
use crate::problem::{Effect, Problem};
use crate::select::settings::{MAX_REVISED_SETS, MIN_REVISED_PROBABILITY};

/// Number of trial values on either side of the present one.
const TRIALS_PER_SIDE: i32 = 8;
/// Ratio of the farthest trial value to the present one, in the first and in the second pass. The
/// first ratio exceeds the spacing of listed values; the second one equals the trial spacing of the
/// first pass.
const LAST_RATIOS: [f64; 2] = [1.4, 1.043];
/// ln of the odds of another value of an argument over the listed one, at which the other value is
/// added.
const MIN_LN_ODDS_OF_FINER: f64 = 0.5;

/// Returns effects whose argument lies between the listed values. Each is more probable than the
/// member of a probable set that it would replace.
pub(super) fn finer_candidates(
    hypotheses: &Hypotheses,
    evaluated_sets: &[EvaluatedSet],
    products: &Products,
    blocks_of: impl Fn(&[Candidate]) -> Vec<Block>,
    problem: &Problem,
) -> Vec<Candidate> {
    let Products { blocks, residual_model, .. } = *products;
    let mut found: Vec<Candidate> = Vec::new();
    for set in evaluated_sets
        .iter()
        .filter(|set| set.probability > MIN_REVISED_PROBABILITY)
        .take(MAX_REVISED_SETS)
        .filter(|set| !products.has_gear(&set.members))
    {
        for &member in &set.members {
            let candidate = &hypotheses.candidates[member];
            if candidate
                .hypothesis
                .effect()
                .is_none_or(|effect| effect.with_scaled_argument(LAST_RATIOS[0]).is_none())
            {
                continue;
            }
            // The value is tried beside all other members of the set, and beside those except
            // effects of the same family at the same place. In the latter case one value replaces
            // two members.
            let place =
                |k: usize| hypotheses.candidates[k].hypothesis.effect().map(Effect::name_and_place);
            let without_alike = set.without(|other| place(other) == place(member));
            let mut reduced_sets = vec![set.without(|other| other == member), without_alike];
            reduced_sets.dedup();
            for rest in &reduced_sets {
                let Some(left) = reduced_by(rest, products) else { continue };
                let mut best: Option<Candidate> = None;
                let mut least = left.gain(member).0
                    + products.ln_prior(&blocks[member], rest)
                    + MIN_LN_ODDS_OF_FINER;
                for farthest in LAST_RATIOS {
                    let near = hypotheses.neighbouring_candidates(
                        best.as_ref().unwrap_or(candidate),
                        farthest,
                        problem,
                    );
                    if residual_model.stop.is_requested() {
                        break;
                    }
                    for (candidate, odds) in near.iter().zip(left.ln_odds_of(&blocks_of(&near))) {
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
    /// Returns copies of the candidate with neighbouring values of its searched argument, up to the
    /// ratio `farthest`. Values of other candidates are left out.
    fn neighbouring_candidates(
        &self,
        candidate: &Candidate,
        farthest: f64,
        problem: &Problem,
    ) -> Vec<Candidate> {
        let Some(effect) = candidate.hypothesis.effect() else { return Vec::new() };
        let factors = (-TRIALS_PER_SIDE..=TRIALS_PER_SIDE)
            .filter(|step| *step != 0)
            .map(|step| farthest.powf(f64::from(step) / f64::from(TRIALS_PER_SIDE)));
        let others = factors.filter_map(|factor| effect.with_scaled_argument(factor));
        let is_new = |effect: &Effect| {
            !self.candidates.iter().any(|other| other.hypothesis.effect() == Some(effect))
        };
        others
            .filter(is_new)
            .filter_map(|effect| self.with_effect(candidate, effect, problem))
            .collect()
    }

    /// Returns a copy of the candidate for `effect`, which differs only in the value of its
    /// argument; `None` if `effect` displaces no pose.
    fn with_effect(
        &self,
        candidate: &Candidate,
        effect: Effect,
        problem: &Problem,
    ) -> Option<Candidate> {
        let columns = self.linearised.columns(&effect);
        let (design, largest) =
            scaled_to_equal_length(columns, &effect.terms(problem), self.evidence_poses)?;
        let coefficients = Coefficients { largest, ..candidate.coefficients.clone() };
        let hypothesis =
            Hypothesis { kind: HypothesisKind::Effect(effect), ..candidate.hypothesis.clone() };
        let ln_prior = candidate.ln_prior;
        Some(Candidate { hypothesis, variant: 0, design, ln_prior, coefficients })
    }
}
