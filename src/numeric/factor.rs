//! Cholesky factors and inverses of triangles by blocked matrix products.

use nalgebra::{DMatrix, DMatrixViewMut, DVector};

use super::kernel::{add_product, factor_in_place, invert_lower};
use super::product::product_with_lower;

/// Largest number of rows for which a triangular solve or inverse proceeds column by column.
const MAX_UNBLOCKED_ROWS: usize = 24;
/// Number of rows of a triangle that are multiplied together.
const ROWS_PER_PRODUCT: usize = 96;
/// Number of columns that the Cholesky factorisation treats as one block (panel).
const PANEL_COLUMNS: usize = 64;

/// Returns the Cholesky factor L of M = L Lᵀ, or `None` if M is not positive definite. Only the
/// lower half of M is read.
///
/// Panel by panel: with M = (A · ; B C) and A = L₁ L₁ᵀ, the factor has the rows P = B L₁⁻ᵀ below
/// L₁, and C − P Pᵀ remains to be factored.
pub(crate) fn lower_factor(mut matrix: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    if n <= PANEL_COLUMNS {
        let is_factored = factor_in_place(n, matrix.as_mut_slice());
        matrix.fill_upper_triangle(0.0, 1);
        return is_factored.then_some(matrix);
    }
    for first in (0..n).step_by(PANEL_COLUMNS) {
        let wide = PANEL_COLUMNS.min(n - first);
        let behind = first + wide;
        let diagonal = lower_factor(matrix.view((first, first), (wide, wide)).into_owned())?;
        matrix.view_mut((first, first), (wide, wide)).copy_from(&diagonal);
        let (mut left, mut right) = matrix.columns_range_pair_mut(first..behind, behind..);
        let mut panel = left.rows_mut(behind, n - behind);
        solve_right(&diagonal, &mut panel);
        for next in (0..n - behind).step_by(PANEL_COLUMNS) {
            let count = PANEL_COLUMNS.min(n - behind - next);
            let across = panel.rows(next, count).transpose();
            right.view_mut((behind + next, next), (n - behind - next, count)).gemm(
                -1.0,
                &panel.rows_range(next..),
                &across,
                1.0,
            );
        }
    }
    matrix.fill_upper_triangle(0.0, 1);
    Some(matrix)
}

/// Replaces B = `right` by B L⁻ᵀ with L = `lower`, one block of columns after the other. Products
/// with the columns that are already solved are subtracted from each block by matrix products.
fn solve_right(lower: &DMatrix<f64>, right: &mut DMatrixViewMut<f64>) {
    let n = lower.nrows();
    for first in (0..n).step_by(MAX_UNBLOCKED_ROWS) {
        let count = MAX_UNBLOCKED_ROWS.min(n - first);
        let (solved, mut remaining) = right.columns_range_pair_mut(..first, first..);
        let mut block = remaining.columns_mut(0, count);
        block.gemm(-1.0, &solved, &lower.view((first, 0), (count, first)).transpose(), 1.0);
        for j in 0..count {
            for k in 0..j {
                let (solved, mut column) = block.columns_range_pair_mut(k, j);
                let factor = -lower[(first + j, first + k)];
                add_product(column.as_mut_slice(), (solved.as_slice(), 0), &[factor]);
            }
            block.column_mut(j).unscale_mut(lower[(first + j, first + j)]);
        }
    }
}

/// Returns the inverse L⁻¹ of a lower triangle L without zeros on its diagonal.
pub(crate) fn inverse_lower(lower: &DMatrix<f64>) -> DMatrix<f64> {
    let mut inverse = DMatrix::zeros(lower.nrows(), lower.nrows());
    invert_part(lower, &mut inverse, 0, lower.nrows());
    inverse
}

