//! Products of tall matrices on every core: each column of the result is one thread's, so that they are the same to the bit for any
//! number of threads.

use nalgebra::DMatrix;
use rayon::prelude::*;

/// Columns of a result that one thread forms at a time: each time the other matrix is packed anew.
const TOGETHER: usize = 96;
/// Multiplications below which threads cost more than they save.
const WORTH_THREADS: usize = 1 << 20;

/// A B.
pub(crate) fn product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    product_of(a, b, |_| a.ncols())
}

/// A B of a square upper triangle B.
pub(crate) fn product_with_upper(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    product_of(a, b, |columns| columns)
}

/// A B, of which the first columns, so many, have nothing below so many rows of B.
fn product_of(a: &DMatrix<f64>, b: &DMatrix<f64>, filled: impl Fn(usize) -> usize + Sync) -> DMatrix<f64> {
    let (rows, inner, columns) = (a.nrows(), a.ncols(), b.ncols());
    if rows * inner * columns < WORTH_THREADS || inner == 0 {
        return a * b;
    }
    let mut out = DMatrix::zeros(rows, columns);
    let form = |(part, own): (usize, &mut [f64])| {
        let (first, count) = (part * TOGETHER, own.len() / rows);
        let filled = filled(first + count);
        let mut own = nalgebra::DMatrixViewMut::from_slice(own, rows, count);
        own.gemm(1.0, &a.columns(0, filled), &b.view((0, first), (filled, count)), 0.0);
    };
    out.as_mut_slice().par_chunks_mut(rows * TOGETHER).enumerate().for_each(form);
    out
}

/// AᵀA: its upper triangle, mirrored.
pub(crate) fn gram(a: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, n) = a.shape();
    if rows * n * n < WORTH_THREADS {
        return a.transpose() * a;
    }
    // The narrow side is transposed: this is the product that is fast.
    let transposed = transposed(a);
    let mut out = DMatrix::zeros(n, n);
    let form = |(part, own): (usize, &mut [f64])| {
        let (first, count) = (part * TOGETHER, own.len() / n);
        let mut own = nalgebra::DMatrixViewMut::from_slice(own, n, count);
        let above = first + count;
        own.rows_mut(0, above).gemm(1.0, &transposed.rows(0, above), &a.columns(first, count), 0.0);
    };
    out.as_mut_slice().par_chunks_mut(n * TOGETHER).enumerate().for_each(form);
    out.fill_lower_triangle_with_upper_triangle();
    out
}

/// Aᵀ of a tall matrix.
pub(crate) fn transposed(a: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, n) = a.shape();
    let mut out = DMatrix::zeros(n, rows);
    let form = |(part, own): (usize, &mut [f64])| {
        let count = own.len() / n;
        let mut own = nalgebra::DMatrixViewMut::from_slice(own, n, count);
        a.rows(part * TOGETHER, count).transpose_to(&mut own);
    };
    out.as_mut_slice().par_chunks_mut((n * TOGETHER).max(1)).enumerate().for_each(form);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_one_thread() {
        let entry = |i: usize, j: usize| ((12.9898 * i as f64 + 78.233 * j as f64).sin() * 43.7) % 1.0;
        for (rows, inner, columns) in [(3, 2, 4), (700, 70, 41), (301, 250, 250), (5, 0, 3)] {
            let (a, b) = (DMatrix::from_fn(rows, inner, entry), DMatrix::from_fn(inner, columns, entry));
            let scale = 1e-15 * rows as f64;
            assert!((product(&a, &b) - &a * &b).amax() <= scale);
            let upper = DMatrix::from_fn(inner, inner, |i, j| if i <= j { entry(i, j) } else { 0.0 });
            assert!((product_with_upper(&a, &upper) - &a * &upper).amax() <= scale);
            let own = gram(&a);
            assert!((&own - a.transpose() * &a).amax() <= scale * 10.0 && own == own.transpose());
        }
    }
}
