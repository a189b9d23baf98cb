//! Sets of hypotheses by their probability: a beam search over sets of blocks of columns.

use crate::select::settings::{BEAM_WIDTH, LOG_ODDS_CUTOFF, MAX_EFFECTS, MAX_EXTENDING};
use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;

use super::products::{Products, ReducedProblem};
use super::replacements::add_replacements;
use super::set::{Set, assembled, best_first, extended, sorted};

/// Number of most probable sets in which the sizes of the members (1 σ of their coefficients) are
/// iterated to convergence at the end.
const MAX_SETTLED_SETS: usize = 32;

/// Smallest probability of a set that a search returns. All other sets together have less than 1e-12.
const MIN_LISTED_PROBABILITY: f64 = 1e-20;

/// Set of hypotheses with its probability among all sets evaluated.
#[derive(Debug, Clone)]
pub(super) struct EvaluatedSet {
    /// Indices of the hypotheses, in the order in which they were added.
    pub members: Vec<usize>,
    /// Most probable size of each member: 1 σ of its coefficients, in units of σ of the noise.
    pub sizes: Vec<f64>,
    pub probability: f64,
}

impl EvaluatedSet {
    /// Returns the members for which `is_removed` is false, in the order in which they were added.
    pub fn without(&self, is_removed: impl Fn(usize) -> bool) -> Vec<usize> {
        self.members.iter().copied().filter(|&member| !is_removed(member)).collect()
    }
}

