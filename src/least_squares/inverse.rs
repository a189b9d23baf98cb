//! Inverses of upper triangles, which show at little cost that a matrix is well conditioned.

use nalgebra::{DMatrix, DVector};

use crate::numeric::kernel::{dot, norm};

/// Largest share of non-zero entries, 1 / this number, of a row that is multiplied entry by entry.
const MIN_ENTRIES_PER_NONZERO: usize = 8;

/// Returns R⁻¹ if every singular value of R is certainly above `least` times the largest; `None`
/// otherwise, or if R is not upper triangular.
///
/// Requires columns of norm at most one, so that `σ₁ ≤ √n`; the test uses `σₙ ≥ 1/‖R⁻¹‖`.
pub(super) fn regular_inverse(triangle: &DMatrix<f64>, least: f64) -> Option<DMatrix<f64>> {
    let n = triangle.ncols();
    if !is_upper(triangle) {
        return None;
    }
    let mut inverse = DMatrix::zeros(n, n);
    for (j, column) in inverse.as_mut_slice().chunks_exact_mut(n.max(1)).enumerate() {
        column[j] = 1.0;
        for k in (0..=j).rev() {
            if column[k] == 0.0 {
                continue;
            }
            let upper = &triangle.as_slice()[k * n..=k * n + k];
            let value = column[k] / upper[k];
            column[k] = value;
            column[..k].iter_mut().zip(upper).for_each(|(x, r)| *x -= value * r);
        }
    }
    let certain = norm(inverse.as_slice()) * (n as f64).sqrt() * least <= 1.0;
    certain.then_some(inverse)
}

/// Returns Σ wⱼ² ‖eⱼᵀ R⁻¹‖², the weighted squared norms of rows of R⁻¹, over the pairs (j, wⱼ) of
/// `weighted`. Returns `None` if R is not upper triangular.
pub(super) fn sum_of_inverse_row_squares(
    triangle: &DMatrix<f64>,
    weighted: impl Iterator<Item = (usize, f64)>,
) -> Option<f64> {
    let n = triangle.ncols();
    if !is_upper(triangle) {
        return None;
    }
    let mut row = DVector::zeros(n);
    // Entries of the row that are not zero: few if the triangle is sparse.
    let mut filled = Vec::with_capacity(n);
    let squares = weighted.map(|(j, weight)| {
        row[j] = weight / triangle[(j, j)];
        filled.clear();
        filled.push(j);
        for i in j + 1..n {
            let column = &triangle.as_slice()[i * n..(i + 1) * n];
            let sum = if MIN_ENTRIES_PER_NONZERO * filled.len() < i - j {
                filled.iter().map(|&k| column[k] * row[k]).sum()
            } else {
                dot(&column[j..i], &row.as_slice()[j..i])
            };
            row[i] = -sum / column[i];
            if row[i] != 0.0 {
                filled.push(i);
            }
        }
        row.rows_range(j..).norm_squared()
    });
    Some(squares.sum())
}

/// Returns true if a matrix is square and zero below its diagonal.
fn is_upper(matrix: &DMatrix<f64>) -> bool {
    let below = |(j, column): (usize, &[f64])| column[j + 1..].iter().all(|value| *value == 0.0);
    matrix.is_square()
        && matrix.as_slice().chunks_exact(matrix.nrows().max(1)).enumerate().all(below)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverses_are_those_of_well_conditioned_upper_triangles_alone() {
        let entry = |i: usize, j: usize| {
            if i <= j { ((1 + 3 * i + 7 * j + i * j) as f64).sin() + 2.0 } else { 0.0 }
        };
        let mut triangle = DMatrix::from_fn(9, 9, entry);
        triangle.column_iter_mut().for_each(|mut column| {
            column.normalize_mut();
        });
        let inverse = regular_inverse(&triangle, 1e-12).unwrap();
        assert!((&triangle * &inverse - DMatrix::identity(9, 9)).amax() < 1e-12 * inverse.amax());
        let expected = 4.0 * inverse.row(3).norm_squared() + 0.25 * inverse.row(8).norm_squared();
        let found =
            sum_of_inverse_row_squares(&triangle, [(3, 2.0), (8, 0.5)].into_iter()).unwrap();
        assert!((found / expected - 1.0).abs() < 1e-12);
        let (condition, smallest) = (1.0 / inverse.norm(), 1e-5 * triangle[(8, 8)]);
        assert!(
            regular_inverse(&triangle, condition).is_none()
                && regular_inverse(&triangle, 0.3 * condition).is_some()
        );
        triangle[(8, 8)] = smallest;
        assert!(regular_inverse(&triangle, 1e-4).is_none());
        triangle[(8, 8)] = 0.0;
        assert!(regular_inverse(&triangle, 1e-12).is_none());
        assert!(
            !sum_of_inverse_row_squares(&triangle, [(3, 1.0)].into_iter()).unwrap().is_finite()
        );
        assert!(regular_inverse(&triangle.transpose(), 1e-12).is_none());
        assert_eq!(regular_inverse(&DMatrix::zeros(0, 0), 1.0), Some(DMatrix::zeros(0, 0)));
    }
}
