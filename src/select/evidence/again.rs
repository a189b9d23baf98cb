//! Evidence without some of the poses.

use crate::select::settings::{SUBSET_PARTS, SUBSETS};
use rand::SeedableRng as _;
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::super::data::{Data, bits, number};
use super::super::fitted::Fitted;
use super::block::Block;
use super::blocks::blocks;
use super::candidate::Candidate;
use super::hypotheses::Hypotheses;
use super::hypothesis::Hypothesis;
use super::hypothesis_set::HypothesisSet;
use super::posterior::Evidence;
use super::products::{Products, Target};
use super::search::{left_by, search};
use crate::problem::Effect;

/// Smallest probability of a set whose hypotheses are considered again without some poses.
const MIN_REPEATED_PROBABILITY: f64 = 1e-3;

/// Fit with the probable hypotheses about its residual, which are evaluated again without some
/// poses.
struct Again<'a> {
    fitted: &'a Fitted,
    data: &'a Data<'a>,
    hypotheses: &'a Hypotheses<'a>,
    /// Indices of the probable hypotheses in the list of all hypotheses.
    probable: Vec<usize>,
    best: &'a HypothesisSet,
}

impl<'a> Again<'a> {
    fn new(
        fitted: &'a Fitted,
        data: &'a Data<'a>,
        hypotheses: &'a Hypotheses<'a>,
        (evidence, best): (&Evidence, &'a HypothesisSet),
    ) -> Self {
        let worth = || {
            evidence
                .sets
                .iter()
                .filter(|known| known.probability > MIN_REPEATED_PROBABILITY)
                .chain([best])
        };
        let all = || worth().flat_map(|known| known.hypotheses.iter().zip(&known.functions));
        let is_known = |candidate: &Candidate| {
            all().any(|(member, (variant, _))| {
                *variant == candidate.variant && *member == candidate.hypothesis
            })
        };
        let probable =
            (0..hypotheses.all.len()).filter(|&k| is_known(&hypotheses.all[k])).collect();
        Self { fitted, data, hypotheses, probable, best }
    }

    fn probable_candidates(&self) -> Vec<&Candidate> {
        self.probable.iter().map(|&k| &self.hypotheses.all[k]).collect()
    }

    /// Returns the positions, in the list of probable hypotheses, of those members of the best set
    /// for which `of` is true.
    fn members(&self, of: impl Fn(&Hypothesis) -> bool) -> Vec<usize> {
        let candidates = self.probable_candidates();
        let is_held = |k: &usize| {
            let candidate = candidates[*k];
            self.best.hypotheses.iter().zip(&self.best.functions).any(|(known, (variant, _))| {
                *variant == candidate.variant && known.says(&candidate.hypothesis) && of(known)
            })
        };
        (0..candidates.len()).filter(is_held).collect()
    }

    fn blocks(&self, left_out: &[usize]) -> Option<(Vec<Block>, Target)> {
        blocks(self.fitted, self.data, self.hypotheses, &self.probable_candidates(), left_out)
    }

    /// Returns the most probable set of hypotheses for the data without the poses `left_out`.
    fn most_probable(&self, left_out: &[usize]) -> Option<Vec<&Hypothesis>> {
        let (blocks, target) = self.blocks(left_out)?;
        let present = self.members(|known| known.effect().is_some());
        let most = search(&Products::new(&blocks, &target), &present).into_iter().next()?;
        let candidates = self.probable_candidates();
        Some(most.members.into_iter().map(|k| &candidates[k].hypothesis).collect())
    }

    /// Returns the pose whose squared residual decreases most when `effect` is added to all other
    /// members of the best set.
    fn single_influential_pose(&self, effect: &Effect, left_out: &[usize]) -> Option<usize> {
        let (blocks, target) = self.blocks(left_out)?;
        let products = Products::new(&blocks, &target);
        let left = |of: &dyn Fn(&Hypothesis) -> bool| {
            Some(left_by(&self.members(of), &products)?.residual())
        };
        let (with, without) = (left(&|_| true)?, left(&|known| known.effect() != Some(effect))?);
        let poses = self.hypotheses.linearised.poses().len();
        let gain = |pose: usize| {
            without.rows(3 * pose, 3).norm_squared() - with.rows(3 * pose, 3).norm_squared()
        };
        (0..poses).max_by(|&a, &b| gain(a).total_cmp(&gain(b)))
    }
}

/// Returns a pose that alone supports an effect with a searched argument: without the pose, the
/// most probable set has no hypothesis at the effect's site. `None` if there is none.
pub(super) fn carried_by_one(
    fitted: &Fitted,
    data: &Data,
    (evidence, hypotheses): (&Evidence, &Hypotheses),
) -> Option<usize> {
    let best = evidence.sure(data.rules.inclusion_threshold)?;
    let searched: Vec<&Hypothesis> = best
        .hypotheses
        .iter()
        .filter(|hypothesis| hypothesis.effect().is_some_and(Effect::is_searched))
        .collect();
    if searched.is_empty() || !best.gears().is_empty() {
        return None;
    }
    let again = Again::new(fitted, data, hypotheses, (evidence, best));
    let alone = |hypothesis: &Hypothesis| {
        let pose = again.single_influential_pose(hypothesis.effect()?, &evidence.left_out)?;
        let others = again.most_probable(&[evidence.left_out.as_slice(), &[pose]].concat())?;
        (!others.iter().any(|other| other.site == hypothesis.site)).then_some(pose)
    };
    searched.into_iter().find_map(alone)
}

/// Returns how stable each effect of a set is: the share of random subsets (80 % of the
/// configurations) whose most probable set contains it. Computed in the linear neighbourhood of the
/// fit to all poses.
pub(in crate::select) fn stability(
    fitted: &Fitted,
    data: &Data,
    (evidence, best): (&Evidence, &HypothesisSet),
    added: &[Effect],
) -> Vec<(Effect, f64)> {
    let rows = data.evidence_rows();
    let configurations = number(rows.iter().map(|&row| bits(data.measurements.configuration(row))));
    let count = configurations.iter().max().map_or(0, |last| last + 1);
    if best.effects().is_empty() || count < 2 {
        return Vec::new();
    }
    let hypotheses = Hypotheses::of(fitted, data, added, &rows, rows.len());
    let again = Again::new(fitted, data, &hypotheses, (evidence, best));
    let drawn = |seed: u64| {
        let mut order: Vec<usize> = (0..count).collect();
        order.shuffle(&mut ChaCha8Rng::seed_from_u64(data.rules.seed ^ seed));
        let left_out = &order[..(count / SUBSET_PARTS).max(1)];
        let is_out = |&pose: &usize| {
            left_out.contains(&configurations[pose]) || evidence.left_out.contains(&pose)
        };
        let poses: Vec<usize> = (0..rows.len()).filter(is_out).collect();
        let most = again.most_probable(&poses)?;
        Some(most.into_iter().filter_map(Hypothesis::effect).cloned().collect::<Vec<Effect>>())
    };
    let drawn: Vec<Vec<Effect>> = (0..SUBSETS).into_par_iter().filter_map(drawn).collect();
    let share = |effect: &Effect| {
        let holds = drawn.iter().filter(|all| all.contains(effect)).count();
        holds as f64 / drawn.len().max(1) as f64
    };
    best.effects().into_iter().map(|effect| (effect.clone(), share(&effect))).collect()
}
