//! Replacement of members of the most probable sets by one and by several other hypotheses.

use crate::select::settings::{BEAM_WIDTH, LOG_ODDS_CUTOFF, MAX_EXTENDING};
use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::block::Block;
use super::products::Products;
use super::set::{Set, assembled, best_first, extended, sorted};

/// Number of most probable sets in which a function of several covariates is replaced by two
/// hypotheses.
const MAX_SPLIT_SETS: usize = 3;
/// Largest number of members of a set at which pairs of members are replaced together.
const MAX_PAIRED_MEMBERS: usize = 6;
/// Maximum number of effects of the catalogue that together replace a composed law: its number of
/// terms.
const MAX_PARTS: usize = 3;
/// Maximum number of passes that replace members of the most probable sets found so far.
const MAX_EXCHANGES: usize = 4;

/// Adds sets that the stepwise search misses because the steps to them pass sets that explain less.
///
/// The function of several covariates is removed from probable sets, and each member and each pair
/// of members from the best set. One and two other hypotheses are then tried in their place. This
/// finds two causes that a third hypothesis, or a function of several covariates, explains almost
/// as well alone. Two members are replaced by effects only, because free functions would always
/// gain. A composed law is also replaced by several effects of the catalogue at its joint.
pub(super) fn add_replacements(evaluated: &mut BTreeMap<Vec<usize>, Set>, products: &Products) {
    let Products { blocks, .. } = *products;
    let every: Vec<usize> = (0..blocks.len()).collect();
    let of = |is_of: &dyn Fn(&Block) -> bool| -> Vec<usize> {
        every.iter().copied().filter(|&block| is_of(&blocks[block])).collect()
    };
    let (plain, laws) = (of(&|block| !block.is_surface), of(&|block| block.is_law()));
    // Entry k holds the hypotheses tried as first and as second replacement: of a function of
    // several covariates, of any other hypothesis, of two hypotheses, and of a composed law.
    let instead: [[&[usize]; 2]; 4] =
        [[&every, &plain], [&every, &laws], [&laws, &laws], [&every, &laws]];
    let mut tried: BTreeSet<(Vec<usize>, usize)> = BTreeSet::new();
    for _ in 0..MAX_EXCHANGES {
        let mut likely: Vec<&Set> =
            evaluated.values().filter(|set| !set.has_wide(blocks)).collect();
        let Some(best) = likely.iter().map(|set| set.ln_posterior).reduce(f64::max) else { return };
        likely.retain(|set| set.ln_posterior > best - LOG_ODDS_CUTOFF);
        likely.sort_by(|a, b| best_first(a, b));
        let is_surface = |member: &usize| blocks[*member].is_surface;
        let surfaces = likely
            .iter()
            .filter_map(|set| Some((vec![set.members.iter().copied().find(is_surface)?], *set)));
        let of_best = likely.iter().take(1).flat_map(|set| {
            members_and_pairs(&set.members).into_iter().map(move |removed| (removed, *set))
        });
        let mut rests: Vec<(Vec<usize>, Vec<usize>, usize)> = Vec::new();
        for (removed, set) in surfaces.take(MAX_SPLIT_SETS).chain(of_best) {
            let remaining: Vec<usize> =
                set.members.iter().copied().filter(|member| !removed.contains(member)).collect();
            let kind = match *removed.as_slice() {
                [only] if blocks[only].is_surface => 0,
                [only] if blocks[only].is_whole_law => 3,
                [_] => 1,
                _ => 2,
            };
            let key = sorted(&remaining);
            // If a single member was replaced beside the same other members before, most pairs of
            // laws were tried then.
            let is_tried = kind == 2 && [1, 3].iter().any(|&of| tried.contains(&(key.clone(), of)));
            if !is_tried && tried.insert((key, kind)) {
                rests.push((remaining, removed, kind));
            }
        }
        if rests.is_empty() {
            return;
        }
        let least = best - LOG_ODDS_CUTOFF;
        let of_rest = |(rest, removed, kind): (Vec<usize>, Vec<usize>, usize)| {
            replaced((&rest, &removed), instead[kind], least, products)
        };
        let new: Vec<Vec<Set>> = rests.into_par_iter().map(of_rest).collect();
        if products.residual_model.stop.is_requested() {
            return;
        }
        for set in new.into_iter().flatten() {
            let entry = evaluated.entry(set.key()).or_insert_with(|| set.clone());
            if set.exceeds(entry) {
                *entry = set;
            }
        }
    }
}

