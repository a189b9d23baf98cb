//! Singular values by one-sided Jacobi rotations: slow for large matrices, exact and never failing
//! for ours.

use multiversion::multiversion;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::kernel::dot;

/// Sweeps over all pairs of columns; five are usual.
const SWEEPS: usize = 60;
/// Columns that one thread rotates against as many others at a time, and how many there must be for
/// that: fewer are one thread's.
const TOGETHER: usize = 32;
const WORTH_THREADS: usize = 4 * TOGETHER;

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
    /// B P = Q R by column-pivoted QR; the columns of Rᵀ are then rotated until orthogonal: they
    /// become σᵢ Pᵀvᵢ, and the same rotations turn Qᵀc into Uᵀc.
    /// [Hestenes 1958; Drmač & Veselić 2008]
    ///
    /// The last rows of R, all together shorter than `cut`·σ₁/8, are left out before: they add no
    /// more than the square of that to any σ², and would be the slowest to rotate.
    pub fn new(matrix: &DMatrix<f64>, constant: Option<&DVector<f64>>, cut: f64) -> Self {
        let qr = matrix.clone().col_piv_qr();
        let triangle = qr.r();
        // No row from k on is longer than √n |Rₖₖ|.
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
        let right = DMatrix::from_fn(n, n, |i, j| {
            if values[j].is_normal() { columns[(i, order[j])] / values[j] } else { 0.0 }
        });
        Self { values, right }
    }
}

/// Rotates pairs of columns until all are orthogonal, and the entries of `projected` with them.
fn orthogonalise(columns: &mut DMatrix<f64>, projected: &mut DVector<f64>) {
    let (rows, n) = columns.shape();
    if rows == 0 {
        return;
    }
    let together = if n < WORTH_THREADS { n.max(1) } else { TOGETHER };
    let parts =
        columns.as_slice().chunks(together * rows).zip(projected.as_slice().chunks(together));
    let mut parts: Vec<Part> =
        parts.map(|(entries, projected)| Part::new(rows, entries, projected)).collect();
    if parts.len() > 1 && parts.len() % 2 == 1 {
        parts.push(Part::new(rows, &[], &[]));
    }
    for _ in 0..SWEEPS {
        if !sweep(&mut parts) {
            break;
        }
    }
    for (part, (entries, projected)) in parts.iter().zip(
        columns
            .as_mut_slice()
            .chunks_mut(together * rows)
            .zip(projected.as_mut_slice().chunks_mut(together)),
    ) {
        entries.copy_from_slice(&part.entries);
        projected.copy_from_slice(&part.projected);
    }
}

/// Every pair of columns once, whether any was rotated. Parts meet as in a tournament: in each
/// round every one meets another, on whatever thread, so that results are the same for any number
/// of them.
fn sweep(parts: &mut [Part]) -> bool {
    parts.par_iter_mut().for_each(Part::measure);
    let mut rotated =
        parts.par_iter_mut().map(Part::among_themselves).reduce(|| false, |a, b| a | b);
    for _ in 1..parts.len() {
        let (near, far) = parts.split_at_mut(parts.len() / 2);
        let pairs = near.par_iter_mut().zip(far.par_iter_mut().rev());
        rotated |= pairs.map(|(a, b)| a.against(b)).reduce(|| false, |a, b| a | b);
        parts[1..].rotate_right(1);
    }
    rotated
}

/// Some of the columns.
struct Part {
    rows: usize,
    /// One column after the other.
    entries: Vec<f64>,
    /// The square of each.
    squares: Vec<f64>,
    projected: Vec<f64>,
}

/// A column, its square and its entry of what is projected.
type Column<'a> = (&'a mut [f64], &'a mut f64, &'a mut f64);

impl Part {
    fn new(rows: usize, entries: &[f64], projected: &[f64]) -> Self {
        Self {
            rows,
            entries: entries.to_vec(),
            squares: vec![0.0; projected.len()],
            projected: projected.to_vec(),
        }
    }

    /// Forms the squares anew.
    fn measure(&mut self) {
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

    /// Rotates every pair of its columns.
    fn among_themselves(&mut self) -> bool {
        let mut columns: Vec<Column> = self.columns().collect();
        let mut rotated = false;
        let mut left = columns.as_mut_slice();
        while let [own, others @ ..] = left {
            for other in &mut *others {
                rotated |= rotate(own, other);
            }
            left = others;
        }
        rotated
    }

    /// Rotates each of its columns with each of those of `other`.
    fn against(&mut self, other: &mut Self) -> bool {
        let mut others: Vec<Column> = other.columns().collect();
        let mut rotated = false;
        for mut own in self.columns() {
            for other in &mut others {
                rotated |= rotate(&mut own, other);
            }
        }
        rotated
    }
}

/// Makes two columns orthogonal, unless they are to within rounding.
#[multiversion(targets("x86_64+avx2"))]
fn rotate((a, aa, ca): &mut Column, (b, bb, cb): &mut Column) -> bool {
    let product = dot(a, b);
    let tolerance = (a.len() as f64).sqrt() * f64::EPSILON;
    if product.abs() <= tolerance * aa.sqrt() * bb.sqrt() {
        return false;
    }
    let (cosine, tangent) = rotation(**aa, **bb, product);
    let sine = cosine * tangent;
    for (a, b) in a.iter_mut().zip(b.iter_mut()) {
        (*a, *b) = (cosine * *a - sine * *b, sine * *a + cosine * *b);
    }
    **aa = updated(**aa, -tangent * product, a);
    **bb = updated(**bb, tangent * product, b);
    (**ca, **cb) = (cosine * **ca - sine * **cb, sine * **ca + cosine * **cb);
    true
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
        let (u, v) =
            (DVector::from_vec(vec![1.0, 2.0, 2.0]), DVector::from_vec(vec![0.6, 0.0, 0.8]));
        let found = SingularValues::of(&(&u * v.transpose()));
        assert!(
            (found.values[0] - 3.0).abs() < 1e-15
                && found.values[1] < 1e-15
                && found.values[2] < 1e-15
        );
        assert!((found.right.column(0).dot(&v).abs() - 1.0).abs() < 1e-15);
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