/// Writes the inverse of the `count` rows and columns of a lower triangle from index `first` on to
/// the same place of `inverse`, which is zero there.
///
/// With L = (F 0 ; B G), W = F⁻¹ and X = G⁻¹: L⁻¹ = (W 0 ; −X B W, X).
fn invert_part(lower: &DMatrix<f64>, inverse: &mut DMatrix<f64>, first: usize, count: usize) {
    if count <= MAX_UNBLOCKED_ROWS {
        let n = lower.nrows();
        return invert_lower((lower.as_slice(), n), (first, count), inverse.as_mut_slice());
    }
    let (half, other) = (count / 2, count - count / 2);
    let middle = first + half;
    invert_part(lower, inverse, first, half);
    invert_part(lower, inverse, middle, other);
    let below = product_with_lower(
        &part(lower, (middle, first), (other, half)),
        &part(inverse, (first, first), (half, half)),
    );
    let last = part(inverse, (middle, middle), (other, other));
    for row in (0..other).step_by(ROWS_PER_PRODUCT) {
        let end = other.min(row + ROWS_PER_PRODUCT);
        inverse.view_mut((middle + row, first), (end - row, half)).gemm(
            -1.0,
            &last.view((row, 0), (end - row, end)),
            &below.rows(0, end),
            0.0,
        );
    }
}

/// Returns a copy of the part of a matrix that begins at row `i` and column `j`. Whole columns are
/// copied, which is faster than entry by entry.
fn part(matrix: &DMatrix<f64>, (i, j): (usize, usize), (rows, n): (usize, usize)) -> DMatrix<f64> {
    let mut entries = Vec::with_capacity(rows * n);
    let columns = matrix.as_slice().chunks_exact(matrix.nrows()).skip(j).take(n);
    for column in columns {
        entries.extend_from_slice(&column[i..i + rows]);
    }
    DMatrix::from_vec(rows, n, entries)
}

/// Returns the inverse L⁻¹ of the Cholesky factor of M = L Lᵀ, or `None` if M is not positive
/// definite. Only the lower half of M is read.
pub(crate) fn inverse_factor(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    lower_factor(matrix.clone()).map(|lower| inverse_lower(&lower))
}

/// Solves M x = b for a symmetric `matrix` M and `right` b and returns x, or `None` if M is not
/// positive definite. Only the lower half of M is read.
pub(crate) fn solve_positive(
    matrix: DMatrix<f64>,
    mut right: DVector<f64>,
) -> Option<DVector<f64>> {
    let lower = lower_factor(matrix)?;
    let is_solved = lower.solve_lower_triangular_mut(&mut right)
        && lower.tr_solve_lower_triangular_mut(&mut right);
    is_solved.then_some(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocked_results_equal_those_column_by_column() {
        for n in [1, 7, 24, 25, 130, 301] {
            let a = DMatrix::from_fn(n + 3, n, |i, j| {
                ((12.9898 * i as f64 + 78.233 * j as f64).sin() * 43.7) % 1.0
            });
            let mut matrix = DMatrix::identity(n, n) * 0.1 + a.transpose() * a;
            let lower = matrix.clone().cholesky().unwrap().l();
            matrix.fill_upper_triangle(f64::NAN, 1);
            assert!(
                (inverse_factor(&matrix).unwrap() * &lower - DMatrix::identity(n, n)).amax()
                    < 1e-11
            );
            let x = DVector::from_fn(n, |i, _| (i as f64).cos());
            let right = &lower * lower.tr_mul(&x);
            assert!((solve_positive(matrix.clone(), right.clone()).unwrap() - x).amax() < 1e-10);
            matrix[(n - 1, n - 1)] = -1.0;
            assert!(inverse_factor(&matrix).is_none() && solve_positive(matrix, right).is_none());
        }
    }

    #[test]
    fn nearly_dependent_columns_are_factored_as_accurately_as_column_by_column() {
        // The columns are sines of close orders; a small number is added to the diagonal.
        let a =
            DMatrix::from_fn(400, 130, |i, j| ((1.0 + 0.05 * j as f64) * i as f64 / 400.0).sin());
        let mut matrix = a.transpose() * &a;
        for j in 0..130 {
            matrix[(j, j)] *= 1.0 + 1e-12;
        }
        let x = DVector::from_fn(130, |i, _| (i as f64).cos());
        let right = &matrix * &x;
        let plain = matrix.clone().cholesky().unwrap().solve(&right);
        let error = |x: &DVector<f64>| (&matrix * x - &right).norm();
        let blocked = solve_positive(matrix.clone(), right.clone()).unwrap();
        assert!(
            error(&blocked) <= 10.0 * error(&plain) + 1e-12 * right.norm(),
            "{:e} {:e}",
            error(&blocked),
            error(&plain)
        );
        assert!(inverse_factor(&matrix).is_some());
    }
}