/// Returns the sets that were evaluated, the most probable first, without impossible ones. The
/// empty set stands for noise alone.
///
/// The search starts from the empty set, from the set `present`, and from `present` without each of
/// its members. The most probable sets that an `earlier` search found among fewer hypotheses are
/// evaluated too, because among many similar hypotheses the search may not reach them again. If a
/// stop is requested, only some sets are evaluated.
pub(super) fn search(
    products: &Products,
    present: &[usize],
    earlier: &[EvaluatedSet],
) -> Vec<EvaluatedSet> {
    let Products { blocks, .. } = *products;
    let mut evaluated: BTreeMap<Vec<usize>, Set> = BTreeMap::new();
    let without = |k: usize| [&present[..k], &present[k + 1..]].concat();
    let starts = std::iter::once(Vec::new())
        .chain((0..present.len()).map(without))
        .chain([present.to_vec()]);
    for start in starts {
        if let Some(set) = assembled(&start, products) {
            evaluated.insert(set.key(), set);
        }
    }
    // A set with more members than the search allows is evaluated as it is, and with one more
    // member.
    let (longer, front): (usize, Vec<Set>) = match evaluated.get(&sorted(present)) {
        Some(all) if present.len() > MAX_EFFECTS => (1, vec![all.clone()]),
        _ => (MAX_EFFECTS, evaluated.values().cloned().collect()),
    };
    let (mut front, mut promising): (Vec<Set>, Option<Vec<usize>>) = (front, None);
    let every: Vec<usize> = (0..blocks.len()).collect();
    for _ in 0..longer {
        let mut next: BTreeMap<Vec<usize>, Set> = BTreeMap::new();
        if let Some(promising) = &promising {
            let members: BTreeSet<usize> =
                front.iter().flat_map(|set| set.members.iter().copied()).collect();
            products.form(members, promising);
        }
        for (place, set) in front.iter().enumerate() {
            let tried = promising.as_ref().filter(|_| place > 0).unwrap_or(&every);
            for longer in extended(set, tried, products) {
                let key = longer.key();
                let best = next.get(&key).or_else(|| evaluated.get(&key));
                if best.is_none_or(|other| longer.exceeds(other)) {
                    next.insert(key, longer);
                }
            }
        }
        // The search ends if larger sets fall behind the best one, which does not include sets that
        // cannot grow. It includes periodic errors with many orders, which are fitted first.
        let is_limit = |set: &&Set| !set.has_wide(blocks) || products.has_gear(&set.members);
        let can_grow = evaluated.values().filter(is_limit);
        let best_known = can_grow.map(|set| set.ln_posterior).fold(f64::NEG_INFINITY, f64::max);
        let mut sets: Vec<&Set> = next.values().collect();
        sets.sort_by(|a, b| best_first(a, b));
        promising.get_or_insert_with(|| {
            let mut promising: Vec<usize> = Vec::new();
            for last in sets.iter().filter_map(|set| set.members.last()) {
                if promising.len() < MAX_EXTENDING && !promising.contains(last) {
                    promising.push(*last);
                }
            }
            promising
        });
        sets.retain(|set| !set.has_wide(blocks));
        sets.truncate(BEAM_WIDTH);
        front = sets.into_par_iter().map(|set| set.clone().settled(products)).collect();
        evaluated.extend(next);
        front.sort_by(best_first);
        evaluated.extend(front.iter().map(|set| (set.key(), set.clone())));
        if front.first().is_none_or(|best| best.ln_posterior < best_known - LOG_ODDS_CUTOFF) {
            break;
        }
    }
    let again: Vec<Set> = earlier
        .par_iter()
        .take(MAX_SETTLED_SETS)
        .filter_map(|set| assembled(&set.members, products))
        .collect();
    for set in again {
        let entry = evaluated.entry(set.key()).or_insert_with(|| set.clone());
        if set.exceeds(entry) {
            *entry = set;
        }
    }
    add_replacements(&mut evaluated, products);
    add_periodic_errors(&mut evaluated, products);
    let mut likely: Vec<&Set> = evaluated.values().collect();
    likely.sort_by(|a, b| best_first(a, b));
    let likely: Vec<Set> = likely.into_iter().take(MAX_SETTLED_SETS).cloned().collect();
    let settled: Vec<Set> = likely.into_par_iter().map(|set| set.settled(products)).collect();
    evaluated.extend(settled.into_iter().map(|set| (set.key(), set)));
    let most = evaluated.values().map(|set| set.ln_posterior).fold(f64::NEG_INFINITY, f64::max);
    let total: f64 = evaluated.values().map(|set| (set.ln_posterior - most).exp()).sum();
    let with_probability = |Set { members, sizes, ln_posterior }| {
        let probability = (ln_posterior - most).exp() / total;
        EvaluatedSet { members, sizes, probability }
    };
    let mut evaluated_sets: Vec<EvaluatedSet> = evaluated
        .into_values()
        .map(with_probability)
        .filter(|set| set.probability > MIN_LISTED_PROBABILITY)
        .collect();
    evaluated_sets.sort_by(|a, b| {
        b.probability.total_cmp(&a.probability).then_with(|| a.members.cmp(&b.members))
    });
    evaluated_sets
}

/// Extends the empty set, and the most probable set with a periodic error, by periodic errors as
/// long as the set becomes more probable.
///
/// Sets with periodic errors are not extended otherwise, because they have many columns. Each of
/// several such errors alone may gain less than smaller functions. Two errors of one joint, with a
/// lower and a higher highest order, together describe coefficients that decrease with the order.
fn add_periodic_errors(evaluated: &mut BTreeMap<Vec<usize>, Set>, products: &Products) {
    let blocks = products.blocks;
    let gears: Vec<usize> =
        (0..blocks.len()).filter(|&block| blocks[block].is_periodic_of_many_orders).collect();
    let with_gear = evaluated.values().filter(|set| products.has_gear(&set.members));
    let best = with_gear.max_by(|a, b| best_first(b, a)).cloned();
    for start in evaluated.get(&Vec::new()).cloned().into_iter().chain(best) {
        let mut next = Some(start);
        while let Some(set) = next {
            let longer =
                extended(&set, &gears, products).into_iter().max_by(|a, b| best_first(b, a));
            // The sizes converge together; otherwise the errors of other joints would constrain
            // the first one too tightly.
            let longer = longer.map(|longer| longer.with_converged_sizes(products));
            next = longer.filter(|longer| longer.ln_posterior > set.ln_posterior);
            evaluated.extend(next.clone().map(|longer| (longer.key(), longer)));
        }
    }
}

