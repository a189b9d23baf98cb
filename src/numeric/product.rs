//! Products of tall matrices on every core: each part of the result is one thread's, and parts
//! depend on sizes alone, so that they are the same to the bit for any number of threads.

use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut, Dyn, MatrixView};
use rayon::prelude::*;

/// Columns of a result that one thread forms at a time: each time the other matrix is packed anew.
const TOGETHER: usize = 96;
/// The same of a narrow result, of which nothing is packed.
const FEW: usize = 8;
/// Columns up to which a product is formed by axpys and dots: there is too little to do with what
/// would be packed.
const NARROW: usize = 5;
/// Rows that one thread goes through at a time where the result is narrow.
const SHORT: usize = 1024;
/// Numbers below which copies of rows cost more than new memory.
const WORTH_PLACE: usize = 1 << 20;
/// Columns of a tall matrix that one thread turns at a time.
const BAND: usize = 24;
/// Multiplications below which threads cost more than they save.
const WORTH_THREADS: usize = 1 << 20;

/// A B.
pub(crate) fn product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    if b.ncols() <= NARROW && a.len() * b.ncols() >= WORTH_THREADS {
        return narrow_product(a, b);
    }
    let mut out = zeros(a.nrows(), b.ncols());
    product_to(a, b, &mut out, |_| a.ncols());
    out
}

/// A B of a square upper triangle B.
pub(crate) fn product_with_upper(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    product_with_upper_above(a, b, 0)
}

/// A B of a square upper triangle B, with so many rows of zeros below.
pub(crate) fn product_with_upper_above(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    more: usize,
) -> DMatrix<f64> {
    let mut out = zeros(a.nrows() + more, b.ncols());
    product_to(a, b, &mut out, |columns| columns);
    out
}

/// A B of a square upper triangle B, in the place of a large A: new memory takes a good part of the
/// time of the product.
pub(crate) fn multiply_by_upper(a: &mut DMatrix<f64>, b: &DMatrix<f64>) {
    if a.len() < WORTH_PLACE {
        *a = product_with_upper(a, b);
        return;
    }
    let n = b.ncols();
    let form = |_, mut own: DMatrixViewMut<f64>| {
        let before = own.clone_owned();
        for first in (0..n).step_by(TOGETHER) {
            let end = n.min(first + TOGETHER);
            let upper = b.view((0, first), (end, end - first));
            own.columns_range_mut(first..end).gemm(1.0, &before.columns(0, end), &upper, 0.0);
        }
    };
    by_rows(a.as_view_mut(), 0, &form);
}

/// C − A B in the place of a tall C.
pub(crate) fn take_off_product(c: DMatrixViewMut<f64>, a: &DMatrix<f64>, b: &DMatrix<f64>) {
    let form =
        |first, mut own: DMatrixViewMut<f64>| own.gemm(-1.0, &a.rows(first, own.nrows()), b, 1.0);
    by_rows(c, 0, &form);
}

/// Some rows after others of a tall matrix, on every core, each with the number of its first row.
fn by_rows(
    mut all: DMatrixViewMut<f64>,
    first: usize,
    form: &(impl Fn(usize, DMatrixViewMut<f64>) + Sync),
) {
    let half = all.nrows() / 2;
    if all.nrows() <= SHORT {
        return form(first, all);
    }
    let (upper, lower) = all.rows_range_pair_mut(..half, half..);
    rayon::join(|| by_rows(upper, first, form), || by_rows(lower, first + half, form));
}

