//! Factors of symmetric matrices by products of parts, which are fast where columns one by one are
//! not.

use nalgebra::{Cholesky, DMatrix, DMatrixViewMut, DVector};

/// Rows up to which a triangle is solved with, or inverted, column by column.
const FEW: usize = 24;
/// Columns that are factored together.
const PANEL: usize = 64;

/// L of M = L Lᵀ, of which the lower half is read; `None` where M is not positive definite.
///
/// Panel after panel: with M = (A · ; B C) and A = L Lᵀ, the rows below are P = B L⁻ᵀ and what is
/// left is C − P Pᵀ.
pub(crate) fn lower_factor(mut matrix: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    if n <= PANEL {
        return matrix.cholesky().map(Cholesky::unpack);
    }
    for first in (0..n).step_by(PANEL) {
        let wide = PANEL.min(n - first);
        let behind = first + wide;
        let own = matrix.view((first, first), (wide, wide)).into_owned().cholesky()?.unpack();
        matrix.view_mut((first, first), (wide, wide)).copy_from(&own);
        let (mut left, mut right) = matrix.columns_range_pair_mut(first..behind, behind..);
        let mut panel = left.rows_mut(behind, n - behind);
        solve_right(&own, &mut panel);
        for next in (0..n - behind).step_by(PANEL) {
            let count = PANEL.min(n - behind - next);
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

/// Makes B L⁻ᵀ of B, a few columns after the other: of those before them a product is taken off.
fn solve_right(lower: &DMatrix<f64>, right: &mut DMatrixViewMut<f64>) {
    let n = lower.nrows();
    for first in (0..n).step_by(FEW) {
        let count = FEW.min(n - first);
        let (known, mut rest) = right.columns_range_pair_mut(..first, first..);
        let mut own = rest.columns_mut(0, count);
        own.gemm(-1.0, &known, &lower.view((first, 0), (count, first)).transpose(), 1.0);
        for j in 0..count {
            for k in 0..j {
                let (known, mut column) = own.columns_range_pair_mut(k, j);
                column.axpy(-lower[(first + j, first + k)], &known, 1.0);
            }
            own.column_mut(j).unscale_mut(lower[(first + j, first + j)]);
        }
    }
}

/// L⁻¹ of a lower triangle whose diagonal has no zero.
///
/// With L = (F 0 ; B G), W = F⁻¹ and X = G⁻¹: L⁻¹ = (W 0 ; −X B W, X).
pub(crate) fn inverse_lower(lower: &DMatrix<f64>) -> DMatrix<f64> {
    let n = lower.nrows();
    if n <= FEW {
        let mut all = DMatrix::identity(n, n);
        lower.solve_lower_triangular_mut(&mut all);
        return all;
    }
    let (half, rest) = (n / 2, n - n / 2);
    let first = inverse_lower(&lower.view((0, 0), (half, half)).into_owned());
    let last = inverse_lower(&lower.view((half, half), (rest, rest)).into_owned());
    let mut all = DMatrix::zeros(n, n);
    all.view_mut((half, 0), (rest, half)).gemm(
        -1.0,
        &last,
        &(lower.view((half, 0), (rest, half)) * &first),
        0.0,
    );
    all.view_mut((0, 0), (half, half)).copy_from(&first);
    all.view_mut((half, half), (rest, rest)).copy_from(&last);
    all
}

/// L⁻¹ of M = L Lᵀ, of which the lower half is read; `None` where M is not positive definite.
pub(crate) fn inverse_factor(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    lower_factor(matrix.clone()).map(|lower| inverse_lower(&lower))
}

/// x of M x = b, of which the lower half is read; `None` where M is not positive definite.
pub(crate) fn solve_positive(
    matrix: DMatrix<f64>,
    mut right: DVector<f64>,
) -> Option<DVector<f64>> {
    let lower = lower_factor(matrix)?;
    let solved = lower.solve_lower_triangular_mut(&mut right)
        && lower.tr_solve_lower_triangular_mut(&mut right);
    solved.then_some(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_what_columns_one_by_one_come_to() {
        for n in [1, 7, 24, 25, 130] {
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
    fn what_is_nearly_dependent_is_factored_as_column_by_column() {
        // Sines of close orders, a little added to the diagonal.
        let a =
            DMatrix::from_fn(400, 130, |i, j| ((1.0 + 0.05 * j as f64) * i as f64 / 400.0).sin());
        let mut matrix = a.transpose() * &a;
        for j in 0..130 {
            matrix[(j, j)] *= 1.0 + 1e-12;
        }
        let x = DVector::from_fn(130, |i, _| (i as f64).cos());
        let right = &matrix * &x;
        let plain = matrix.clone().cholesky().unwrap().solve(&right);
        let left = |x: &DVector<f64>| (&matrix * x - &right).norm();
        let own = solve_positive(matrix.clone(), right.clone()).unwrap();
        assert!(
            left(&own) <= 10.0 * left(&plain) + 1e-12 * right.norm(),
            "{:e} {:e}",
            left(&own),
            left(&plain)
        );
        assert!(inverse_factor(&matrix).is_some());
    }
}