/// Returns ln p(r | all blocks together), up to a constant, plus ln of their prior; `None` if a
/// factorisation fails.
pub(super) fn ln_posterior(products: &Products) -> Option<f64> {
    let every: Vec<usize> = (0..products.blocks.len()).collect();
    Some(assembled(&every, products)?.ln_posterior + products.ln_density(products.squares))
}

/// Returns the residual problem that a set with these members leaves at their most probable sizes;
/// `None` if a factorisation fails.
pub(super) fn reduced_by<'p, 'a>(
    members: &[usize],
    products: &'p Products<'a>,
) -> Option<ReducedProblem<'p, 'a>> {
    let set = assembled(members, products)?;
    products.reduced(&set.members, &set.sizes)
}

/// Returns, for each tried hypothesis, its index, its gain in ln posterior in addition to the
/// `others`, and its most probable size. Empty if the search was stopped.
pub(super) fn gains_beside(
    others: &[usize],
    tried: &[usize],
    products: &Products,
) -> Vec<(usize, f64, f64)> {
    let Some(left) = reduced_by(others, products) else { return Vec::new() };
    let gain = |(&block, (gain, size)): (&usize, (f64, f64))| {
        (block, gain + products.ln_prior(&products.blocks[block], others), size)
    };
    tried.iter().zip(left.gains(tried)).map(gain).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::*;
    use crate::fit::Stop;
    use crate::select::evidence::block::{Block, Design};
    use crate::select::evidence::marginal::{Coefficients, Noise};
    use crate::select::evidence::products::ResidualModel;
    use crate::select::neighbourhood::{LinearNeighbourhood, Unknowns};

    /// Returns a matrix of deterministic numbers without pattern, with root mean square about 1.
    fn matrix(rows: usize, columns: usize, seed: f64) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |i, j| {
            let value =
                ((12.9898 * i as f64 + 78.233 * j as f64 + seed).sin() * 43_758.545_3).fract();
            2.0 * 3.0_f64.sqrt() * (value.abs() - 0.5)
        })
    }

    /// Returns blocks and residual with two strong effects and a third, each of two columns, and
    /// noise.
    fn three(names: [usize; 3]) -> (Vec<Block>, ResidualModel) {
        let columns: Vec<DMatrix<f64>> =
            (0..3).map(|k| matrix(90, 2, 7.0 * f64::from(k))).collect();
        let residual = columns[0].column(0) * 60.0
            + columns[1].column(1) * 25.0
            + matrix(90, 1, 99.0).column(0);
        let unknowns = Unknowns { x: vec![0.0], priors: vec![None], active: DMatrix::zeros(0, 1) };
        let fit = LinearNeighbourhood::new(&matrix(90, 1, 55.0), &residual, &unknowns, 0);
        let block = |&k: &usize| {
            let design = Design::Dense(columns[k].clone()).scaled(30).unwrap();
            Block::new(design, &fit, -5.0, Coefficients::default())
        };
        let blocks = names.iter().map(block).collect();
        let noise = Noise { freedom: 89.0, ln_half_width: 0.1, min_ln_factor: 0.0 };
        (blocks, ResidualModel { fit, noise, alike: 0.0, stop: Stop::default() })
    }

    #[test]
    fn a_set_is_as_probable_in_whatever_order_it_was_taken() {
        let of = |names: [usize; 3], members: &[usize]| {
            let (blocks, residual_model) = three(names);
            assembled(members, &Products::new(&blocks, &residual_model)).unwrap().ln_posterior
        };
        let first = of([0, 1, 2], &[0, 1]);
        assert!(
            (first - of([1, 0, 2], &[0, 1])).abs() < 1e-6,
            "{first} {}",
            of([1, 0, 2], &[0, 1])
        );
        // In addition to two strong effects with their sizes, an absent effect gains nothing.
        assert!(of([0, 1, 2], &[0, 1, 2]) < first - 4.0);
    }

    #[test]
    fn two_that_a_third_does_for_are_found_where_one_alone_is_followed() {
        let (one, other, noise) = (matrix(90, 1, 3.0), matrix(90, 1, 11.0), matrix(90, 1, 99.0));
        let residual = (&one * 20.0 + &other * 20.0 + noise).column(0).into_owned();
        let unknowns = Unknowns { x: vec![0.0], priors: vec![None], active: DMatrix::zeros(0, 1) };
        let fit = LinearNeighbourhood::new(&matrix(90, 1, 55.0), &residual, &unknowns, 0);
        // The columns of the third effect are nearly the sum of both others, and the residual
        // contains nothing of it.
        let third = &one + &other + matrix(90, 1, 40.0) * 0.2;
        let block = |columns: &DMatrix<f64>| {
            let design = Design::Dense(columns.clone()).scaled(30).unwrap();
            let mut block = Block::new(design, &fit, -5.0, Coefficients::default());
            block.family = Some(String::new());
            block
        };
        let blocks = [&third, &one, &other].map(block);
        let residual_model = ResidualModel {
            fit: fit.clone(),
            noise: Noise { freedom: 89.0, ln_half_width: 0.1, min_ln_factor: 0.0 },
            alike: 0.0,
            stop: Stop::default(),
        };
        let found = search(&Products::new(&blocks, &residual_model), &[], &[]);
        assert_eq!(sorted(&found[0].members), [1, 2], "{found:?}");
        assert!(found[0].probability > 0.9, "{}", found[0].probability);
    }

    #[test]
    fn a_set_found_among_fewer_hypotheses_is_found_among_many_similar_ones() {
        let (one, other, noise) = (matrix(90, 1, 3.0), matrix(90, 1, 11.0), matrix(90, 1, 99.0));
        let residual = (&one * 20.0 + &other * 20.0 + noise).column(0).into_owned();
        let unknowns = Unknowns { x: vec![0.0], priors: vec![None], active: DMatrix::zeros(0, 1) };
        let fit = LinearNeighbourhood::new(&matrix(90, 1, 55.0), &residual, &unknowns, 0);
        let block = |columns: &DMatrix<f64>, ln_prior: f64| {
            let design = Design::Dense(columns.clone()).scaled(30).unwrap();
            let mut block = Block::new(design, &fit, ln_prior, Coefficients::default());
            block.family = Some(String::new());
            block
        };
        let similar = |k: u32| &one + &other + matrix(90, 1, 200.0 + f64::from(k)) * 0.02;
        let blocks: Vec<Block> = [block(&one, -5.0), block(&other, -5.0)]
            .into_iter()
            .chain((0..200).map(|k| block(&similar(k), -20.0)))
            .collect();
        let residual_model = ResidualModel {
            fit: fit.clone(),
            noise: Noise { freedom: 89.0, ln_half_width: 0.1, min_ln_factor: 0.0 },
            alike: 0.0,
            stop: Stop::default(),
        };
        let found = search(&Products::new(&blocks[..2], &residual_model), &[], &[]);
        assert_eq!(sorted(&found[0].members), [0, 1], "{found:?}");
        let anew = search(&Products::new(&blocks, &residual_model), &[], &[]);
        assert_ne!(sorted(&anew[0].members), [0, 1], "reached from the empty set");
        let again = search(&Products::new(&blocks, &residual_model), &[], &found);
        assert_eq!(sorted(&again[0].members), [0, 1]);
    }

    #[test]
    fn what_was_worked_out_before_further_hypotheses_came_changes_nothing() {
        let (blocks, residual_model) = three([2, 0, 1]);
        let fewer = Products::new(&blocks[..2], &residual_model);
        assert!(!search(&fewer, &[0], &[]).is_empty());
        let again =
            search(&Products::with_cache(fewer.into_cache(), &blocks, &residual_model), &[0], &[]);
        let anew = search(&Products::new(&blocks, &residual_model), &[0], &[]);
        assert_eq!(again.len(), anew.len());
        for (set, other) in again.iter().zip(&anew) {
            assert_eq!(set.members, other.members);
            assert!((set.probability - other.probability).abs() < 1e-9);
        }
    }
}