/// A B in the first rows of `out`, of which the first columns, so many, have nothing below so many
/// rows of B.
fn product_to(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    out: &mut DMatrix<f64>,
    filled: impl Fn(usize) -> usize + Sync,
) {
    let (rows, inner, columns) = (a.nrows(), a.ncols(), b.ncols());
    if rows * inner * columns < WORTH_THREADS || inner == 0 {
        return a.mul_to(b, &mut out.rows_mut(0, rows));
    }
    let long = out.nrows();
    let form = |(part, own): (usize, &mut [f64])| {
        let (first, count) = (part * TOGETHER, own.len() / long);
        let filled = filled(first + count);
        let mut own = DMatrixViewMut::from_slice(own, long, count);
        own.rows_mut(0, rows).gemm(
            1.0,
            &a.columns(0, filled),
            &b.view((0, first), (filled, count)),
            0.0,
        );
    };
    // Of a triangle what takes longest comes first.
    out.as_mut_slice().par_chunks_mut(long * TOGETHER).enumerate().rev().for_each(form);
}

/// L B of a square lower triangle L, on one thread.
pub(crate) fn lower_product(lower: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(lower.nrows(), b.ncols());
    for first in (0..lower.nrows()).step_by(TOGETHER) {
        let end = lower.nrows().min(first + TOGETHER);
        out.rows_range_mut(first..end).gemm(
            1.0,
            &lower.view((first, 0), (end - first, end)),
            &b.rows(0, end),
            0.0,
        );
    }
    out
}

/// A B of a narrow B: some rows after others, which stay in the processor's cache from column to
/// column.
fn narrow_product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let rows = a.nrows();
    let of_rows = |part: usize| a.rows(part * SHORT, SHORT.min(rows - part * SHORT)) * b;
    let parts: Vec<DMatrix<f64>> = (0..rows.div_ceil(SHORT)).into_par_iter().map(of_rows).collect();
    let mut out = zeros(rows, b.ncols());
    for (part, own) in parts.iter().enumerate() {
        out.rows_mut(part * SHORT, own.nrows()).copy_from(own);
    }
    out
}

/// AᵀB of a tall A and a B with few columns.
pub(crate) fn product_along(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let n = a.ncols();
    if a.len() * b.ncols() < WORTH_THREADS || a.nrows() <= NARROW {
        return a.tr_mul(b);
    }
    let together = if b.ncols() <= NARROW { FEW } else { TOGETHER };
    // The narrow side is transposed: this is the product that is fast.
    let turned = transposed_view(b);
    let mut out = zeros(b.ncols(), n);
    let form = |(part, own): (usize, &mut [f64])| {
        let (first, count) = (part * together, own.len() / turned.nrows());
        let (mut own, a) =
            (DMatrixViewMut::from_slice(own, turned.nrows(), count), a.columns(first, count));
        if turned.nrows().min(count) <= NARROW {
            for (mut out, column) in own.column_iter_mut().zip(a.column_iter()) {
                out.iter_mut().zip(b.column_iter()).for_each(|(out, b)| *out = b.dot(&column));
            }
        } else {
            own.gemm(1.0, &turned, &a, 0.0);
        }
    };
    out.as_mut_slice().par_chunks_mut(b.ncols() * together).enumerate().for_each(form);
    out.transpose()
}

/// AᵀA: its upper triangle, mirrored.
pub(crate) fn gram(a: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, n) = a.shape();
    if rows * n * n < WORTH_THREADS || rows <= NARROW {
        return a.transpose() * a;
    }
    let transposed = transposed_view(a);
    let mut out = zeros(n, n);
    let form = |(part, own): (usize, &mut [f64])| {
        let (first, count) = (part * TOGETHER, own.len() / n);
        let mut own = DMatrixViewMut::from_slice(own, n, count);
        let above = first + count;
        if count <= NARROW {
            own.rows_mut(0, above).gemm_tr(
                1.0,
                &a.columns(0, above),
                &a.columns(first, count),
                0.0,
            );
        } else {
            own.rows_mut(0, above).gemm(
                1.0,
                &transposed.rows(0, above),
                &a.columns(first, count),
                0.0,
            );
        }
    };
    // The longest columns first.
    out.as_mut_slice().par_chunks_mut(n * TOGETHER).enumerate().rev().for_each(form);
    out.fill_lower_triangle_with_upper_triangle();
    out
}

