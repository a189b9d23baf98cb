//! Parallel products of tall matrices. How the work is divided depends only on the sizes, so
//! results are the same to the bit for any number of threads.

use super::parallel;
use std::ops::Range;

use nalgebra::{DMatrix, DMatrixView, DMatrixViewMut, Dyn, MatrixView};

/// Number of result columns that one thread computes at a time. Smaller blocks are slower, because
/// the matrix product repacks the left factor for each block.
const BLOCK_COLUMNS: usize = 96;
/// Number of columns of a narrow result that one thread computes at a time, without packing.
const NARROW_BLOCK_COLUMNS: usize = 8;
/// Largest number of rows or columns of a factor for which a product is computed by axpy and dot
/// operations; packing the factors would take longer.
const MAX_NARROW_COLUMNS: usize = 5;
/// Number of rows that one thread processes at a time if the result has few columns.
const BLOCK_ROWS: usize = 1024;
/// Smallest number of entries of the left factor for which a product overwrites it instead of
/// allocating memory.
const MIN_IN_PLACE_ENTRIES: usize = 1 << 20;
/// Largest number of columns of A whose rows of the product AᵀB one thread computes at a time.
const MAX_TRANSPOSED_COLUMNS: usize = 24;
/// Smallest number of multiplications for which a product is computed in parallel.
const MIN_PARALLEL_WORK: usize = 1 << 20;

/// Returns the product A B, computed in parallel.
pub(crate) fn product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    if b.ncols() <= MAX_NARROW_COLUMNS && a.len() * b.ncols() >= MIN_PARALLEL_WORK {
        return narrow_product(a, b);
    }
    let mut out = zeros(a.nrows(), b.ncols());
    product_to(a, b, &mut out, |_| 0..a.ncols());
    out
}

/// Returns A B for a square lower triangle B.
pub(crate) fn product_with_lower(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = zeros(a.nrows(), b.ncols());
    product_to(a, b, &mut out, |columns| columns.start..b.nrows());
    out
}

/// Returns A B for a square upper triangle B.
pub(crate) fn product_with_upper(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    product_with_upper_padded(a, b, 0)
}

/// Returns A B for a square upper triangle B, with `extra` rows of zeros appended.
pub(crate) fn product_with_upper_padded(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    extra: usize,
) -> DMatrix<f64> {
    let mut out = zeros(a.nrows() + extra, b.ncols());
    product_to(a, b, &mut out, |columns| 0..columns.end);
    out
}

/// Replaces A by A B for a square upper triangle B. A large A is overwritten in place, since new
/// memory takes much of the time of the product.
pub(crate) fn multiply_by_upper(a: &mut DMatrix<f64>, b: &DMatrix<f64>) {
    if a.len() < MIN_IN_PLACE_ENTRIES {
        *a = product_with_upper(a, b);
        return;
    }
    let n = b.ncols();
    let form = |_, mut block: DMatrixViewMut<f64>| {
        let before = block.clone_owned();
        for first in (0..n).step_by(BLOCK_COLUMNS) {
            let end = n.min(first + BLOCK_COLUMNS);
            let upper = b.view((0, first), (end, end - first));
            block.columns_range_mut(first..end).gemm(1.0, &before.columns(0, end), &upper, 0.0);
        }
    };
    by_rows(a.as_view_mut(), 0, &form);
}

/// Replaces a tall C by C − A B.
pub(crate) fn subtract_product(c: DMatrixViewMut<f64>, a: &DMatrix<f64>, b: &DMatrix<f64>) {
    let form = |first, mut block: DMatrixViewMut<f64>| {
        block.gemm(-1.0, &a.rows(first, block.nrows()), b, 1.0);
    };
    by_rows(c, 0, &form);
}

/// Applies `form` in parallel to blocks of consecutive rows of a tall matrix. `form` receives the
/// index of the first row of its block; the rows of `matrix` are counted from `first`.
fn by_rows(
    mut matrix: DMatrixViewMut<f64>,
    first: usize,
    form: &(impl Fn(usize, DMatrixViewMut<f64>) + Sync),
) {
    let half = matrix.nrows() / 2;
    if matrix.nrows() <= BLOCK_ROWS {
        return form(first, matrix);
    }
    let (upper, lower) = matrix.rows_range_pair_mut(..half, half..);
    rayon::join(|| by_rows(upper, first, form), || by_rows(lower, first + half, form));
}

