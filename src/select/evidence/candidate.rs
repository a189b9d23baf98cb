//! A hypothesis with its columns, and its columns as a block.

use nalgebra::DMatrix;

use super::block::{Block, Design};
use super::hypothesis::Hypothesis;
use super::marginal::Coefficients;
use crate::fit::Noise;
use crate::model::effect::Term;
use crate::problem::Effect;
use crate::select::fitted::Fitted;
use crate::select::neighbourhood::LinearNeighbourhood;
use crate::select::rules::SelectionRules;

/// Largest displacement, in units of σ, by a parameter that moves nothing: above zero, for sizes
/// have a reciprocal.
const NOTHING: f64 = 1e-9;

/// A hypothesis with its columns and the logarithm of its prior probability.
#[derive(Clone)]
pub(super) struct Candidate {
    pub hypothesis: Hypothesis,
    /// Which of the functions of that hypothesis, counted from 0.
    pub variant: usize,
    /// Of root mean square 1 all together.
    pub design: Design,
    pub ln_prior: f64,
    pub coefficients: Coefficients,
}

/// Hypotheses whose columns are projected together.
pub(super) const TOGETHER: usize = 32;

impl Candidate {
    /// Their columns with everything that is fitted projected out, some poses left out.
    pub fn blocks(
        all: &[&Self],
        (fitted, fit): (&Fitted, &LinearNeighbourhood),
        left_out: &[usize],
    ) -> Vec<Block> {
        let design = |own: &&Self| {
            let mut coefficients = own.coefficients.clone();
            if fitted.found.noise != Noise::Declared {
                // A σ from a residual that holds the effect says nothing of how large that is.
                coefficients.largest.fill(f64::INFINITY);
            }
            (own.design.clone().without(left_out), own.ln_prior, coefficients)
        };
        let mut blocks = Block::all(all.iter().map(design).collect(), fit);
        for (block, own) in blocks.iter_mut().zip(all) {
            block.family = own.hypothesis.effect().map(|effect| effect.name().to_owned());
            block.is_surface = !block.is_law() && own.hypothesis.depends_on.len() > 1;
        }
        blocks
    }
}

/// Joint, from 0, and order of a wave of any order.
pub(super) fn order_of(effect: &Effect) -> Option<(usize, f64)> {
    if let Effect::JointWave { joint, order } = effect { Some((joint - 1, *order)) } else { None }
}

/// Columns of an effect at the first poses, `weighed` ones, of one length, and the root mean square
/// displacements, in units of σ, that the largest plausible values of its parameters cause: of
/// several units, each alone moves the poses as much as the others.
pub(super) fn even(
    mut columns: DMatrix<f64>,
    terms: &[Term],
    weighed: usize,
    rules: &SelectionRules,
) -> (DMatrix<f64>, Vec<f64>) {
    let mut largest = Vec::new();
    for (k, mut column) in columns.column_iter_mut().enumerate() {
        let length = column.rows(0, 3 * weighed).norm();
        let most = terms.get(k).map_or(f64::INFINITY, |term| rules.plausible * term.size);
        largest.push(if length > 0.0 {
            most * length / ((3 * weighed) as f64).sqrt()
        } else {
            NOTHING
        });
        if length > 0.0 {
            column /= length;
        }
    }
    (columns, largest)
}
