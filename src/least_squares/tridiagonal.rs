//! Eigenvalues of a symmetric matrix, with the components of one vector along its eigenvectors.

use nalgebra::{DMatrix, DVector};

use crate::numeric::kernel::{add_product, dot, subtract_two};

/// Maximum number of QL steps for one eigenvalue. Two suffice on average.
const MAX_QL_STEPS: usize = 60;

/// Returns each eigenvalue λᵢ of the symmetric matrix M = V diag(λ) Vᵀ with the component vᵢᵀc of
/// the vector c; `None` if the steps do not converge, or an entry is not finite.
///
/// Reflections make the matrix tridiagonal and implicit QL steps make it diagonal. Both are applied
/// to the vector, so that no eigenvector is formed [Golub & Van Loan 2013, sec. 8.3]. Each
/// eigenvalue is exact to rounding of the largest one.
pub(super) fn eigenvalues_with_components(
    mut matrix: DMatrix<f64>,
    vector: &DVector<f64>,
) -> Option<Vec<(f64, f64)>> {
    let (mut along, n) = (vector.as_slice().to_vec(), matrix.ncols());
    let mut off_diagonal = vec![0.0; n];
    for (j, entry) in off_diagonal.iter_mut().enumerate().take(n.saturating_sub(1)) {
        *entry = reflect(&mut matrix, j, &mut along);
    }
    let mut diagonal = matrix.diagonal().as_slice().to_vec();
    diagonalise(&mut diagonal, &mut off_diagonal, &mut along)?;
    Some(diagonal.into_iter().zip(along).collect())
}

/// Reflects the rows and columns behind j of a symmetric matrix, and the vector `along`, so that
/// column j has one entry below its diagonal. Returns that entry; column j itself is not written.
fn reflect(matrix: &mut DMatrix<f64>, j: usize, along: &mut [f64]) -> f64 {
    let (n, first) = (matrix.nrows(), j + 1);
    let mut axis = matrix.as_slice()[j * n + first..first * n].to_vec();
    let length = dot(&axis, &axis).sqrt();
    let entry = if axis[0] > 0.0 { -length } else { length };
    axis[0] -= entry;
    let square = dot(&axis, &axis);
    if square == 0.0 {
        return entry;
    }
    let scale = 2.0 / square;
    let remaining = &mut matrix.as_mut_slice()[first * n + first..];
    let mut moved = vec![0.0; axis.len()];
    add_product(&mut moved, (remaining, n), &axis);
    let half = 0.5 * scale * dot(&axis, &moved);
    moved.iter_mut().zip(&axis).for_each(|(moved, axis)| *moved = scale * (*moved - half * axis));
    for k in 0..axis.len() {
        let column = &mut remaining[k * n..][..axis.len()];
        subtract_two(column, (&axis, moved[k]), (&moved, axis[k]));
    }
    let component = scale * dot(&axis, &along[first..]);
    along[first..].iter_mut().zip(&axis).for_each(|(along, axis)| *along -= component * axis);
    entry
}

/// Replaces the `diagonal` of a symmetric tridiagonal matrix, with the entries `off_diagonal`, by
/// its eigenvalues. Replaces `along` by the components of that vector along the eigenvectors.
/// Returns `None` if the QL steps do not converge or a result is not finite.
fn diagonalise(diagonal: &mut [f64], off_diagonal: &mut [f64], along: &mut [f64]) -> Option<()> {
    let n = diagonal.len();
    for low in 0..n {
        let is_zero = |k: &usize, diagonal: &[f64], off_diagonal: &[f64]| {
            off_diagonal[*k].abs() <= f64::EPSILON * (diagonal[*k].abs() + diagonal[k + 1].abs())
        };
        let end = |diagonal: &[f64], off_diagonal: &[f64]| {
            (low..n - 1).find(|k| is_zero(k, diagonal, off_diagonal)).unwrap_or(n - 1)
        };
        let mut steps = 0;
        loop {
            let high = end(diagonal, off_diagonal);
            if high == low {
                break;
            }
            steps += 1;
            if steps > MAX_QL_STEPS {
                return None;
            }
            // Wilkinson's shift.
            let ratio = (diagonal[low + 1] - diagonal[low]) / (2.0 * off_diagonal[low]);
            let root = (ratio * ratio + 1.0).sqrt().copysign(ratio);
            let mut bulge = diagonal[high] - diagonal[low] + off_diagonal[low] / (ratio + root);
            let (mut sine, mut cosine, mut change) = (1.0, 1.0, 0.0);
            let mut is_split = false;
            for k in (low..high).rev() {
                let (f, b) = (sine * off_diagonal[k], cosine * off_diagonal[k]);
                let length = (f * f + bulge * bulge).sqrt();
                off_diagonal[k + 1] = length;
                if length == 0.0 {
                    diagonal[k + 1] -= change;
                    off_diagonal[high] = 0.0;
                    is_split = true;
                    break;
                }
                (sine, cosine) = (f / length, bulge / length);
                let g = diagonal[k + 1] - change;
                let sum = (diagonal[k] - g) * sine + 2.0 * cosine * b;
                change = sine * sum;
                diagonal[k + 1] = g + change;
                bulge = cosine * sum - b;
                let (lower, upper) = (along[k], along[k + 1]);
                along[k + 1] = sine * lower + cosine * upper;
                along[k] = cosine * lower - sine * upper;
            }
            if !is_split {
                diagonal[low] -= change;
                off_diagonal[low] = bulge;
                off_diagonal[high] = 0.0;
            }
        }
    }
    diagonal.iter().chain(&*along).all(|value| value.is_finite()).then_some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvalues_and_components_are_those_of_the_eigenvectors() {
        for n in [1, 2, 3, 40] {
            let root = DMatrix::from_fn(n, n, |i, j| ((7 * i + 13 * j + i * j) as f64).sin());
            for matrix in [root.tr_mul(&root), DMatrix::identity(n, n), DMatrix::zeros(n, n)] {
                let vector = DVector::from_fn(n, |i, _| (i as f64 + 0.5).cos());
                let mut found = eigenvalues_with_components(matrix.clone(), &vector).unwrap();
                found.sort_by(|a, b| a.0.total_cmp(&b.0));
                let mut expected = matrix.symmetric_eigenvalues().as_slice().to_vec();
                expected.sort_by(f64::total_cmp);
                for ((value, _), expected) in found.iter().zip(&expected) {
                    assert!((value - expected).abs() < 1e-12 * n as f64, "{value} {expected}");
                }
                // cᵀMᵏc = Σ λᵏ (vᵀc)².
                let mut image = vector.clone();
                for power in 0..4 {
                    let sum: f64 = found.iter().map(|(l, c)| l.powi(power) * c * c).sum();
                    let exact = vector.dot(&image);
                    assert!((sum - exact).abs() < 1e-11 * (1.0 + exact.abs()), "{sum} {exact}");
                    image = &matrix * image;
                }
            }
        }
        let empty = eigenvalues_with_components(DMatrix::zeros(0, 0), &DVector::zeros(0));
        assert_eq!(empty, Some(Vec::new()));
        assert_eq!(
            eigenvalues_with_components(DMatrix::repeat(3, 3, f64::NAN), &DVector::zeros(3)),
            None
        );
    }
}