/// Returns sets with other hypotheses in place of the members `removed`: the members `rest` alone,
/// and `rest` with one and with two others. Sets with ln posterior below `least` are left out.
fn replaced(
    (rest, removed): (&[usize], &[usize]),
    [first, second]: [&[usize]; 2],
    least: f64,
    products: &Products,
) -> Vec<Set> {
    let Products { blocks, .. } = *products;
    let remaining =
        if products.residual_model.stop.is_requested() { None } else { assembled(rest, products) };
    let Some(remaining) = remaining else { return Vec::new() };
    let with_first = extended(&remaining, first, products);
    let mut new: Vec<&Set> = with_first.iter().collect();
    new.sort_by(|a, b| best_first(a, b));
    let second: BTreeSet<usize> =
        second.iter().copied().filter(|other| !removed.contains(other)).collect();
    let is_near = |set: &&Set| set.members.last().is_some_and(|last| second.contains(last));
    let near: Vec<&Set> = new.iter().copied().filter(is_near).take(MAX_EXTENDING).collect();
    let promising: Vec<usize> = near.iter().filter_map(|set| set.members.last().copied()).collect();
    let second: Vec<usize> = second.into_iter().collect();
    let narrow: Vec<&Set> =
        near.into_iter().filter(|set| !set.has_wide(blocks)).take(BEAM_WIDTH).collect();
    products.form(narrow.iter().filter_map(|set| set.members.last().copied()), &promising);
    let longer = |(place, &set): (usize, &&Set)| {
        extended(set, if place == 0 { &second } else { &promising }, products)
    };
    let mut two: Vec<Set> = narrow.iter().enumerate().flat_map(longer).collect();
    if let &[whole] = removed {
        two.extend(split_up(&with_first, &blocks[whole], products));
    }
    new.extend(&two);
    new.sort_by(|a, b| best_first(a, b));
    // With converged sizes, a set may be far more probable than with sizes found one after the
    // other.
    let (best, others) = new.split_at(new.len().min(BEAM_WIDTH));
    let settled: Vec<Set> = best.par_iter().map(|&set| set.clone().settled(products)).collect();
    let probable = others.iter().copied().filter(|set| set.ln_posterior > least).cloned();
    std::iter::once(remaining).chain(settled).chain(probable).collect()
}

/// Returns sets in which two and more effects of the catalogue at the joint of a composed law take
/// its place. `with_first` holds the sets with one hypothesis in its place. The laws of a joint
/// resemble one another so much that they would leave no room for these sets among the best ones.
fn split_up(with_first: &[Set], whole: &Block, products: &Products) -> Vec<Set> {
    let is_part = |&block: &usize| {
        let block = &products.blocks[block];
        whole.is_whole_law
            && block.joint.is_some()
            && block.joint == whole.joint
            && !block.is_whole_law
    };
    let parts: Vec<usize> = (0..products.blocks.len()).filter(is_part).collect();
    let has_part = |set: &&Set| set.members.last().is_some_and(is_part);
    let mut front: Vec<Set> = with_first.iter().filter(has_part).cloned().collect();
    let mut sets: Vec<Set> = Vec::new();
    for _ in 1..MAX_PARTS {
        let longer = front.iter().flat_map(|set| extended(set, &parts, products));
        let distinct: BTreeMap<Vec<usize>, Set> = longer.map(|set| (set.key(), set)).collect();
        front = distinct.into_values().collect();
        front.sort_by(best_first);
        front.truncate(BEAM_WIDTH);
        front = front.into_par_iter().map(|set| set.settled(products)).collect();
        sets.extend_from_slice(&front);
    }
    sets
}

/// Returns each member, and each pair of members if there are at most [`MAX_PAIRED_MEMBERS`].
fn members_and_pairs(members: &[usize]) -> Vec<Vec<usize>> {
    let single = members.iter().map(|&member| vec![member]);
    let few = if members.len() <= MAX_PAIRED_MEMBERS { members } else { &[] };
    let pairs = few
        .iter()
        .enumerate()
        .flat_map(|(k, &one)| few[k + 1..].iter().map(move |&other| vec![one, other]));
    single.chain(pairs).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use crate::fit::Stop;
    use crate::select::evidence::block::{Block, Design};
    use crate::select::evidence::marginal::{Coefficients, Noise};
    use crate::select::evidence::products::{Products, ResidualModel};
    use crate::select::evidence::search::search;
    use crate::select::evidence::set::sorted;
    use crate::select::neighbourhood::{LinearNeighbourhood, Unknowns};

    /// Returns a column of deterministic numbers without pattern.
    fn column(seed: f64) -> DMatrix<f64> {
        DMatrix::from_fn(90, 1, |i, _| {
            let value = ((12.9898 * i as f64 + seed).sin() * 43_758.545_3).fract();
            2.0 * 3.0_f64.sqrt() * (value.abs() - 0.5)
        })
    }

    #[test]
    fn two_effects_of_a_joint_are_tried_beside_many_composed_laws() {
        let (one, other) = (column(3.0), column(11.0));
        let residual = ((&one + &other) * 20.0 + column(99.0)).column(0).into_owned();
        let unknowns = Unknowns { x: vec![0.0], priors: vec![None], active: DMatrix::zeros(0, 1) };
        let fit = LinearNeighbourhood::new(&column(55.0), &residual, &unknowns, 0);
        let block = |columns: &DMatrix<f64>, ln_prior: f64, family: &str| {
            let design = Design::Dense(columns.clone()).scaled(30).unwrap();
            let mut block = Block::new(design, &fit, ln_prior, Coefficients::default());
            (block.family, block.joint) = (Some(family.to_owned()), Some(2));
            block.is_whole_law = family == "law";
            block
        };
        let mut blocks: Vec<Block> = (0..20)
            .map(|k| {
                let law = &one + &other + column(200.0 + 7.0 * f64::from(k)) * 0.01;
                block(&law, -25.0, "law")
            })
            .collect();
        blocks.extend([block(&one, -5.0, "joint-compliance"), block(&other, -5.0, "gear-ratio")]);
        let residual_model = ResidualModel {
            noise: Noise { freedom: 89.0, ln_half_width: 0.1, min_ln_factor: 0.0 },
            fit,
            alike: 0.0,
            stop: Stop::default(),
        };
        let found = search(&Products::new(&blocks, &residual_model), &[], &[]);
        assert_eq!(sorted(&found[0].members), [20, 21], "{:?}", found[0]);
    }
}
