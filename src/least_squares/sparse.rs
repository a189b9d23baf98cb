//! Rows that involve few of many unknowns each, as the rows of one session among many do.

use std::ops::Range;

use nalgebra::{DMatrix, DVector, DVectorViewMut};

use super::triangle::MIN_BLOCKED_COLUMNS;
use super::{Block, Triangle};

/// Number of rows that are absorbed together.
const GROUP_ROWS: usize = 32;
/// Largest share of non-zero entries, 1 / this number, of rows that count as sparse.
const MIN_ENTRIES_PER_NONZERO: usize = 4;
/// Largest share of the unknowns, 1 / this number, that the first group of sparse rows involves.
const MIN_UNKNOWNS_PER_INVOLVED: usize = 2;
/// Largest share of non-zero entries, 1 / this number, of a column that counts as sparse.
const MIN_ROWS_PER_NONZERO: usize = 8;

impl Triangle {
    /// Absorbs the rows of `block` and overwrites its values. `filled(k)` bounds the number of
    /// non-zero rows of its first k columns.
    pub(super) fn reduce(&mut self, block: &mut Block, filled: impl Fn(usize) -> usize) {
        if !self.absorb_sparse(block) {
            self.reduce_dense(block, filled);
        }
    }

    /// Absorbs the rows of `block` if they are sparse; returns false, with nothing changed, if they
    /// are not.
    ///
    /// A group of rows changes only rows k of R with k in S, the columns that are not zero in the
    /// group or in another row of R with an index in S. The group and these rows of R are reduced
    /// as a problem with the unknowns S alone. If unknowns of one session precede those of all
    /// sessions, S holds the unknowns of the sessions in the group and those of all sessions.
    fn absorb_sparse(&mut self, block: &Block) -> bool {
        let (n, m) = (block.parameters, block.rows);
        if n < MIN_BLOCKED_COLUMNS || m == 0 {
            return false;
        }
        let (mut filled, most) = (0, m * n / MIN_ENTRIES_PER_NONZERO);
        for column in block.values[..m * n].chunks_exact(m) {
            filled += column.iter().filter(|value| **value != 0.0).count();
            if filled > most {
                return false;
            }
        }
        for first in (0..m).step_by(GROUP_ROWS) {
            let rows = first..m.min(first + GROUP_ROWS);
            let involved = self.involved(block, &rows);
            if first == 0 && MIN_UNKNOWNS_PER_INVOLVED * involved.len() > n {
                return false;
            }
            self.absorb_group(block, rows, &involved);
        }
        true
    }

    /// Returns the unknowns S that some rows of `block` involve, in ascending order.
    fn involved(&self, block: &Block, rows: &Range<usize>) -> Vec<usize> {
        let n = self.parameters;
        let is_filled = |j| block.column(j)[rows.clone()].iter().any(|value| *value != 0.0);
        let mut is_involved: Vec<bool> = (0..n).map(is_filled).collect();
        let mut involved = Vec::new();
        for k in 0..n {
            if is_involved[k] {
                involved.push(k);
                let row = &self.rows[k * (n + 1)..][k + 1..n];
                let behind = is_involved[k + 1..].iter_mut().zip(row);
                behind.for_each(|(is_involved, value)| *is_involved |= *value != 0.0);
            }
        }
        involved
    }

    /// Absorbs some rows of `block`, which involve these unknowns alone.
    fn absorb_group(&mut self, block: &Block, rows: Range<usize>, involved: &[usize]) {
        let (n, s) = (self.parameters, involved.len());
        let with_residual = || involved.iter().copied().chain([n]).enumerate();
        let mut part = Triangle::new(s);
        let mut group = Block::zeros(rows.len(), s);
        for (column, j) in with_residual() {
            group.column_mut(column).copy_from_slice(&block.column(j)[rows.clone()]);
            for (row, &k) in involved.iter().enumerate() {
                part.rows[row * (s + 1) + column] = self.rows[k * (n + 1) + j];
            }
        }
        part.reduce_dense(&mut group, |_| usize::MAX);
        for (column, j) in with_residual() {
            for (row, &k) in involved.iter().enumerate() {
                self.rows[k * (n + 1) + j] = part.rows[row * (s + 1) + column];
            }
        }
    }

    /// Returns the factor of the rows [`jacobian` `residual`].
    pub(crate) fn of_rows(jacobian: &DMatrix<f64>, residual: &DVector<f64>) -> Self {
        let (m, n) = jacobian.shape();
        let values = [jacobian.as_slice(), residual.as_slice()].concat();
        let mut triangle = Self::new(n);
        triangle.absorb(&mut Block { rows: m, parameters: n, values });
        triangle
    }

    /// Absorbs the rows aⱼ pⱼ + bⱼ of the first unknowns, one for each pair (aⱼ, bⱼ).
    pub(crate) fn absorb_diagonal(&mut self, rows: &[(f64, f64)]) {
        let n = self.parameters;
        let mut block = Block::zeros(rows.len(), n);
        for (j, &(slope, constant)) in rows.iter().enumerate() {
            block.column_mut(j)[j] = slope;
            block.column_mut(n)[j] = constant;
        }
        self.absorb_rows(&mut block);
    }

