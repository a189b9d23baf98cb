//! Sets of hypotheses by their probability: a beam search over sets of blocks of columns.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::super::neighbourhood::LinearNeighbourhood;
use super::super::rules::SelectionRules;
use super::block::Block;
use super::marginal::{Noise, over_noise};
use crate::identify::Stop;

/// What is explained: what a fit leaves, with its degrees of freedom, and how far its σ is trusted.
#[derive(Debug, Clone)]
pub(super) struct Target {
    pub fit: LinearNeighbourhood,
    pub noise: Noise,
    /// The wish that the search end early.
    pub stop: Stop,
}

/// A set of hypotheses, and its probability among all sets looked at.
#[derive(Debug, Clone)]
pub(super) struct Weighted {
    /// Numbers of the hypotheses, in the order in which they were taken.
    pub members: Vec<usize>,
    /// The most probable size of each: 1 σ of its coefficients.
    pub sizes: Vec<f64>,
    pub probability: f64,
}

/// A set with the sizes of its members and ln of its posterior, up to a constant.
#[derive(Debug, Clone)]
struct Set {
    members: Vec<usize>,
    sizes: Vec<f64>,
    ln_posterior: f64,
}

impl Set {
    /// The set with one more, which gains so much at this size.
    fn with(&self, block: usize, (gain, size): (f64, f64), blocks: &[Block]) -> Self {
        Self {
            members: [self.members.as_slice(), &[block]].concat(),
            sizes: [self.sizes.as_slice(), &[size]].concat(),
            ln_posterior: self.ln_posterior + gain + blocks[block].ln_prior,
        }
    }
}

/// What a set leaves of the residual: with A of its members scaled by their sizes and 1 + AᵀA = L Lᵀ, Z = L⁻¹AᵀC takes its part off
/// other columns C.
pub(super) struct Conditioned {
    /// L⁻¹Aᵀ, shape = (columns of the set, rows).
    within: DMatrix<f64>,
    /// L⁻¹Aᵀr.
    taken: DVector<f64>,
    squares: f64,
    /// Of the noise, and ln p(r | set) over it.
    grid: Vec<(f64, f64)>,
    without: f64,
}

impl Conditioned {
    fn new(set: &Set, blocks: &[Block], target: &Target) -> Option<Self> {
        let residual = target.fit.residual();
        let mut all = DMatrix::zeros(residual.len(), 0);
        for (&member, &size) in set.members.iter().zip(&set.sizes) {
            let (columns, first) = (blocks[member].columns(&target.fit), all.ncols());
            all = all.resize_horizontally(first + columns.ncols(), 0.0);
            all.columns_mut(first, columns.ncols()).copy_from(&(columns.as_ref() * size));
        }
        let k = all.ncols();
        let inner = DMatrix::identity(k, k) + all.transpose() * &all;
        let within = inner.cholesky()?.l().solve_lower_triangular(&all.transpose())?;
        let taken = &within * residual;
        let squares = residual.norm_squared() - taken.norm_squared();
        let grid = target.noise.grid();
        let without = over_noise(squares, &grid);
        Some(Self { within, taken, squares, grid, without })
    }

    /// What a set with these members leaves.
    pub fn on(members: &[usize], (blocks, target): (&[Block], &Target), rules: &SelectionRules) -> Option<Self> {
        Self::new(&assembled(members, blocks, target, rules)?, blocks, target)
    }

    /// The gain of a block, its prior among it, and its most probable size.
    pub fn odds(&self, block: &Block, target: &Target, rules: &SelectionRules) -> (f64, f64) {
        let (gain, size) = self.gain(block, target, rules);
        (gain + block.ln_prior, size)
    }

    /// ln p(r | set and block) − ln p(r | set), and the block's most probable size.
    fn gain(&self, block: &Block, target: &Target, rules: &SelectionRules) -> (f64, f64) {
        let left = ((self.squares, target.noise.freedom), self.without);
        block.gain((&self.within, &self.taken), left, &self.grid, rules)
    }
}

