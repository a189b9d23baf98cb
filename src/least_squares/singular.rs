//! Singular values by one-sided Jacobi rotations: slow for large matrices, exact and never failing for ours.

use nalgebra::{DMatrix, DVector};

use super::kernel::dot;

/// Sweeps over all pairs of columns; five are usual.
const SWEEPS: usize = 60;

/// B = U Σ Vᵀ, with what U makes of a constant c; in no order.
#[derive(Debug, Clone)]
pub(super) struct Decomposition {
    /// σᵢ vᵢ as columns.
    pub columns: DMatrix<f64>,
    /// σᵢ.
    pub singular: Vec<f64>,
    /// `uᵢᵀc`.
    pub projected: DVector<f64>,
}

impl Decomposition {
    /// Of B and c; without `constant` nothing is projected.
    ///
    /// B P = Q R by column-pivoted QR; the columns of Rᵀ are then rotated until orthogonal: they become σᵢ Pᵀvᵢ, and the same
    /// rotations turn Qᵀc into Uᵀc.                                               [Hestenes 1958; Drmač & Veselić 2008]
    ///
    /// The last rows of R, all together shorter than `cut`·σ₁/8, are left out before: they add no more than the square of that
    /// to any σ², and would be the slowest to rotate.
    pub fn new(matrix: &DMatrix<f64>, constant: Option<&DVector<f64>>, cut: f64) -> Self {
        let qr = matrix.clone().col_piv_qr();
        let triangle = qr.r();
        // No row from k on is longer than √n |Rₖₖ|.
        let least = cut / (8.0 * matrix.ncols() as f64) * triangle.get((0, 0)).map_or(0.0, |first| first.abs());
        let rank = (0..triangle.nrows()).take_while(|&k| triangle[(k, k)].abs() > least).count();
        let mut columns = triangle.rows(0, rank).transpose();
        let mut projected = DVector::zeros(rank);
        if let Some(constant) = constant {
            let mut rotated = constant.clone();
            qr.q_tr_mul(&mut rotated);
            projected.copy_from(&rotated.rows(0, rank));
        }
        orthogonalise(&mut columns, &mut projected);
        qr.p().inv_permute_rows(&mut columns);
        let singular = columns.column_iter().map(|column| column.norm()).collect();
        Self { columns, singular, projected }
    }
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
        let Decomposition { columns, singular, .. } = Decomposition::new(matrix, None, 0.0);
        let mut order: Vec<usize> = (0..singular.len()).collect();
        order.sort_by(|&a, &b| singular[b].total_cmp(&singular[a]));
        let mut values: Vec<f64> = order.iter().map(|&k| singular[k]).collect();
        values.resize(n, 0.0);
        let right =
            DMatrix::from_fn(n, n, |i, j| if values[j].is_normal() { columns[(i, order[j])] / values[j] } else { 0.0 });
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
