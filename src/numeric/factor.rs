//! Factors of symmetric matrices by products of halves, which are fast where columns one by one are not.

use nalgebra::DMatrix;

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
            assert!((inverse_factor(&matrix).unwrap() * lower - DMatrix::identity(n, n)).amax() < 1e-11);
            matrix[(n - 1, n - 1)] = -1.0;
            assert!(inverse_factor(&matrix).is_none());
        }
    }
}
