//! Evidence for sets of hypotheses about a residual: effects, functions without a law, several
//! together, or none.
//!
//! Every hypothesis is a block of columns in the linear neighbourhood of a fit, with the fitted
//! parameters projected out. One closed-form marginal likelihood ([`marginal`]) compares sets of
//! them. The prior gives each family its weight, each additional member of a set odds of 1 to 2,
//! and each member a part of the weight of its family.
//!
//! Effects (laws) compete with functions without a law. These are smooth functions of the same
//! covariates at the same part, functions of two covariates, harmonics with changing amplitude and
//! phase, and a free value in every pose. A law is therefore probable only if it explains the
//! residual better than functions that need none.

mod block;
mod blocks;
mod cache;
mod candidate;
mod column_products;
mod columns;
mod elsewhere;
mod families;
mod few_columns;
mod finer;
mod functions;
mod hypotheses;
mod hypothesis;
mod laws;
mod likelihood_table;
mod limits;
mod marginal;
mod moves;
mod periodic;
mod posterior;
mod products;
mod reevaluation;
mod replacements;
mod sag;
mod search;
mod set;
mod settling;
mod sites;
mod waves;
mod wide_blocks;

use crate::select::settings::{MAX_STAND_INS, max_single_poses};
use std::collections::BTreeMap;
use std::collections::btree_map::Entry;

use super::data::Data;
use super::fitted::Fitted;
use crate::problem::Effect;
use block::Block;
use blocks::blocks;
use candidate::Candidate;
pub(super) use functions::Shape;
pub(super) use hypotheses::Hypotheses;
pub use hypothesis::HypothesisSet;
pub use hypothesis::{Hypothesis, HypothesisKind, Site};
pub(super) use posterior::odds_against;
pub use posterior::{Claims, Evidence};
use products::{CachedProducts, Products};
use reevaluation::single_supporting_pose;
pub(super) use reevaluation::{SubsetEvidence, subset_evidence};
use search::{EvaluatedSet, search};
use waves::Waves;

/// Number of trial shapes (bumps and steps), the best ones, about which finer shapes are tried.
const MAX_REFINED_SHAPES: usize = 4;

/// Returns ln of the marginal likelihood times the prior of the set that a fit contains: the
/// effects `added` by the search and functions without a law.
///
/// Sets with strong effects are compared by this value, each at the optimum of a fit of that set.
/// Each fit scales its residual by another σ′. The density is therefore that of the residual over
/// the common `sigma` σ \[m\], with ν degrees of freedom: ln p(r/σ) = ln p(r/σ′) + ν ln (σ/σ′).
///
/// `evidence` belongs to the first of the compared fits. `functions` holds each function with its
/// variant. Returns `None` if the residual is not finite.
pub(super) fn ln_posterior(
    fitted: &Fitted,
    data: &Data,
    (added, evidence): (&[Effect], &Evidence),
    (functions, sigma): (&[(Hypothesis, usize)], f64),
) -> Option<f64> {
    let rows = data.evidence_rows();
    let of_functions: Vec<Hypothesis> =
        functions.iter().map(|(function, _)| function.clone()).collect();
    let of_set = (added, of_functions.as_slice(), &evidence.others);
    let hypotheses = Hypotheses::of_set(fitted, data, of_set, &rows)
        .unwrap_or_else(|| Hypotheses::new(fitted, data, added, &rows, rows.len()));
    let is_in_set = |candidate: &&Candidate| match candidate.hypothesis.effect() {
        Some(effect) => hypotheses.added.contains(effect),
        None => functions.iter().any(|(function, variant)| {
            candidate.variant == *variant && candidate.hypothesis == *function
        }),
    };
    let members: Vec<&Candidate> = hypotheses.candidates.iter().filter(is_in_set).collect();
    let (blocks, residual_model) = blocks(fitted, data, &hypotheses, &members, &evidence.left_out)?;
    Some(
        search::ln_posterior(&Products::new(&blocks, &residual_model))?
            - residual_model.noise.freedom * (fitted.sigma / sigma).ln(),
    )
}