/// Writes A B into the first rows of `out`. For a range of columns of B, `filled` returns the range
/// of rows outside which these columns are zero.
fn product_to(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    out: &mut DMatrix<f64>,
    filled: impl Fn(Range<usize>) -> Range<usize> + Sync,
) {
    let (rows, inner, columns) = (a.nrows(), a.ncols(), b.ncols());
    if rows * inner * columns < MIN_PARALLEL_WORK || inner == 0 {
        return a.mul_to(b, &mut out.rows_mut(0, rows));
    }
    let height = out.nrows();
    let form = |part: usize, entries: &mut [f64]| {
        let (first, count) = (part * BLOCK_COLUMNS, entries.len() / height);
        let filled = filled(first..first + count);
        let mut block = DMatrixViewMut::from_slice(entries, height, count);
        block.rows_mut(0, rows).gemm(
            1.0,
            &a.columns_range(filled.clone()),
            &b.view((filled.start, first), (filled.len(), count)),
            0.0,
        );
    };
    // The last columns of an upper triangle are the longest, so they are computed first.
    parallel::write_chunks_from_last(out.as_mut_slice(), height * BLOCK_COLUMNS, &form);
}

/// Returns L B for a square lower triangle L, on one thread.
pub(crate) fn lower_product(lower: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let mut out = DMatrix::zeros(lower.nrows(), b.ncols());
    for first in (0..lower.nrows()).step_by(BLOCK_COLUMNS) {
        let end = lower.nrows().min(first + BLOCK_COLUMNS);
        out.rows_range_mut(first..end).gemm(
            1.0,
            &lower.view((first, 0), (end - first, end)),
            &b.rows(0, end),
            0.0,
        );
    }
    out
}

/// Returns A B for a B with few columns, by blocks of rows of A that stay in the processor's cache
/// from one column of B to the next.
fn narrow_product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let rows = a.nrows();
    let of_rows =
        |part: usize| a.rows(part * BLOCK_ROWS, BLOCK_ROWS.min(rows - part * BLOCK_ROWS)) * b;
    let parts = parallel::map(rows.div_ceil(BLOCK_ROWS), of_rows);
    let mut out = zeros(rows, b.ncols());
    for (index, part) in parts.iter().enumerate() {
        out.rows_mut(index * BLOCK_ROWS, part.nrows()).copy_from(part);
    }
    out
}

/// Returns AᵀB for a tall A and a B with few columns.
pub(crate) fn transposed_narrow_product(a: &DMatrix<f64>, b: &DMatrix<f64>) -> DMatrix<f64> {
    let n = a.ncols();
    if a.len() * b.ncols() < MIN_PARALLEL_WORK || a.nrows() <= MAX_NARROW_COLUMNS {
        return a.tr_mul(b);
    }
    let width = if b.ncols() <= MAX_NARROW_COLUMNS { NARROW_BLOCK_COLUMNS } else { BLOCK_COLUMNS };
    // BᵀA is formed instead of AᵀB: transposing the narrow side is faster.
    let transposed = transposed_view(b);
    let mut out = zeros(b.ncols(), n);
    let form = |part: usize, entries: &mut [f64]| {
        let (first, count) = (part * width, entries.len() / transposed.nrows());
        let mut block = DMatrixViewMut::from_slice(entries, transposed.nrows(), count);
        let a = a.columns(first, count);
        if transposed.nrows().min(count) <= MAX_NARROW_COLUMNS {
            for (mut out, column) in block.column_iter_mut().zip(a.column_iter()) {
                out.iter_mut().zip(b.column_iter()).for_each(|(out, b)| *out = b.dot(&column));
            }
        } else {
            block.gemm(1.0, &transposed, &a, 0.0);
        }
    };
    parallel::write_chunks(out.as_mut_slice(), b.ncols() * width, &form);
    out.transpose()
}

/// Returns AᵀA. Only its upper triangle is computed and then mirrored.
pub(crate) fn gram(a: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, n) = a.shape();
    if rows * n * n < MIN_PARALLEL_WORK || rows <= MAX_NARROW_COLUMNS {
        return a.transpose() * a;
    }
    let transposed = transposed_view(a);
    let mut out = zeros(n, n);
    let form = |part: usize, entries: &mut [f64]| {
        let (first, count) = (part * BLOCK_COLUMNS, entries.len() / n);
        let mut block = DMatrixViewMut::from_slice(entries, n, count);
        let end = first + count;
        if count <= MAX_NARROW_COLUMNS {
            block.rows_mut(0, end).gemm_tr(1.0, &a.columns(0, end), &a.columns(first, count), 0.0);
        } else {
            block.rows_mut(0, end).gemm(
                1.0,
                &transposed.rows(0, end),
                &a.columns(first, count),
                0.0,
            );
        }
    };
    // The last columns of the upper triangle are the longest, so they are computed first.
    parallel::write_chunks_from_last(out.as_mut_slice(), n * BLOCK_COLUMNS, &form);
    out.fill_lower_triangle_with_upper_triangle();
    out
}

