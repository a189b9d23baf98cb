//! What evidence says without some of the poses.

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

/// Probability below which an explanation is not looked at in fits to fewer poses.
const WORTH_A_DRAW: f64 = 1e-3;

/// A fit with what is probable of what may explain its residual.
struct Again<'a> {
    fitted: &'a Fitted,
    data: &'a Data<'a>,
    hypotheses: &'a Hypotheses<'a>,
    /// Numbers of the probable ones among all.
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
        let worth =
            || evidence.sets.iter().filter(|known| known.probability > WORTH_A_DRAW).chain([best]);
        let all = || worth().flat_map(|known| known.hypotheses.iter().zip(&known.functions));
        let is_known = |candidate: &Candidate| {
            all().any(|(own, (variant, _))| {
                *variant == candidate.variant && *own == candidate.hypothesis
            })
        };
        let probable =
            (0..hypotheses.all.len()).filter(|&k| is_known(&hypotheses.all[k])).collect();
        Self { fitted, data, hypotheses, probable, best }
    }

    fn own(&self) -> Vec<&Candidate> {
        self.probable.iter().map(|&k| &self.hypotheses.all[k]).collect()
    }

    /// Places among the probable ones of what the best explanation holds.
    fn members(&self, of: impl Fn(&Hypothesis) -> bool) -> Vec<usize> {
        let own = self.own();
        let is_held = |k: &usize| {
            let candidate = own[*k];
            self.best.hypotheses.iter().zip(&self.best.functions).any(|(known, (variant, _))| {
                *variant == candidate.variant && known.says(&candidate.hypothesis) && of(known)
            })
        };
        (0..own.len()).filter(is_held).collect()
    }

    fn blocks(&self, left_out: &[usize]) -> Option<(Vec<Block>, Target)> {
        blocks(self.fitted, self.data, self.hypotheses, &self.own(), left_out)
    }

    /// The hypotheses that explain the other poses best.
    fn most_probable(&self, left_out: &[usize]) -> Option<Vec<&Hypothesis>> {
        let (blocks, target) = self.blocks(left_out)?;
        let present = self.members(|known| known.effect().is_some());
        let most = search(&Products::new((&blocks, &target), self.data.rules), &present)
            .into_iter()
            .next()?;
        let own = self.own();
        Some(most.members.into_iter().map(|k| &own[k].hypothesis).collect())
    }

    /// The pose whose squares a member of the best explanation lowers most, beside all others.
    fn single_influential_pose(&self, effect: &Effect, left_out: &[usize]) -> Option<usize> {
        let (blocks, target) = self.blocks(left_out)?;
        let products = Products::new((&blocks, &target), self.data.rules);
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

/// A pose without which nothing acts, by the most probable explanation, where an effect of the sure
/// one does whose time, distance or order is searched: that pose alone carries it.
pub(super) fn carried_by_one(
    fitted: &Fitted,
    data: &Data,
    (evidence, hypotheses): (&Evidence, &Hypotheses),
) -> Option<usize> {
    let best = evidence.sure(data.rules.sure)?;
    let searched: Vec<&Hypothesis> = best
        .hypotheses
        .iter()
        .filter(|own| own.effect().is_some_and(Effect::is_searched))
        .collect();
    if searched.is_empty() {
        return None;
    }
    let again = Again::new(fitted, data, hypotheses, (evidence, best));
    let alone = |own: &Hypothesis| {
        let pose = again.single_influential_pose(own.effect()?, &evidence.left_out)?;
        let others = again.most_probable(&[evidence.left_out.as_slice(), &[pose]].concat())?;
        (!others.iter().any(|other| other.site == own.site)).then_some(pose)
    };
    searched.into_iter().find_map(alone)
}

/// For each effect of an explanation the part of fits to whole configurations drawn anew, a fifth
/// left out, whose most probable explanation holds it; linear about the fit to all.
pub(in crate::select) fn stability(
    fitted: &Fitted,
    data: &Data,
    (evidence, best): (&Evidence, &HypothesisSet),
    added: &[Effect],
) -> Vec<(Effect, f64)> {
    if best.effects().is_empty() {
        return Vec::new();
    }
    let rows = data.weighed();
    let hypotheses = Hypotheses::of(fitted, data, added, &rows, rows.len());
    let again = Again::new(fitted, data, &hypotheses, (evidence, best));
    let configurations = number(rows.iter().map(|&row| bits(data.measurements.configuration(row))));
    let count = configurations.iter().max().map_or(0, |last| last + 1);
    let drawn = |seed: u64| {
        let mut order: Vec<usize> = (0..count).collect();
        order.shuffle(&mut ChaCha8Rng::seed_from_u64(data.rules.seed ^ seed));
        let left_out = &order[..count / data.rules.left_out];
        let is_out = |&pose: &usize| {
            left_out.contains(&configurations[pose]) || evidence.left_out.contains(&pose)
        };
        let poses: Vec<usize> = (0..rows.len()).filter(is_out).collect();
        let most = again.most_probable(&poses)?;
        Some(most.into_iter().filter_map(Hypothesis::effect).cloned().collect::<Vec<Effect>>())
    };
    let drawn: Vec<Vec<Effect>> =
        (0..data.rules.drawn_again).into_par_iter().filter_map(drawn).collect();
    let share = |effect: &Effect| {
        let holds = drawn.iter().filter(|all| all.contains(effect)).count();
        holds as f64 / drawn.len().max(1) as f64
    };
    best.effects().into_iter().map(|effect| (effect.clone(), share(&effect))).collect()
}