/// Returns the most probable form of a function without a law beside the effects of the fit: a bump
/// or a step, or `None` for the smooth function of the set `best`. Also returns 1 σ of its
/// coefficients, in units of σ of the noise.
pub(super) fn best_form(
    fitted: &Fitted,
    data: &Data,
    hypotheses: &Hypotheses,
    best: &HypothesisSet,
    hypothesis: &Hypothesis,
) -> Option<(Option<Shape>, f64)> {
    let smooth = hypotheses.candidate(best, hypothesis)?;
    let evidence_poses = hypotheses.linearised.poses().len();
    let gains = |forms: &[&Candidate]| {
        let (blocks, residual_model) = blocks(fitted, data, hypotheses, forms, &[])?;
        let all_blocks: Vec<usize> = (0..blocks.len()).collect();
        let mut gains =
            search::gains_beside(&[], &all_blocks, &Products::new(&blocks, &residual_model));
        gains.sort_by(|a, b| b.1.total_cmp(&a.1));
        Some(gains)
    };
    let mut shapes = Shape::all();
    let coarse = hypotheses.shaped(hypothesis, evidence_poses, &shapes);
    let best_of = |(k, ..): &(usize, f64, f64)| coarse[*k].0.finer();
    if !coarse.is_empty() {
        let found = gains(&coarse.iter().map(|(_, candidate)| candidate).collect::<Vec<_>>())?;
        shapes = found.iter().take(MAX_REFINED_SHAPES).flat_map(best_of).collect();
    }
    let finer = hypotheses.shaped(hypothesis, evidence_poses, &shapes);
    let forms: Vec<&Candidate> =
        std::iter::once(smooth).chain(finer.iter().map(|(_, candidate)| candidate)).collect();
    // Half of the prior probability belongs to the smooth function, the other half to all shapes
    // together.
    let even = |(k, gain, size): (usize, f64, f64)| {
        (k, if k == 0 { gain - smooth.ln_prior } else { gain }, size)
    };
    let (k, _, size) = gains(&forms)?.into_iter().map(even).max_by(|a, b| a.1.total_cmp(&b.1))?;
    Some((k.checked_sub(1).map(|shaped| finer[shaped].0), size))
}

/// Evaluates the evidence about the residual of a fit, with the effects `added` by the search
/// removed from it. Poses that alone support an effect are left out.
///
/// Returns `None` if the residual is not finite (a pose without equilibrium), or if the search was
/// stopped.
pub(super) fn evaluate(fitted: &Fitted, data: &Data, added: &[Effect]) -> Option<Evidence> {
    let (mut left_out, most) = (Vec::new(), max_single_poses(data.evidence_rows().len()));
    loop {
        let (evidence, hypotheses) = evaluate_without(fitted, data, added, &left_out)?;
        match single_supporting_pose(fitted, data, (&evidence, &hypotheses)) {
            Some(pose) if left_out.len() < most => left_out.push(pose),
            _ => return Some(evidence),
        }
    }
}

