//! Residuals and Jacobian of all items at once, without reduction.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::{Block, CHUNK_ITEMS, LeastSquares};
use crate::numeric::parallel;
use crate::numeric::zeros;

/// Returns all residuals r(x) in one vector.
pub fn residual_vector<P: LeastSquares>(problem: &P, x: &DVector<f64>) -> DVector<f64> {
    let (items, rows) = (problem.items(), problem.rows_per_item());
    let mut residuals = DVector::zeros(items * rows);
    if items <= CHUNK_ITEMS {
        problem.residuals(x, 0..items, residuals.as_mut_slice());
        return residuals;
    }
    parallel::write_chunks(residuals.as_mut_slice(), (CHUNK_ITEMS * rows).max(1), &|chunk, out| {
        let first = chunk * CHUNK_ITEMS;
        problem.residuals(x, first..items.min(first + CHUNK_ITEMS), out);
    });
    residuals
}

/// Returns the Jacobian ∂r/∂x, shape = (m, n), and all residuals, computed in parallel.
pub fn jacobian_and_residual<P: LeastSquares>(
    problem: &P,
    x: &DVector<f64>,
) -> (DMatrix<f64>, DVector<f64>) {
    let (items, rows, n) = (problem.items(), problem.rows_per_item(), problem.parameters());
    let (column_rows, chunk_rows) = ((rows * items).max(1), (rows * CHUNK_ITEMS).max(1));
    let mut jacobian = zeros(rows * items, n);
    let mut residual = DVector::zeros(rows * items);
    // Each part holds the slices of all columns that belong to one chunk.
    let mut parts: Vec<Vec<&mut [f64]>> = Vec::new();
    parts.resize_with(items.div_ceil(CHUNK_ITEMS), || Vec::with_capacity(n + 1));
    for column in jacobian.as_mut_slice().chunks_mut(column_rows).chain([residual.as_mut_slice()]) {
        parts
            .iter_mut()
            .zip(column.chunks_mut(chunk_rows))
            .for_each(|(slices, part)| slices.push(part));
    }
    let write = |block: &mut Block, (chunk, part): (usize, Vec<&mut [f64]>)| {
        let chunk_items = chunk * CHUNK_ITEMS..((chunk + 1) * CHUNK_ITEMS).min(items);
        block.reshape(rows * chunk_items.len());
        problem.linearise(x, chunk_items, block);
        part.into_iter().enumerate().for_each(|(j, out)| out.copy_from_slice(block.column(j)));
    };
    parts.into_par_iter().enumerate().for_each_init(|| Block::zeros(0, n), write);
    (jacobian, residual)
}

/// Returns the Jacobian ∂r/∂x, shape = (m, n).
pub fn jacobian<P: LeastSquares>(problem: &P, x: &DVector<f64>) -> DMatrix<f64> {
    jacobian_and_residual(problem, x).0
}

#[cfg(test)]
mod tests {
    use std::ops::Range;

    use super::*;

    /// Problem with residuals rᵢ = (i x₁², x₂ − i).
    struct Rows(usize);

    impl LeastSquares for Rows {
        fn parameters(&self) -> usize {
            2
        }

        fn items(&self) -> usize {
            self.0
        }

        fn rows_per_item(&self) -> usize {
            2
        }

        fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]) {
            for (i, item) in items.zip(out.chunks_exact_mut(2)) {
                item.copy_from_slice(&[i as f64 * x[0] * x[0], x[1] - i as f64]);
            }
        }

        fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block) {
            let first = items.start;
            for i in items {
                let row = 2 * (i - first);
                block.column_mut(0)[row] = 2.0 * i as f64 * x[0];
                block.column_mut(1)[row + 1] = 1.0;
                block.column_mut(2)[row..row + 2]
                    .copy_from_slice(&[i as f64 * x[0] * x[0], x[1] - i as f64]);
            }
        }
    }

    #[test]
    fn rows_of_many_parts_keep_their_places() {
        let x = DVector::from_vec(vec![1.5, -2.0]);
        for items in [0, 3, CHUNK_ITEMS, 2 * CHUNK_ITEMS + 7] {
            let residual = DVector::from_fn(2 * items, |k, _| {
                let i = (k / 2) as f64;
                if k % 2 == 0 { i * 2.25 } else { -2.0 - i }
            });
            let slope = |k: usize, j: usize| match (k % 2, j) {
                (0, 0) => 3.0 * (k / 2) as f64,
                (1, 1) => 1.0,
                _ => 0.0,
            };
            assert_eq!(residual_vector(&Rows(items), &x), residual);
            assert_eq!(
                jacobian_and_residual(&Rows(items), &x),
                (DMatrix::from_fn(2 * items, 2, slope), residual)
            );
        }
    }
}
