//! Evidence evaluated again without some of the poses.

use crate::select::settings::{SUBSET_PARTS, SUBSETS};
use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::super::data::{Data, bits, numbered};
use super::super::fitted::Fitted;
use super::block::Block;
use super::blocks::blocks;
use super::candidate::Candidate;
use super::hypotheses::Hypotheses;
use super::hypothesis::{Hypothesis, HypothesisSet};
use super::posterior::Evidence;
use super::products::{Products, ResidualModel};
use super::search::{EvaluatedSet, reduced_by, search};
use crate::problem::Effect;

/// Smallest probability of a set whose hypotheses are included in evaluations without some poses.
const MIN_REPEATED_PROBABILITY: f64 = 1e-3;

/// Fit with the probable hypotheses about its residual, which are evaluated again with some poses
/// left out.
struct Reevaluation<'a> {
    fitted: &'a Fitted,
    data: &'a Data<'a>,
    hypotheses: &'a Hypotheses<'a>,
    /// Indices of the probable hypotheses in the list of all hypotheses.
    probable: Vec<usize>,
    best: &'a HypothesisSet,
}

impl<'a> Reevaluation<'a> {
    fn new(
        fitted: &'a Fitted,
        data: &'a Data<'a>,
        hypotheses: &'a Hypotheses<'a>,
        (evidence, best): (&Evidence, &'a HypothesisSet),
    ) -> Self {
        let probable_sets = || {
            evidence
                .sets
                .iter()
                .filter(|set| set.probability > MIN_REPEATED_PROBABILITY)
                .chain([best])
        };
        let members = || probable_sets().flat_map(|set| set.hypotheses.iter().zip(&set.functions));
        let is_probable = |candidate: &Candidate| {
            members().any(|(member, (variant, _))| {
                *variant == candidate.variant && *member == candidate.hypothesis
            })
        };
        let probable = (0..hypotheses.candidates.len())
            .filter(|&k| is_probable(&hypotheses.candidates[k]))
            .collect();
        Self { fitted, data, hypotheses, probable, best }
    }

    fn probable_candidates(&self) -> Vec<&Candidate> {
        self.probable.iter().map(|&k| &self.hypotheses.candidates[k]).collect()
    }

    /// Returns the indices, in the list of probable hypotheses, of the best set's members for which
    /// `of` returns true.
    fn members(&self, of: impl Fn(&Hypothesis) -> bool) -> Vec<usize> {
        let candidates = self.probable_candidates();
        let is_held = |k: &usize| {
            let candidate = candidates[*k];
            self.best.hypotheses.iter().zip(&self.best.functions).any(|(member, (variant, _))| {
                *variant == candidate.variant
                    && member.is_same_claim(&candidate.hypothesis)
                    && of(member)
            })
        };
        (0..candidates.len()).filter(is_held).collect()
    }

    fn blocks(&self, left_out: &[usize]) -> Option<(Vec<Block>, ResidualModel)> {
        blocks(self.fitted, self.data, self.hypotheses, &self.probable_candidates(), left_out)
    }

    /// Returns the evidence about the probable hypotheses, evaluated without the poses `left_out`;
    /// `None` if the residual is not finite or the search was stopped.
    fn without(&self, left_out: &[usize]) -> Option<Evidence> {
        let (blocks, residual_model) = self.blocks(left_out)?;
        let present = self.members(|member| member.effect().is_some());
        let candidates = self.probable_candidates();
        let set = |EvaluatedSet { members, sizes, probability }: EvaluatedSet| HypothesisSet {
            hypotheses: members.iter().map(|&k| candidates[k].hypothesis.clone()).collect(),
            probability,
            functions: members.iter().map(|&k| candidates[k].variant).zip(sizes).collect(),
        };
        let sets =
            search(&Products::new(&blocks, &residual_model), &present, &[]).into_iter().map(set);
        Some(Evidence {
            sets: sets.collect(),
            stand_ins: Vec::new(),
            left_out: left_out.to_vec(),
            others: self.hypotheses.others.clone(),
        })
    }

    /// Returns the index of the pose whose squared residual decreases most when `effect` is added
    /// to all other members of the best set, and its share of the whole decrease. The poses
    /// `left_out` are not used. Returns `None` if the sets cannot be evaluated.
    fn single_influential_pose(&self, effect: &Effect, left_out: &[usize]) -> Option<(usize, f64)> {
        let (blocks, residual_model) = self.blocks(left_out)?;
        let products = Products::new(&blocks, &residual_model);
        let residual_of = |of: &dyn Fn(&Hypothesis) -> bool| {
            Some(reduced_by(&self.members(of), &products)?.residual())
        };
        let (with, without) =
            (residual_of(&|_| true)?, residual_of(&|member| member.effect() != Some(effect))?);
        let poses = self.hypotheses.linearised.poses().len();
        let gain = |pose: usize| {
            without.rows(3 * pose, 3).norm_squared() - with.rows(3 * pose, 3).norm_squared()
        };
        let pose = (0..poses).max_by(|&a, &b| gain(a).total_cmp(&gain(b)))?;
        Some((pose, gain(pose) / (without.norm_squared() - with.norm_squared())))
    }
}

/// Smallest share of an effect's gain at which a single pose supports it, if the effect's site has
/// other hypotheses too: more than all other poses together.
const MIN_SINGLE_SHARE: f64 = 0.5;

/// Returns a pose that alone supports an effect with a searched argument. `None` if there is none.
///
/// Without the pose, the most probable set has no hypothesis at the effect's site. Or it has fewer
/// there, and the effect reduces the residual of this pose more than of all others: two changes in
/// time that bracket a single pose, for example, fit its error, whatever it is.
pub(super) fn single_supporting_pose(
    fitted: &Fitted,
    data: &Data,
    (evidence, hypotheses): (&Evidence, &Hypotheses),
) -> Option<usize> {
    let best = evidence.certain_set(data.rules.inclusion_threshold)?;
    let searched: Vec<&Hypothesis> = best
        .hypotheses
        .iter()
        .filter(|hypothesis| {
            hypothesis.effect().is_some_and(|effect| effect.is_searched() && !effect.is_composed())
        })
        .collect();
    if searched.is_empty() || !best.gears().is_empty() {
        return None;
    }
    let reevaluation = Reevaluation::new(fitted, data, hypotheses, (evidence, best));
    let alone = |hypothesis: &Hypothesis| {
        let (pose, share) =
            reevaluation.single_influential_pose(hypothesis.effect()?, &evidence.left_out)?;
        let others = reevaluation.without(&[evidence.left_out.as_slice(), &[pose]].concat())?;
        let at_site = |of: &[Hypothesis]| of.iter().filter(|of| of.site == hypothesis.site).count();
        let (left, all) = (at_site(others.best()), at_site(&best.hypotheses));
        (left == 0 || left < all && share > MIN_SINGLE_SHARE).then_some(pose)
    };
    searched.into_iter().find_map(alone)
}

/// Evidence about an effect in random subsets of the configurations, each of which leaves out a
/// fifth of them.
#[derive(Debug, Clone)]
pub(in crate::select) struct SubsetEvidence {
    pub effect: Effect,
    /// Fraction of the subsets whose most probable set contains the effect.
    pub share: f64,
    /// Mean over the subsets of the probabilities of the effect's place, of the quantities on which
    /// it depends, and of its law; 0 in a subset in which no set contains the effect.
    pub means: [f64; 3],
}

/// Returns the evidence about each effect of a set in random subsets, in the linear neighbourhood
/// of the fit to all rows. An effect with another value of its searched argument is the same
/// effect.
pub(in crate::select) fn subset_evidence(
    fitted: &Fitted,
    data: &Data,
    (evidence, best): (&Evidence, &HypothesisSet),
    added: &[Effect],
) -> Vec<SubsetEvidence> {
    let rows = data.evidence_rows();
    let configurations =
        numbered(rows.iter().map(|&row| bits(data.measurements.configuration(row))));
    let count = configurations.iter().max().map_or(0, |last| last + 1);
    if best.effects().is_empty() || count < 2 {
        return Vec::new();
    }
    let hypotheses = Hypotheses::new(fitted, data, added, &rows, rows.len());
    let reevaluation = Reevaluation::new(fitted, data, &hypotheses, (evidence, best));
    let drawn = |seed: u64| {
        let mut order: Vec<usize> = (0..count).collect();
        order.shuffle(&mut ChaCha8Rng::seed_from_u64(data.rules.seed ^ seed));
        let left_out = &order[..(count / SUBSET_PARTS).max(1)];
        let is_out = |&pose: &usize| {
            left_out.contains(&configurations[pose]) || evidence.left_out.contains(&pose)
        };
        reevaluation.without(&(0..rows.len()).filter(is_out).collect::<Vec<usize>>())
    };
    let subsets: Vec<Evidence> = (0..SUBSETS).into_par_iter().filter_map(drawn).collect();
    best.effects().into_iter().map(|effect| evidence_in_subsets(&subsets, effect)).collect()
}

fn evidence_in_subsets(subsets: &[Evidence], effect: Effect) -> SubsetEvidence {
    let is_effect = |hypothesis: &&Hypothesis| {
        hypothesis.effect().is_some_and(|other| other.is_but_for_search(&effect))
    };
    let holds = |subset: &&Evidence| subset.best().iter().any(|member| is_effect(&member));
    let claims = |subset: &Evidence| {
        let mut members = subset.sets.iter().flat_map(|set| &set.hypotheses);
        let claims = subset.claims(members.find(is_effect)?);
        Some([claims.place.1, claims.depends_on.1, claims.law.1])
    };
    let count = subsets.len().max(1) as f64;
    let share = subsets.iter().filter(holds).count() as f64 / count;
    let claims: Vec<[f64; 3]> = subsets.iter().filter_map(claims).collect();
    let mean = |k: usize| claims.iter().map(|claims| claims[k]).sum::<f64>() / count;
    SubsetEvidence { effect, share, means: [mean(0), mean(1), mean(2)] }
}