    /// Replaces v by R⁻ᵀ v. Entries that are zero before and after cost nothing.
    pub(crate) fn solve_transposed(&self, mut v: DVectorViewMut<f64>) {
        let n = self.parameters;
        for k in 0..n {
            if v[k] != 0.0 {
                let row = &self.rows[k * (n + 1)..][k..n];
                v[k] /= row[0];
                let value = v[k];
                let behind = v.iter_mut().skip(k + 1).zip(&row[1..]);
                behind.for_each(|(v, r)| *v -= value * r);
            }
        }
    }
}

/// Returns V Vᵀ for a square V, of whose columns many may hold few entries that are not zero.
pub(super) fn square_of_rows(v: &DMatrix<f64>) -> DMatrix<f64> {
    let n = v.nrows();
    let filled = |j: &usize| v.column(*j).iter().filter(|value| **value != 0.0).count();
    let (sparse, dense): (Vec<usize>, Vec<usize>) =
        (0..v.ncols()).partition(|j| MIN_ROWS_PER_NONZERO * filled(j) <= n);
    if n < MIN_BLOCKED_COLUMNS || sparse.len() < dense.len() {
        return v * v.transpose();
    }
    let dense = v.select_columns(&dense);
    let mut out = &dense * dense.transpose();
    for column in sparse.into_iter().map(|j| v.column(j)) {
        let entries = || column.iter().enumerate().filter(|(_, value)| **value != 0.0);
        for (i, a) in entries() {
            entries().for_each(|(j, b)| out[(j, i)] += a * b);
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Number of unknowns of each session, of all sessions, and of sessions.
    const SIZES: (usize, usize, usize) = (3, 7, 50);

    /// Returns `rows` rows of each session, [J r], with the unknowns of the sessions first.
    fn rows_of_sessions(rows: usize) -> DMatrix<f64> {
        let (each, shared, sessions) = SIZES;
        let n = each * sessions + shared;
        DMatrix::from_fn(rows * sessions, n + 1, |i, j| {
            let is_involved = j >= each * sessions || j / each == i / rows;
            f64::from(u8::from(is_involved)) * (1.7 * i as f64 + 0.3 * (j * j % 101) as f64).sin()
        })
    }

    fn block(matrix: &DMatrix<f64>) -> Block {
        let mut block = Block::zeros(matrix.nrows(), matrix.ncols() - 1);
        block.values_mut().copy_from_slice(matrix.as_slice());
        block
    }

    #[test]
    fn rows_of_sessions_keep_the_factor_sparse() {
        let (each, shared, sessions) = SIZES;
        let matrix = rows_of_sessions(5);
        let n = matrix.ncols() - 1;
        let mut triangle = Triangle::new(n);
        assert!(triangle.absorb_sparse(&block(&matrix.rows(0, 90).into_owned())));
        let mut later = Triangle::new(n);
        assert!(later.absorb_sparse(&block(&matrix.rows(90, 160).into_owned())));
        triangle.merge(&later);
        let factor = triangle.clone().into_linearisation();
        let gram = matrix.tr_mul(&matrix);
        let error = factor.triangle.tr_mul(&factor.triangle) - gram.view((0, 0), (n, n));
        assert!(error.amax() < 1e-13 * gram.amax());
        let error = factor.triangle.tr_mul(&factor.projected) - gram.view((0, n), (n, 1));
        assert!(error.amax() < 1e-13 * gram.amax());
        let filled = factor.triangle.iter().filter(|value| **value != 0.0).count();
        assert!(filled <= sessions * each * (each + shared) + shared * shared, "{filled}");

        let vector = matrix.row(12).columns(0, n).transpose();
        let mut solved = vector.clone();
        triangle.solve_transposed(solved.as_view_mut());
        assert!((factor.triangle.tr_mul(&solved) - vector).amax() < 1e-11);
        let square = square_of_rows(&factor.triangle.transpose());
        assert!((square - factor.triangle.tr_mul(&factor.triangle)).amax() < 1e-13 * gram.amax());
    }

    #[test]
    fn rows_of_all_unknowns_are_left_to_the_dense_reduction() {
        let mut triangle = Triangle::new(150);
        let mut dense = Block::zeros(40, 150);
        dense.values_mut().fill(1.0);
        assert!(!triangle.absorb_sparse(&dense));
        triangle.absorb(&mut dense.clone());
        // After dense rows, each row of a prior involves all unknowns behind.
        let mut priors = Block::zeros(150, 150);
        (0..150).for_each(|j| priors.column_mut(j)[j] = 1.0);
        let before = triangle.rows.clone();
        assert!(!triangle.absorb_sparse(&priors) && triangle.rows == before);
    }
}
