//! Conversion of candidate hypotheses to blocks of columns of one linear model.

use crate::select::settings::{
    PRIOR_OF_SAME_FAMILY, SPREAD_OF_DECLARED_NOISE, SPREAD_OF_ESTIMATED_NOISE,
};
use rayon::prelude::*;

use super::block::Block;
use super::candidate::{Candidate, HYPOTHESES_PER_PROJECTION};
use super::hypotheses::Hypotheses;
use super::marginal;
use super::products::{Products, ResidualModel};
use super::waves::Waves;
use crate::fit::Noise;
use crate::problem::Effect;
use crate::select::data::Data;
use crate::select::fitted::Fitted;

/// Returns the blocks of `candidates` and the residual that they are to explain, with the fitted
/// parameters projected out. Poses with the indices `left_out` are not used. `None` if the residual
/// is not finite or the search was stopped.
pub(super) fn blocks(
    fitted: &Fitted,
    data: &Data,
    hypotheses: &Hypotheses,
    candidates: &[&Candidate],
    left_out: &[usize],
) -> Option<(Vec<Block>, ResidualModel)> {
    let linearised = hypotheses.linearised.without(left_out);
    let neighbourhood = fitted.neighbourhood_without(&linearised, &hypotheses.unknowns);
    if !neighbourhood.residual().iter().all(|value| value.is_finite()) {
        return None;
    }
    // A declared σ that is larger than the scatter about the fit does not bound the noise from
    // below. The scatter is then used, as if no σ were declared.
    let bounds_noise = fitted.found.noise == Noise::Declared && fitted.found.sigma_scale >= 1.0;
    let unless_stopped = |some: &[&Candidate]| {
        (!data.stop.is_requested())
            .then(|| Candidate::blocks(some.iter().copied(), (fitted, &neighbourhood), left_out))
    };
    let blocks: Vec<Vec<Block>> = candidates
        .par_chunks(HYPOTHESES_PER_PROJECTION)
        .map(unless_stopped)
        .collect::<Option<_>>()?;
    let mut blocks: Vec<Block> = blocks.into_iter().flatten().collect();
    let rows = data.evidence_rows();
    let is_aside = |&(pose, row): &(usize, &usize)| {
        !left_out.contains(&pose) && fitted.set_aside.contains(row)
    };
    let numbers = |pose: usize| hypotheses.linearised.coordinates(pose);
    let without_weight = left_out.iter().map(|&pose| numbers(pose)).sum::<usize>()
        + rows.iter().enumerate().filter(is_aside).map(|(pose, _)| numbers(pose)).sum::<usize>();
    let noise = marginal::Noise {
        freedom: (neighbourhood.sums().freedom() - without_weight as f64).max(1.0),
        ln_half_width: if bounds_noise {
            SPREAD_OF_DECLARED_NOISE
        } else {
            SPREAD_OF_ESTIMATED_NOISE
        },
        min_ln_factor: if bounds_noise { 0.0 } else { f64::NEG_INFINITY },
    };
    let alike = (PRIOR_OF_SAME_FAMILY.ln() - hypotheses.ln_family - 2.0_f64.ln()).max(0.0);
    let residual_model =
        ResidualModel { fit: neighbourhood, noise, alike, stop: data.stop.clone() };
    let is_added = |&k: &usize| {
        candidates[k].hypothesis.effect().is_some_and(|effect| hypotheses.added.contains(effect))
    };
    let added: Vec<usize> = (0..candidates.len()).filter(is_added).collect();
    let effects: Vec<&Effect> =
        added.iter().filter_map(|&k| candidates[k].hypothesis.effect()).collect();
    let products = Products::new(&blocks, &residual_model);
    let waves = Waves { hypotheses, products: &products, fitted, left_out };
    let ln_likelihood_widths = waves.ln_likelihood_widths(&added, &effects);
    for (k, ln_width) in ln_likelihood_widths {
        blocks[k].ln_prior += ln_width;
    }
    Some((blocks, residual_model))
}
