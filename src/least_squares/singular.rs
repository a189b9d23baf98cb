//! Singular values by one-sided Jacobi rotations: slow for large matrices, exact and never failing for ours.

use nalgebra::{DMatrix, DVector, DVectorView};

use super::kernel::dot;

/// Sweeps over all pairs of columns; five are usual.
const SWEEPS: usize = 60;

/// One singular triplet of B = U Σ Vᵀ, with what U makes of a constant c.
#[derive(Debug, Clone)]
pub(super) struct Triplet {
    /// σᵢ.
    pub singular: f64,
    /// `uᵢᵀc`.
    pub projected: f64,
    /// vᵢ; zero where σᵢ is.
    pub direction: DVector<f64>,
}

/// The triplets of B in no order; without `constant` nothing is projected.
///
/// B P = Q R by column-pivoted QR; the columns of Rᵀ are then rotated until orthogonal: they become σᵢ Pᵀvᵢ, and the same
/// rotations turn Qᵀc into Uᵀc.                                                   [Hestenes 1958; Drmač & Veselić 2008]
///
/// The last rows of R, all together shorter than `cut`·σ₁/8, are left out before: they add no more than the square of that
/// to any σ², and would be the slowest to rotate.
pub(super) fn triplets(matrix: &DMatrix<f64>, constant: Option<&DVector<f64>>, cut: f64) -> Vec<Triplet> {
    let n = matrix.ncols();
    let qr = matrix.clone().col_piv_qr();
    let triangle = qr.r();
    // No row from k on is longer than √n |Rₖₖ|.
    let least = cut / (8.0 * n as f64) * triangle.get((0, 0)).map_or(0.0, |first| first.abs());
    let rank = (0..triangle.nrows()).take_while(|&k| triangle[(k, k)].abs() > least).count();
    let mut columns = triangle.rows(0, rank).transpose();
    let mut projected = DVector::zeros(rank);
    if let Some(constant) = constant {
        let mut rotated = constant.clone();
        qr.q_tr_mul(&mut rotated);
        projected.copy_from(&rotated.rows(0, rank));
    }
    orthogonalise(&mut columns, &mut projected);
    let triplet = |(column, &projected): (DVectorView<f64>, &f64)| {
        let singular = column.norm();
        let mut direction = if singular.is_normal() { column / singular } else { DVector::zeros(n) };
        qr.p().inv_permute_rows(&mut direction);
        Triplet { singular, projected, direction }
    };
    columns.column_iter().zip(projected.iter()).map(triplet).collect()
}

/// Singular values of a matrix and the directions that belong to them.
#[derive(Debug, Clone)]
pub(super) struct SingularValues {
    /// σ, largest first, n of them.
    pub values: Vec<f64>,
    /// Right singular vectors as columns, n × n; zero where σ is zero.
    pub right: DMatrix<f64>,
}

impl SingularValues {
    /// Of a matrix with at least as many rows as columns.
    pub fn of(matrix: &DMatrix<f64>) -> Self {
        let n = matrix.ncols();
        let mut found = triplets(matrix, None, 0.0);
        found.sort_by(|a, b| b.singular.total_cmp(&a.singular));
        let values = found.iter().map(|own| own.singular).chain(std::iter::repeat(0.0)).take(n).collect();
        let mut right = DMatrix::zeros(n, n);
        right.column_iter_mut().zip(&found).for_each(|(mut column, own)| column.copy_from(&own.direction));
        Self { values, right }
    }
}

/// Rotates pairs of columns until all are orthogonal, and the entries of `projected` with them.
fn orthogonalise(columns: &mut DMatrix<f64>, projected: &mut DVector<f64>) {
    let (rows, n) = columns.shape();
    let tolerance = (rows.max(1) as f64).sqrt() * f64::EPSILON;
    for _ in 0..SWEEPS {
        let mut rotated = false;
        let mut squares: Vec<f64> = columns.as_slice().chunks_exact(rows.max(1)).map(|c| dot(c, c)).collect();
        for i in 0..n {
            for j in i + 1..n {
                let (head, tail) = columns.as_mut_slice().split_at_mut(j * rows);
                let (a, b) = (&mut head[i * rows..(i + 1) * rows], &mut tail[..rows]);
                let product = dot(a, b);
                if product.abs() <= tolerance * squares[i].sqrt() * squares[j].sqrt() {
                    continue;
                }
                rotated = true;
                let (cosine, tangent) = rotation(squares[i], squares[j], product);
                let sine = cosine * tangent;
                for (a, b) in a.iter_mut().zip(&mut *b) {
                    (*a, *b) = (cosine * *a - sine * *b, sine * *a + cosine * *b);
                }
                squares[i] = updated(squares[i], -tangent * product, a);
                squares[j] = updated(squares[j], tangent * product, b);
                let (a, b) = (projected[i], projected[j]);
                (projected[i], projected[j]) = (cosine * a - sine * b, sine * a + cosine * b);
            }
        }
        if !rotated {
            break;
        }
    }
}

/// Cosine and tangent of the rotation that makes a and b orthogonal, from `aᵀa`, `bᵀb` and `aᵀb`.
fn rotation(aa: f64, bb: f64, ab: f64) -> (f64, f64) {
    let zeta = (bb - aa) / (2.0 * ab);
    let tangent = (zeta.abs() + (zeta * zeta + 1.0).sqrt()).recip().copysign(zeta);
    ((tangent * tangent + 1.0).sqrt().recip(), tangent)
}

/// `square` + `change`, formed again from the column where that cancels.
fn updated(square: f64, change: f64, column: &[f64]) -> f64 {
    let sum = square + change;
    if sum > 0.25 * square { sum } else { dot(column, column) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rank_one_is_seen_as_such() {
        let (u, v) = (DVector::from_vec(vec![1.0, 2.0, 2.0]), DVector::from_vec(vec![0.6, 0.0, 0.8]));
        let found = SingularValues::of(&(&u * v.transpose()));
        assert!((found.values[0] - 3.0).abs() < 1e-15 && found.values[1] < 1e-15 && found.values[2] < 1e-15);
        assert!((found.right.column(0).dot(&v).abs() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_matrix_is_put_together_again() {
        let matrix = DMatrix::from_fn(5, 4, |i, j| ((3 * i + 7 * j * j) as f64).sin());
        let found = SingularValues::of(&matrix);
        let squared = DMatrix::from_diagonal(&DVector::from_iterator(4, found.values.iter().map(|s| s * s)));
        let normal = &found.right * squared * found.right.transpose();
        assert!((normal - matrix.transpose() * matrix).norm() < 1e-14);
    }
}