/// Aᵀ, of which nothing is copied; not for products of a size up to `NARROW`: they go by axpys, and
/// nalgebra's do not keep within columns with gaps between their numbers.
fn transposed_view(a: &DMatrix<f64>) -> MatrixView<'_, f64, Dyn, Dyn, Dyn, Dyn> {
    let (rows, n) = a.shape();
    DMatrixView::from_slice_with_strides_generic(a.as_slice(), Dyn(n), Dyn(rows), Dyn(rows), Dyn(1))
}

/// AᵀB of a tall A and a B as tall: some columns of A after others, so that each sum is that of one
/// thread.
pub(crate) fn transposed_product(a: &DMatrix<f64>, b: DMatrixView<f64>) -> DMatrix<f64> {
    let (rows, n) = a.shape();
    // See `transposed_view`.
    if a.len() * b.ncols() < WORTH_THREADS || rows.min(n).min(b.ncols()) <= NARROW {
        return a.transpose() * b;
    }
    let turned = transposed_view(a);
    let parts = n.div_ceil(BAND);
    let of_columns = |part: usize| {
        let (first, end) = (part * n / parts, (part + 1) * n / parts);
        turned.rows(first, end - first) * b
    };
    let found: Vec<DMatrix<f64>> = (0..parts).into_par_iter().map(of_columns).collect();
    let mut out = zeros(n, b.ncols());
    for (part, own) in found.iter().enumerate() {
        out.rows_mut(part * n / parts, own.nrows()).copy_from(own);
    }
    out
}

/// Zeros, which cost nothing before they are written to.
pub(crate) fn zeros(rows: usize, columns: usize) -> DMatrix<f64> {
    DMatrix::from_vec(rows, columns, vec![0.0; rows * columns])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_are_those_of_one_thread() {
        let entry =
            |i: usize, j: usize| ((12.9898 * i as f64 + 78.233 * j as f64).sin() * 43.7) % 1.0;
        for (rows, inner, columns) in [
            (3, 2, 4),
            (700, 70, 41),
            (301, 250, 250),
            (5, 0, 3),
            (3001, 202, 4),
            (3001, 97, 7),
            (2600, 410, 3),
            (4, 600, 500),
        ] {
            let (a, b) =
                (DMatrix::from_fn(rows, inner, entry), DMatrix::from_fn(inner, columns, entry));
            let scale = 1e-15 * rows.max(inner) as f64;
            assert!((product(&a, &b) - &a * &b).amax() <= scale);
            let upper =
                DMatrix::from_fn(inner, inner, |i, j| if i <= j { entry(i, j) } else { 0.0 });
            let (expected, mut in_place) = (&a * &upper, a.clone());
            let above = product_with_upper_above(&a, &upper, 2);
            assert!((product_with_upper(&a, &upper) - &expected).amax() <= scale);
            assert!(above == product_with_upper(&a, &upper).resize_vertically(rows + 2, 0.0));
            multiply_by_upper(&mut in_place, &upper);
            assert!((in_place - expected).amax() <= scale);
            let (lower, wide) = (upper.transpose(), b.columns(0, columns.min(inner)).into_owned());
            assert!((lower_product(&lower, &wide) - &lower * &wide).amax() <= scale);
            let own = gram(&a);
            assert!((&own - a.transpose() * &a).amax() <= scale * 10.0 && own == own.transpose());
            let tall = DMatrix::from_fn(rows, columns, |i, j| entry(i, j + inner));
            assert!((product_along(&a, &tall) - a.transpose() * &tall).amax() <= scale * 10.0);
            assert!(
                (transposed_product(&a, tall.as_view()) - a.transpose() * &tall).amax()
                    <= scale * 10.0
            );
            let mut left = tall.clone();
            take_off_product(left.as_view_mut(), &a, &b);
            assert!((left - (&tall - &a * &b)).amax() <= scale);
        }
    }
}
