//! All rows of a problem at once, for those who need them as they are.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::{Block, CHUNK_ITEMS, LeastSquares};
use crate::numeric::zeros;

/// All residuals r(x) in one vector.
pub fn residual_vector<P: LeastSquares>(problem: &P, x: &DVector<f64>) -> DVector<f64> {
    let (items, rows) = (problem.items(), problem.rows_per_item());
    let mut residuals = DVector::zeros(items * rows);
    if items <= CHUNK_ITEMS {
        problem.residuals(x, 0..items, residuals.as_mut_slice());
        return residuals;
    }
    let chunks = residuals.as_mut_slice().par_chunks_mut((CHUNK_ITEMS * rows).max(1)).enumerate();
    chunks.for_each(|(chunk, out)| {
        let first = chunk * CHUNK_ITEMS;
        problem.residuals(x, first..items.min(first + CHUNK_ITEMS), out);
    });
    residuals
}

/// The whole Jacobian ∂r/∂x, m × n, and all residuals; parts of the items on every core.
pub fn jacobian_and_residual<P: LeastSquares>(problem: &P, x: &DVector<f64>) -> (DMatrix<f64>, DVector<f64>) {
    let (items, rows, n) = (problem.items(), problem.rows_per_item(), problem.parameters());
    let of_chunk = |chunk: usize| {
        let own = chunk * CHUNK_ITEMS..((chunk + 1) * CHUNK_ITEMS).min(items);
        let mut block = Block::zeros(rows * own.len(), n);
        problem.linearise(x, own, &mut block);
        block
    };
    let blocks: Vec<Block> = (0..items.div_ceil(CHUNK_ITEMS)).into_par_iter().map(of_chunk).collect();
    let mut jacobian = zeros(rows * items, n);
    let mut residual = DVector::zeros(rows * items);
    let gather = |(j, column): (usize, &mut [f64])| {
        column
            .chunks_mut((rows * CHUNK_ITEMS).max(1))
            .zip(&blocks)
            .for_each(|(out, own)| out.copy_from_slice(own.column(j)));
    };
    jacobian.as_mut_slice().par_chunks_mut((rows * items).max(1)).enumerate().for_each(gather);
    gather((n, residual.as_mut_slice()));
    (jacobian, residual)
}

/// The whole Jacobian ∂r/∂x, m × n.
pub fn jacobian<P: LeastSquares>(problem: &P, x: &DVector<f64>) -> DMatrix<f64> {
    jacobian_and_residual(problem, x).0
}