/// Evaluates the evidence without the poses `left_out`. Also returns the hypotheses that were
/// evaluated.
fn evaluate_without<'a>(
    fitted: &'a Fitted,
    data: &Data<'a>,
    added: &[Effect],
    left_out: &[usize],
) -> Option<(Evidence, Hypotheses<'a>)> {
    let rows = data.evidence_rows();
    let mut hypotheses = Hypotheses::new(fitted, data, added, &rows, rows.len());
    let (mut blocks, residual_model) = blocks(
        fitted,
        data,
        &hypotheses,
        &hypotheses.candidates.iter().collect::<Vec<_>>(),
        left_out,
    )?;
    let is_present = |candidate: &Candidate| {
        candidate.hypothesis.effect().is_some_and(|effect| hypotheses.added.contains(effect))
    };
    let present: Vec<usize> =
        (0..blocks.len()).filter(|&k| is_present(&hypotheses.candidates[k])).collect();
    let mut explanations: Vec<HypothesisSet> = Vec::new();
    let (mut evaluated_sets, unlisted, mut cache) = {
        let products = Products::new(&blocks, &residual_model);
        let evaluated_sets = search(&products, &present, &[]);
        if data.stop.is_requested() {
            return None;
        }
        // A periodic error with many orders is fitted before arguments of other effects are
        // searched.
        let has_gear = evaluated_sets.first().is_some_and(|set| products.has_gear(&set.members));
        let unlisted = if has_gear {
            Vec::new()
        } else {
            let waves = Waves { hypotheses: &hypotheses, products: &products, fitted, left_out }
                .promising(&evaluated_sets);
            let times = (&products, hypotheses.times.as_slice());
            let moves = moves::promising(&hypotheses, &evaluated_sets, times, (fitted, left_out));
            [waves, moves].concat()
        };
        let laws =
            laws::promising(&hypotheses, &evaluated_sets, &products, (fitted, data, left_out));
        (evaluated_sets, [unlisted, laws].concat(), products.into_cache())
    };
    let blocks_of =
        |some: &[Candidate]| Candidate::blocks(some, (fitted, &residual_model.fit), left_out);
    let search_again = |cache: CachedProducts, blocks: &[Block], earlier: &[EvaluatedSet]| {
        let products = Products::with_cache(cache, blocks, &residual_model);
        (search(&products, &present, earlier), products.into_cache())
    };
    if !unlisted.is_empty() {
        blocks.extend(blocks_of(&unlisted));
        hypotheses.candidates.extend(unlisted);
        (evaluated_sets, cache) = search_again(cache, &blocks, &evaluated_sets);
    }
    let products = Products::with_cache(cache, &blocks, &residual_model);
    let finer = finer::finer_candidates(
        &hypotheses,
        &evaluated_sets,
        &products,
        blocks_of,
        &fitted.problem,
    );
    cache = products.into_cache();
    if !finer.is_empty() {
        blocks.extend(blocks_of(&finer));
        hypotheses.candidates.extend(finer);
        (evaluated_sets, cache) = search_again(cache, &blocks, &evaluated_sets);
    }
    let of = |k: usize| &hypotheses.candidates[k].hypothesis;
    if data.stop.is_requested() {
        return None;
    }
    // Functions of the same covariate with different lengths belong to one hypothesis.
    let (mut numbers, mut distinct): (BTreeMap<usize, usize>, Vec<usize>) =
        (BTreeMap::new(), Vec::new());
    let mut number = |member: usize| {
        *numbers.entry(member).or_insert_with(|| {
            let place = distinct.iter().position(|&earlier| of(earlier).is_same_claim(of(member)));
            place.unwrap_or_else(|| {
                distinct.push(member);
                distinct.len() - 1
            })
        })
    };
    let mut places: BTreeMap<Vec<usize>, usize> = BTreeMap::new();
    for EvaluatedSet { members, sizes, probability } in
        evaluated_sets.into_iter().filter(|set| set.probability > posterior::MIN_KEPT_PROBABILITY)
    {
        let mut members_of_set: Vec<usize> = members.iter().map(|&member| number(member)).collect();
        members_of_set.sort_unstable();
        match places.entry(members_of_set) {
            Entry::Occupied(place) => explanations[*place.get()].probability += probability,
            Entry::Vacant(place) => {
                place.insert(explanations.len());
                let members_of_set = members.iter().map(|&member| of(member).clone()).collect();
                let variants =
                    members.into_iter().map(|member| hypotheses.candidates[member].variant);
                let functions = variants.zip(sizes).collect();
                explanations.push(HypothesisSet {
                    hypotheses: members_of_set,
                    probability,
                    functions,
                });
            }
        }
    }
    explanations.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    let mut evidence = Evidence {
        sets: explanations,
        stand_ins: Vec::new(),
        left_out: left_out.to_vec(),
        others: hypotheses.others.clone(),
    };
    if let Some(best) = evidence.certain_set(data.rules.inclusion_threshold)
        && best.gears().is_empty()
    {
        let products = Products::with_cache(cache, &blocks, &residual_model);
        evidence.stand_ins = stand_ins(best, &hypotheses, &products);
    }
    Some((evidence, hypotheses))
}

/// Returns pairs of a member of the set `best` and an effect that may replace it, for each member
/// the best effects first. Each effect gains more than half as much in ln probability as the
/// member. One effect is listed of each family at each site.
fn stand_ins(
    best: &HypothesisSet,
    hypotheses: &Hypotheses,
    products: &Products,
) -> Vec<(Hypothesis, Hypothesis)> {
    let effect = |k: usize| hypotheses.candidates[k].hypothesis.effect();
    let tried: Vec<usize> = (0..products.blocks.len()).filter(|&k| effect(k).is_some()).collect();
    let number = |(member, (variant, _)): (&Hypothesis, &(usize, f64))| {
        hypotheses
            .candidates
            .iter()
            .position(|candidate| candidate.variant == *variant && candidate.hypothesis == *member)
    };
    let members: Vec<usize> =
        best.hypotheses.iter().zip(&best.functions).filter_map(number).collect();
    let mut stand_ins = Vec::new();
    for &member in &members {
        let others: Vec<usize> = members.iter().copied().filter(|&other| other != member).collect();
        let mut gains = search::gains_beside(&others, &tried, products);
        let of_member = search::gains_beside(&others, &[member], products);
        let least = of_member.first().map_or(f64::INFINITY, |(_, gain, _)| 0.5 * gain);
        gains.retain(|(k, gain, _)| *gain > least && !members.contains(k));
        gains.sort_by(|a, b| b.1.total_cmp(&a.1));
        let name = |k: usize| effect(k).map(Effect::name_and_place).unwrap_or_default();
        let mut listed_names = vec![name(member)];
        for (k, ..) in gains {
            if !listed_names.contains(&name(k)) && listed_names.len() <= MAX_STAND_INS {
                listed_names.push(name(k));
                stand_ins.push((
                    hypotheses.candidates[member].hypothesis.clone(),
                    hypotheses.candidates[k].hypothesis.clone(),
                ));
            }
        }
    }
    stand_ins
}
