//! Factors of symmetric matrices by products of halves, which are fast where columns one by one are not.

use nalgebra::{DMatrix, DVector};

/// Rows up to which a matrix is factored column by column.
const FEW: usize = 24;

/// L⁻¹ of M = L Lᵀ, of which the lower half is read; `None` where M is not positive definite.
///
/// With M = (A · ; B C) and W = L⁻¹ of A: L = (W⁻¹ 0 ; B Wᵀ X⁻¹), X = L⁻¹ of C − B Wᵀ W Bᵀ, and L⁻¹ = (W 0 ; −X B Wᵀ W, X).
pub(crate) fn inverse_factor(matrix: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    if n <= FEW {
        let factor = matrix.clone().cholesky()?;
        return factor.l_dirty().solve_lower_triangular(&DMatrix::identity(n, n));
    }
    let (half, rest) = (n / 2, n - n / 2);
    let first = inverse_factor(&matrix.view((0, 0), (half, half)).into_owned())?;
    let beside = matrix.view((half, 0), (rest, half)) * first.transpose();
    let mut last = matrix.view((half, half), (rest, rest)).into_owned();
    last.gemm(-1.0, &beside, &beside.transpose(), 1.0);
    let last = inverse_factor(&last)?;
    let mut all = DMatrix::zeros(n, n);
    all.view_mut((half, 0), (rest, half)).gemm(-1.0, &last, &(beside * &first), 0.0);
    all.view_mut((0, 0), (half, half)).copy_from(&first);
    all.view_mut((half, half), (rest, rest)).copy_from(&last);
    Some(all)
}

/// Columns that are factored together.
const PANEL: usize = 64;

/// x of M x = b, M positive definite, of which the lower half is read and lost; `None` where M is not.
///
/// Panel after panel: with M = (A · ; B C), W = L⁻¹ of A and P = B Wᵀ, what is left is C − P Pᵀ, and of b comes off P W b.
pub(crate) fn solve_positive(mut matrix: DMatrix<f64>, mut right: DVector<f64>) -> Option<DVector<f64>> {
    let n = matrix.nrows();
    let mut panels = Vec::new();
    for first in (0..n).step_by(PANEL) {
        let (wide, behind) = (PANEL.min(n - first), (first + PANEL).min(n));
        let root = inverse_factor(&matrix.view((first, first), (wide, wide)).into_owned())?;
        let panel = matrix.view((behind, first), (n - behind, wide)) * root.transpose();
        let across = panel.transpose();
        for next in (behind..n).step_by(PANEL) {
            let (count, place) = (PANEL.min(n - next), next - behind);
            let mut left = matrix.view_mut((next, next), (n - next, count));
            left.gemm(-1.0, &panel.rows_range(place..), &across.columns(place, count), 1.0);
        }
        let own = &root * right.rows(first, wide);
        right.rows_range_mut(behind..).gemv(-1.0, &panel, &own, 1.0);
        right.rows_mut(first, wide).copy_from(&own);
        panels.push((first, root, panel));
    }
    for (first, root, panel) in panels.into_iter().rev() {
        let (wide, behind) = (root.ncols(), first + root.ncols());
        let mut own = right.rows(first, wide).into_owned();
        own.gemv_tr(-1.0, &panel, &right.rows_range(behind..), 1.0);
        right.rows_mut(first, wide).copy_from(&root.tr_mul(&own));
    }
    Some(right)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_what_columns_one_by_one_come_to() {
        for n in [1, 7, 24, 25, 130] {
            let a = DMatrix::from_fn(n + 3, n, |i, j| ((12.9898 * i as f64 + 78.233 * j as f64).sin() * 43.7) % 1.0);
            let mut matrix = DMatrix::identity(n, n) * 0.1 + a.transpose() * a;
            let lower = matrix.clone().cholesky().unwrap().l();
            matrix.fill_upper_triangle(f64::NAN, 1);
            assert!((inverse_factor(&matrix).unwrap() * &lower - DMatrix::identity(n, n)).amax() < 1e-11);
            let x = DVector::from_fn(n, |i, _| (i as f64).cos());
            let right = &lower * lower.tr_mul(&x);
            assert!((solve_positive(matrix.clone(), right.clone()).unwrap() - x).amax() < 1e-10);
            matrix[(n - 1, n - 1)] = -1.0;
            assert!(inverse_factor(&matrix).is_none() && solve_positive(matrix, right).is_none());
        }
    }
}
