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

/// Displacement, in units of σ, that stands for zero: sizes have a reciprocal.
const SIZE_OF_ZERO: f64 = 1e-9;

/// A hypothesis with its columns and the logarithm of its prior probability.
#[derive(Clone)]
pub(super) struct Candidate {
    pub hypothesis: Hypothesis,
    /// Number of the function among those of that hypothesis, from 0.
    pub variant: usize,
    /// Columns of root mean square 1 all together.
    pub design: Design,
    pub ln_prior: f64,
    pub coefficients: Coefficients,
}

/// Number of hypotheses whose columns are projected together.
pub(super) const HYPOTHESES_PER_PROJECTION: usize = 32;

impl Candidate {
    /// Returns the blocks of candidates: their columns with everything fitted projected out, some
    /// poses left out.
    pub fn blocks(
        all: &[&Self],
        (fitted, fit): (&Fitted, &LinearNeighbourhood),
        left_out: &[usize],
    ) -> Vec<Block> {
        let design = |candidate: &&Self| {
            let mut coefficients = candidate.coefficients.clone();
            if fitted.found.noise != Noise::Declared {
                // A σ from a residual that holds the effect says nothing of how large that is.
                coefficients.largest.fill(f64::INFINITY);
            }
            (candidate.design.clone().without(left_out), candidate.ln_prior, coefficients)
        };
        let mut blocks = Block::all(all.iter().map(design).collect(), fit);
        for (block, candidate) in blocks.iter_mut().zip(all) {
            block.family = candidate.hypothesis.effect().map(|effect| effect.name().to_owned());
            block.is_gear = matches!(candidate.hypothesis.kind, HypothesisKind::Gear(_));
            block.is_surface = !block.is_law() && candidate.hypothesis.depends_on.len() > 1;
        }
        blocks
    }
}

/// Returns the joint, from 0, and the order of a wave of any order.
pub(super) fn order_of(effect: &Effect) -> Option<(usize, f64)> {
    if let Effect::JointWave { joint, order } = effect { Some((joint - 1, *order)) } else { None }
}

/// Scales the columns of an effect at the first `weighed` poses to one length. Also returns the
/// root mean square displacements, in units of σ, that the largest plausible values of its
/// parameters cause.
pub(super) fn even(
    mut columns: DMatrix<f64>,
    terms: &[Term],
    weighed: usize,
) -> (DMatrix<f64>, Vec<f64>) {
    let mut largest = Vec::new();
    for (k, mut column) in columns.column_iter_mut().enumerate() {
        let length = column.rows(0, 3 * weighed).norm();
        let most = terms.get(k).map_or(f64::INFINITY, |term| MAX_PLAUSIBLE * term.size);
        largest.push(if length > 0.0 {
            most * length / ((3 * weighed) as f64).sqrt()
        } else {
            SIZE_OF_ZERO
        });
        if length > 0.0 {
            column /= length;
        }
    }
    (columns, largest)
}