/// All sets that were looked at, most probable first; the empty set stands for "nothing".
///
/// The search starts from nothing and from the set `present`, whole and without one of its members: what was found before is
/// judged again beside everything else. Stopped, it has looked at some sets only.
pub(super) fn search(blocks: &[Block], target: &Target, rules: &SelectionRules, present: &[usize]) -> Vec<Weighted> {
    let mut known: BTreeMap<Vec<usize>, Set> = BTreeMap::new();
    let without = |k: usize| [&present[..k], &present[k + 1..]].concat();
    let starts = std::iter::once(Vec::new()).chain((0..present.len()).map(without)).chain([present.to_vec()]);
    for start in starts {
        if let Some(set) = assembled(&start, blocks, target, rules) {
            known.insert(sorted(&set.members), set);
        }
    }
    // What holds more than the search goes to is judged as it is, and with one more.
    let (longer, front): (usize, Vec<Set>) = match known.get(&sorted(present)) {
        Some(all) if present.len() > rules.together => (1, vec![all.clone()]),
        _ => (rules.together, known.values().cloned().collect()),
    };
    let (mut front, mut promising): (Vec<Set>, Option<Vec<usize>>) = (front, None);
    for _ in 0..longer {
        let mut next: BTreeMap<Vec<usize>, Set> = BTreeMap::new();
        for (place, set) in front.iter().enumerate() {
            let Some(conditioned) = Conditioned::new(set, blocks, target) else { continue };
            let all = || (0..blocks.len()).collect();
            let tried: Vec<usize> = promising.as_ref().filter(|_| place > 0).map_or_else(all, Vec::clone);
            let gains: Vec<(usize, (f64, f64))> = tried
                .into_par_iter()
                .filter(|block| !set.members.contains(block) && !target.stop.is_requested())
                .map(|block| (block, conditioned.gain(&blocks[block], target, rules)))
                .collect();
            for (block, gain) in gains {
                let longer = set.with(block, gain, blocks);
                let key = sorted(&longer.members);
                let best = next.get(&key).or_else(|| known.get(&key));
                if best.is_none_or(|other| longer.ln_posterior > other.ln_posterior) {
                    next.insert(key, longer);
                }
            }
        }
        let best_known = known.values().map(|set| set.ln_posterior).fold(f64::NEG_INFINITY, f64::max);
        let mut sets: Vec<Set> = next.values().cloned().collect();
        known.extend(next);
        sets.sort_by(|a, b| b.ln_posterior.total_cmp(&a.ln_posterior));
        promising.get_or_insert_with(|| {
            let mut promising: Vec<usize> = Vec::new();
            for last in sets.iter().filter_map(|set| set.members.last()) {
                if promising.len() < rules.extending && !promising.contains(last) {
                    promising.push(*last);
                }
            }
            promising
        });
        let has_wide = |set: &Set| set.members.iter().any(|&member| blocks[member].is_wide(rules));
        front = sets.into_iter().filter(|set| !has_wide(set)).take(rules.extended).collect();
        if front.first().is_none_or(|best| best.ln_posterior < best_known - rules.hopeless) {
            break;
        }
    }
    let most = known.values().map(|set| set.ln_posterior).fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = known.values().map(|set| (set.ln_posterior - most).exp()).sum();
    let weighted = |Set { members, sizes, ln_posterior }| {
        let probability = (ln_posterior - most).exp() / total;
        Weighted { members, sizes, probability }
    };
    let mut all: Vec<Weighted> = known.into_values().map(weighted).collect();
    all.sort_by(|a, b| b.probability.total_cmp(&a.probability).then_with(|| a.members.cmp(&b.members)));
    all
}

/// ln p(r | all blocks) and of their prior.
pub(super) fn ln_posterior(blocks: &[Block], target: &Target, rules: &SelectionRules) -> Option<f64> {
    let all: Vec<usize> = (0..blocks.len()).collect();
    let set = assembled(&all, blocks, target, rules)?;
    Some(set.ln_posterior + over_noise(target.fit.residual().norm_squared(), &target.noise.grid()))
}

/// For each block that is tried the gain beside some others, its prior among it, and its most probable size.
pub(super) fn gains_beside(
    others: &[usize],
    tried: &[usize],
    (blocks, target): (&[Block], &Target),
    rules: &SelectionRules,
) -> Vec<(usize, f64, f64)> {
    let Some(conditioned) = Conditioned::on(others, (blocks, target), rules) else { return Vec::new() };
    let gain = |&block: &usize| {
        let (gain, size) = conditioned.odds(&blocks[block], target, rules);
        (block, gain, size)
    };
    tried.par_iter().map(gain).collect()
}

/// A set with these members, one after the other.
fn assembled(members: &[usize], blocks: &[Block], target: &Target, rules: &SelectionRules) -> Option<Set> {
    let mut set = Set { members: Vec::new(), sizes: Vec::new(), ln_posterior: 0.0 };
    for &member in members {
        let gain = Conditioned::new(&set, blocks, target)?.gain(&blocks[member], target, rules);
        set = set.with(member, gain, blocks);
    }
    Some(set)
}

fn sorted(members: &[usize]) -> Vec<usize> {
    let mut members = members.to_vec();
    members.sort_unstable();
    members
}