/// Returns LᵀL for a square lower triangle L. Only its upper triangle is computed and then
/// mirrored.
pub(crate) fn gram_of_lower(lower: &DMatrix<f64>) -> DMatrix<f64> {
    let n = lower.nrows();
    if n * n * n < MIN_PARALLEL_WORK {
        return lower.transpose() * lower;
    }
    let transposed = transposed_view(lower);
    let mut out = zeros(n, n);
    let form = |part: usize, entries: &mut [f64]| {
        let (first, count) = (part * BLOCK_COLUMNS, entries.len() / n);
        let mut block = DMatrixViewMut::from_slice(entries, n, count);
        // Columns from `first` on have zeros above that row.
        let (end, filled) = (first + count, n - first);
        let right = lower.view((first, first), (filled, count));
        let left = transposed.view((0, first), (end, filled));
        if count <= MAX_NARROW_COLUMNS {
            block.rows_mut(0, end).gemm_tr(
                1.0,
                &lower.view((first, 0), (filled, end)),
                &right,
                0.0,
            );
        } else {
            block.rows_mut(0, end).gemm(1.0, &left, &right, 0.0);
        }
    };
    parallel::write_chunks(out.as_mut_slice(), n * BLOCK_COLUMNS, &form);
    out.fill_lower_triangle_with_upper_triangle();
    out
}

/// Returns a view of Aᵀ without copying. It must not enter products with a dimension of at most
/// [`MAX_NARROW_COLUMNS`]: nalgebra forms these by axpy operations that access strided columns out
/// of bounds.
fn transposed_view(a: &DMatrix<f64>) -> MatrixView<'_, f64, Dyn, Dyn, Dyn, Dyn> {
    let (rows, n) = a.shape();
    DMatrixView::from_slice_with_strides_generic(a.as_slice(), Dyn(n), Dyn(rows), Dyn(rows), Dyn(1))
}

/// Returns AᵀB for a tall A and an equally tall B, by groups of columns of A. One thread forms each
/// sum over the rows, so that its order does not depend on the number of threads.
pub(crate) fn transposed_product(a: &DMatrix<f64>, b: DMatrixView<f64>) -> DMatrix<f64> {
    let (rows, n) = a.shape();
    // See `transposed_view`.
    if a.len() * b.ncols() < MIN_PARALLEL_WORK || rows.min(n).min(b.ncols()) <= MAX_NARROW_COLUMNS {
        return a.transpose() * b;
    }
    let transposed = transposed_view(a);
    let parts = n.div_ceil(MAX_TRANSPOSED_COLUMNS);
    let of_columns = |part: usize| {
        let (first, end) = (part * n / parts, (part + 1) * n / parts);
        transposed.rows(first, end - first) * b
    };
    let blocks = parallel::map(parts, of_columns);
    let mut out = zeros(n, b.ncols());
    for (part, block) in blocks.iter().enumerate() {
        out.rows_mut(part * n / parts, block.nrows()).copy_from(block);
    }
    out
}

/// Returns a matrix of zeros. A large one is requested from the system as zeroed memory, which is
/// not touched before it is written to.
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
            let padded = product_with_upper_padded(&a, &upper, 2);
            assert!((product_with_upper(&a, &upper) - &expected).amax() <= scale);
            assert!(padded == product_with_upper(&a, &upper).resize_vertically(rows + 2, 0.0));
            multiply_by_upper(&mut in_place, &upper);
            assert!((in_place - expected).amax() <= scale);
            let (lower, wide) = (upper.transpose(), b.columns(0, columns.min(inner)).into_owned());
            assert!((product_with_lower(&a, &lower) - &a * &lower).amax() <= scale);
            assert!((lower_product(&lower, &wide) - &lower * &wide).amax() <= scale);
            let square_of_lower = gram_of_lower(&lower);
            assert!(
                (&square_of_lower - lower.transpose() * &lower).amax() <= scale * 10.0
                    && square_of_lower == square_of_lower.transpose()
            );
            let square = gram(&a);
            assert!((&square - a.transpose() * &a).amax() <= scale * 10.0);
            assert!(square == square.transpose());
            let tall = DMatrix::from_fn(rows, columns, |i, j| entry(i, j + inner));
            assert!(
                (transposed_narrow_product(&a, &tall) - a.transpose() * &tall).amax()
                    <= scale * 10.0
            );
            assert!(
                (transposed_product(&a, tall.as_view()) - a.transpose() * &tall).amax()
                    <= scale * 10.0
            );
            let mut difference = tall.clone();
            subtract_product(difference.as_view_mut(), &a, &b);
            assert!((difference - (&tall - &a * &b)).amax() <= scale);
        }
    }
}
