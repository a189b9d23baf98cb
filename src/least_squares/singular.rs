//! Singular values by one-sided Jacobi rotations: accurate and always convergent, slow for large
//! matrices.

use multiversion::multiversion;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use crate::numeric::kernel::dot;

/// Maximum number of sweeps over all pairs of columns. Usually five suffice.
const MAX_JACOBI_SWEEPS: usize = 60;
/// Number of columns in a group whose rotations one thread performs.
const GROUP_COLUMNS: usize = 32;
/// Smallest number of columns that is split into groups for threads; fewer are rotated on one
/// thread.
const MIN_PARALLEL_COLUMNS: usize = 4 * GROUP_COLUMNS;

/// Singular value decomposition B = U Σ Vᵀ, in no particular order, with the projection Uᵀc of a
/// vector c.
#[derive(Debug, Clone)]
pub(super) struct Decomposition {
    /// Right singular vectors vᵢ of the matrix B, each scaled by its singular value σᵢ, as columns.
    pub columns: DMatrix<f64>,
    /// Singular values σᵢ of the matrix B, in the order of `columns`, not sorted.
    pub singular: Vec<f64>,
    /// Projections `uᵢᵀc` of the vector c, in the order of the columns.
    pub projected: DVector<f64>,
}

impl Decomposition {
    /// Decomposes B and projects c; if `constant` is `None`, the projections are zero.
    ///
    /// B P = Q R by column-pivoted QR. The columns of Rᵀ are rotated until they are orthogonal:
    /// they become σᵢ Pᵀvᵢ, and the same rotations turn Qᵀc into Uᵀc. [Hestenes 1958; Drmač &
    /// Veselić 2008]
    ///
    /// The last rows of R whose joint norm is below `cut`·σ₁/8 are dropped first. They change each
    /// σ² by at most the square of that norm and would converge slowest.
    pub fn new(matrix: &DMatrix<f64>, constant: Option<&DVector<f64>>, cut: f64) -> Self {
        let qr = matrix.clone().col_piv_qr();
        let triangle = qr.r();
        // No row from index k on is longer than √n |Rₖₖ|.
        let least = cut / (8.0 * matrix.ncols() as f64)
            * triangle.get((0, 0)).map_or(0.0, |first| first.abs());
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

/// Singular values of a matrix with their right singular vectors, sorted.
#[derive(Debug, Clone)]
pub(super) struct SingularValues {
    /// Singular values σ in descending order, length n.
    pub values: Vec<f64>,
    /// Right singular vectors as columns, shape = (n, n); zero where σ is zero.
    pub right: DMatrix<f64>,
}

impl SingularValues {
    /// Decomposes a matrix with at least as many rows as columns.
    pub fn of(matrix: &DMatrix<f64>) -> Self {
        let n = matrix.ncols();
        let Decomposition { columns, singular, .. } = Decomposition::new(matrix, None, 0.0);
        let mut order: Vec<usize> = (0..singular.len()).collect();
        order.sort_by(|&a, &b| singular[b].total_cmp(&singular[a]));
        let mut values: Vec<f64> = order.iter().map(|&k| singular[k]).collect();
        values.resize(n, 0.0);
        let right = DMatrix::from_fn(n, n, |i, j| {
            if values[j].is_normal() { columns[(i, order[j])] / values[j] } else { 0.0 }
        });
        Self { values, right }
    }
}

/// Rotates pairs of columns until all are orthogonal; the entries of `projected` are rotated with
/// them.
fn orthogonalise(columns: &mut DMatrix<f64>, projected: &mut DVector<f64>) {
    let (rows, n) = columns.shape();
    if rows == 0 {
        return;
    }
    let size = if n < MIN_PARALLEL_COLUMNS { n.max(1) } else { GROUP_COLUMNS };
    let parts = columns.as_slice().chunks(size * rows).zip(projected.as_slice().chunks(size));
    let mut groups: Vec<ColumnGroup> =
        parts.map(|(entries, projected)| ColumnGroup::new(rows, entries, projected)).collect();
    if groups.len() > 1 && groups.len() % 2 == 1 {
        groups.push(ColumnGroup::new(rows, &[], &[]));
    }
    for _ in 0..MAX_JACOBI_SWEEPS {
        if !sweep(&mut groups) {
            break;
        }
    }
    for (group, (entries, projected)) in groups.iter().zip(
        columns
            .as_mut_slice()
            .chunks_mut(size * rows)
            .zip(projected.as_mut_slice().chunks_mut(size)),
    ) {
        entries.copy_from_slice(&group.entries);
        projected.copy_from_slice(&group.projected);
    }
}

/// Rotates every pair of columns once and returns true if any pair was not yet orthogonal.
///
/// Groups meet as in a round-robin tournament, so the order of rotations, and with it the result,
/// does not depend on the number of threads.
fn sweep(groups: &mut [ColumnGroup]) -> bool {
    groups.par_iter_mut().for_each(ColumnGroup::update_squares);
    let mut rotated =
        groups.par_iter_mut().map(ColumnGroup::rotate_within).reduce(|| false, |a, b| a | b);
    for _ in 1..groups.len() {
        let (first, second) = groups.split_at_mut(groups.len() / 2);
        let pairs = first.par_iter_mut().zip(second.par_iter_mut().rev());
        rotated |= pairs.map(|(a, b)| a.rotate_with(b)).reduce(|| false, |a, b| a | b);
        groups[1..].rotate_right(1);
    }
    rotated
}

/// Group of columns with their squared norms and projections.
struct ColumnGroup {
    rows: usize,
    /// Entries of all columns of the group, one column after the other.
    entries: Vec<f64>,
    /// Squared norm of each column of the group.
    squares: Vec<f64>,
    projected: Vec<f64>,
}

/// Column with its squared norm and its entry of the projected vector.
type Column<'a> = (&'a mut [f64], &'a mut f64, &'a mut f64);

impl ColumnGroup {
    fn new(rows: usize, entries: &[f64], projected: &[f64]) -> Self {
        Self {
            rows,
            entries: entries.to_vec(),
            squares: vec![0.0; projected.len()],
            projected: projected.to_vec(),
        }
    }

