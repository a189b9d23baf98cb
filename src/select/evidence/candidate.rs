//! Hypothesis with its columns.

use crate::select::settings::MAX_PLAUSIBLE;
use nalgebra::DMatrix;

use super::block::{Block, Design};
use super::hypothesis::{Hypothesis, HypothesisKind};
use super::marginal::Coefficients;
use crate::fit::Noise;
use crate::model::effect::Term;
use crate::problem::Effect;
use crate::select::fitted::Fitted;
use crate::select::neighbourhood::LinearNeighbourhood;

/// Smallest value of the largest plausible displacement by a coefficient, in units of σ. It avoids
/// division by zero.
const MIN_PLAUSIBLE_SIZE: f64 = 1e-9;

/// Hypothesis with its columns and the logarithm of its prior probability.
#[derive(Clone)]
pub(super) struct Candidate {
    pub hypothesis: Hypothesis,
    /// Index of the candidate among the functions of its hypothesis, which differ in smoothness,
    /// for example.
    pub variant: usize,
    /// Columns, scaled together to root mean square 1.
    pub design: Design,
    /// ln of the prior probability of the hypothesis with this function.
    pub ln_prior: f64,
    /// Prior on the coefficients of the columns.
    pub coefficients: Coefficients,
}

/// Number of hypotheses whose columns are projected in one matrix product.
pub(super) const HYPOTHESES_PER_PROJECTION: usize = 32;

impl Candidate {
    /// Returns the blocks of candidates: their columns with the fitted parameters projected out and
    /// the rows of the poses `left_out` set to zero.
    pub fn blocks<'a>(
        candidates: impl IntoIterator<Item = &'a Self> + Clone,
        (fitted, fit): (&Fitted, &LinearNeighbourhood),
        left_out: &[usize],
    ) -> Vec<Block> {
        let design = |candidate: &Self| {
            let mut coefficients = candidate.coefficients.clone();
            if fitted.found.noise != Noise::Declared {
                // If σ was estimated from a residual that contains the effect, it cannot limit the
                // size of the effect.
                coefficients.largest.fill(f64::INFINITY);
            }
            (candidate.design.clone().without(left_out), candidate.ln_prior, coefficients)
        };
        let designs = candidates.clone().into_iter().map(design).collect();
        let mut blocks = Block::all(designs, fit);
        for (block, candidate) in blocks.iter_mut().zip(candidates) {
            block.family = candidate.hypothesis.effect().map(|effect| effect.name().to_owned());
            let effect = candidate.hypothesis.effect();
            block.joint = effect.filter(|effect| effect.acts_at_joint()).and_then(Effect::joint);
            block.is_whole_law = effect.is_some_and(Effect::is_composed);
            block.is_periodic_of_many_orders =
                matches!(candidate.hypothesis.kind, HypothesisKind::Gear(_));
            block.is_surface = !block.is_law() && candidate.hypothesis.depends_on.len() > 1;
        }
        blocks
    }
}

/// Returns joint (from 0) and order of a wave; `None` for other effects.
pub(super) fn joint_and_order(effect: &Effect) -> Option<(usize, f64)> {
    if let Effect::JointWave { joint, order } = effect { Some((joint - 1, *order)) } else { None }
}

/// Scales the columns of an effect to equal length over the first `evidence_poses` poses. Also
/// returns, for each parameter, the root mean square displacement by its largest plausible value,
/// in units of σ. Returns `None` if the effect displaces no pose.
pub(super) fn scaled_to_equal_length(
    mut columns: DMatrix<f64>,
    terms: &[Term],
    evidence_poses: usize,
) -> Option<(Design, Vec<f64>)> {
    let mut largest = Vec::new();
    for (k, mut column) in columns.column_iter_mut().enumerate() {
        let length = column.rows(0, 3 * evidence_poses).norm();
        let most = terms.get(k).map_or(f64::INFINITY, |term| MAX_PLAUSIBLE * term.size);
        largest.push(if length > 0.0 {
            most * length / ((3 * evidence_poses) as f64).sqrt()
        } else {
            MIN_PLAUSIBLE_SIZE
        });
        if length > 0.0 {
            column /= length;
        }
    }
    Some((Design::Dense(columns).scaled(evidence_poses)?, largest))
}