    /// Computes the squared norms from the columns.
    fn update_squares(&mut self) {
        let columns = self.entries.chunks_exact(self.rows);
        self.squares
            .iter_mut()
            .zip(columns)
            .for_each(|(square, column)| *square = dot(column, column));
    }

    fn columns(&mut self) -> impl Iterator<Item = Column<'_>> {
        let numbers = self.squares.iter_mut().zip(&mut self.projected);
        self.entries
            .chunks_exact_mut(self.rows)
            .zip(numbers)
            .map(|(column, (square, entry))| (column, square, entry))
    }

    /// Rotates every pair of columns of the group; returns true if any rotation was needed.
    fn rotate_within(&mut self) -> bool {
        let mut columns: Vec<Column> = self.columns().collect();
        let mut rotated = false;
        let mut remaining = columns.as_mut_slice();
        while let [first, others @ ..] = remaining {
            for other in &mut *others {
                rotated |= rotate(first, other);
            }
            remaining = others;
        }
        rotated
    }

    /// Rotates each column of the group with each column of `other`; returns true if any rotation
    /// was needed.
    fn rotate_with(&mut self, other: &mut Self) -> bool {
        let mut others: Vec<Column> = other.columns().collect();
        let mut rotated = false;
        for mut column in self.columns() {
            for other in &mut others {
                rotated |= rotate(&mut column, other);
            }
        }
        rotated
    }
}

/// Rotates two columns (entries, squared norm, entry of the projected vector) so that they become
/// orthogonal. Returns false if they already are, within rounding.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2"))]
fn rotate((a, aa, ca): &mut Column, (b, bb, cb): &mut Column) -> bool {
    let product = dot(a, b);
    let tolerance = (a.len() as f64).sqrt() * f64::EPSILON;
    if product.abs() <= tolerance * aa.sqrt() * bb.sqrt() {
        return false;
    }
    let (cosine, tangent) = jacobi_rotation(**aa, **bb, product);
    let sine = cosine * tangent;
    let rows = a.len().min(b.len());
    let (left, right) = (&mut a[..rows], &mut b[..rows]);
    for i in 0..rows {
        let (x, y) = (left[i], right[i]);
        left[i] = cosine * x - sine * y;
        right[i] = sine * x + cosine * y;
    }
    **aa = updated_square(**aa, -tangent * product, a);
    **bb = updated_square(**bb, tangent * product, b);
    (**ca, **cb) = (cosine * **ca - sine * **cb, sine * **ca + cosine * **cb);
    true
}

/// Returns cosine and tangent of the rotation that makes a and b orthogonal, from `aᵀa`, `bᵀb` and
/// `aᵀb`.
fn jacobi_rotation(aa: f64, bb: f64, ab: f64) -> (f64, f64) {
    let zeta = (bb - aa) / (2.0 * ab);
    let tangent = (zeta.abs() + (zeta * zeta + 1.0).sqrt()).recip().copysign(zeta);
    ((tangent * tangent + 1.0).sqrt().recip(), tangent)
}

/// Returns `square` + `change`, recomputed from the column if the sum cancels.
#[inline(always)]
#[expect(clippy::inline_always, reason = "for every kind of processor")]
fn updated_square(square: f64, change: f64, column: &[f64]) -> f64 {
    let sum = square + change;
    if sum > 0.25 * square { sum } else { dot(column, column) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rank_one_is_seen_as_such() {
        let (u, v) =
            (DVector::from_vec(vec![1.0, 2.0, 2.0]), DVector::from_vec(vec![0.6, 0.0, 0.8]));
        let decomposition = SingularValues::of(&(&u * v.transpose()));
        assert!(
            (decomposition.values[0] - 3.0).abs() < 1e-15
                && decomposition.values[1] < 1e-15
                && decomposition.values[2] < 1e-15
        );
        assert!((decomposition.right.column(0).dot(&v).abs() - 1.0).abs() < 1e-15);
    }

    #[test]
    fn a_matrix_is_put_together_again() {
        for (rows, n) in [(5, 4), (170, 161), (200, 192)] {
            let matrix =
                DMatrix::from_fn(rows, n, |i, j| ((1 + 3 * i + 7 * j + i * j) as f64).sin());
            let constant = DVector::from_fn(rows, |i, _| (2.3 * i as f64).cos());
            let Decomposition { columns, singular, projected } =
                Decomposition::new(&matrix, Some(&constant), 0.0);
            let tolerance = 1e-14 * matrix.norm_squared();
            assert!(
                (&columns * columns.transpose() - matrix.transpose() * &matrix).norm() < tolerance
            );
            // Σ σᵢ vᵢ uᵢᵀc = Bᵀc
            assert!((&columns * projected - matrix.transpose() * constant).norm() < tolerance);
            let orthogonal = columns.transpose() * &columns;
            let squares =
                DMatrix::from_diagonal(&DVector::from_iterator(n, singular.iter().map(|s| s * s)));
            assert!((orthogonal - squares).norm() < tolerance);
        }
    }
}
