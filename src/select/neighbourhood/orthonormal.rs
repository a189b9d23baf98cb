//! Orthonormal bases of columns, with one rule for their rank.

use std::borrow::Cow;

use nalgebra::DMatrix;

use crate::numeric::kernel::{dot, sum_of_squares};
use crate::numeric::parallel;
use crate::numeric::{
    gram, inverse_factor, inverse_lower, multiply_by_upper, product, product_with_upper,
    product_with_upper_padded, zeros,
};

/// Smallest fraction of a column's length outside the span of earlier columns at which the column
/// is linearly independent.
///
/// Products of columns are exact to about 1e-15 of their lengths, so a remaining squared length is
/// known to about 1e-14. Below 1e-12, the square of this fraction, it is rounding.
pub(crate) const MIN_INDEPENDENT_LENGTH: f64 = 1e-6;

/// Returns Q = A W with QᵀQ = I for the columns A, and W, shape = (columns, rank). Columns that are
/// not finite or depend linearly on earlier ones have zero rows in W. `lengths` are the columns'
/// lengths before earlier projections.
///
/// It uses Cholesky factors of the Gram matrix of the independent columns, twice [Yamamoto et al.
/// 2015].
pub(super) fn orthonormal(
    columns: &DMatrix<f64>,
    lengths: Option<&[f64]>,
) -> (DMatrix<f64>, DMatrix<f64>) {
    orthonormal_above(Cow::Borrowed(columns), &[], lengths)
}

/// Returns Q and W of [`orthonormal`] for columns with additional rows `below` them. Each row has
/// one entry, given by its column index and value. An owned matrix of columns is overwritten.
pub(super) fn orthonormal_above(
    columns: Cow<DMatrix<f64>>,
    below: &[(usize, f64)],
    lengths: Option<&[f64]>,
) -> (DMatrix<f64>, DMatrix<f64>) {
    let (rows, n) = columns.shape();
    let mut products = gram(&columns);
    for &(j, value) in below {
        products[(j, j)] += value * value;
    }
    let norms: Vec<f64> = products.diagonal().iter().map(|square| square.sqrt()).collect();
    let (kept, first) = independent(&products, &norms, lengths.unwrap_or(&norms));
    // The factor L⁻ᵀ transforms columns with the Gram matrix L Lᵀ to orthonormal ones.
    let mut turn = inverse_lower(&first).transpose();
    turn.row_iter_mut().zip(&kept).for_each(|(mut row, &j)| row.unscale_mut(norms[j]));
    let independent_columns =
        if kept.len() == n { columns } else { Cow::Owned(columns.select_columns(&kept)) };
    let mut basis = match independent_columns {
        Cow::Borrowed(independent_columns) => {
            product_with_upper_padded(independent_columns, &turn, below.len())
        }
        Cow::Owned(mut independent_columns) => {
            multiply_by_upper(&mut independent_columns, &turn);
            independent_columns.resize_vertically(rows + below.len(), 0.0)
        }
    };
    for (row, (j, value)) in below.iter().enumerate() {
        if let Ok(k) = kept.binary_search(j) {
            basis.row_mut(rows + row).copy_from(&(turn.row(k) * *value));
        }
    }
    // A second pass removes the rounding errors of the first.
    let again = inverse_factor(&gram(&basis)).map(|inverse| inverse.transpose());
    let Some(again) = again else {
        return (DMatrix::zeros(basis.nrows(), 0), DMatrix::zeros(n, 0));
    };
    multiply_by_upper(&mut basis, &again);
    let turn = product_with_upper(&turn, &again);
    let mut within = DMatrix::zeros(n, kept.len());
    kept.iter().zip(turn.row_iter()).for_each(|(&j, row)| within.set_row(j, &row));
    (basis, within)
}

/// Returns the indices of linearly independent columns, and the Cholesky factor of their Gram
/// matrix after scaling to unit length. `norms` are the columns' lengths, `lengths` those before
/// earlier projections.
fn independent(gram: &DMatrix<f64>, norms: &[f64], lengths: &[f64]) -> (Vec<usize>, DMatrix<f64>) {
    let mut kept: Vec<usize> = Vec::new();
    let mut factor: Vec<Vec<f64>> = Vec::new();
    for j in (0..gram.ncols())
        .filter(|&j| norms[j] > MIN_INDEPENDENT_LENGTH * lengths[j] && norms[j].is_finite())
    {
        let mut row: Vec<f64> = Vec::with_capacity(kept.len() + 1);
        for (&k, factor_row) in kept.iter().zip(&factor) {
            let along = dot(&factor_row[..row.len()], &row);
            let value = (gram[(k, j)] / (norms[k] * norms[j]) - along) / factor_row[row.len()];
            row.push(value);
        }
        let independent_square = 1.0 - sum_of_squares(&row);
        if independent_square.max(0.0).sqrt() * norms[j] > MIN_INDEPENDENT_LENGTH * lengths[j] {
            row.push(independent_square.sqrt());
            factor.push(row);
            kept.push(j);
        }
    }
    let lower =
        DMatrix::from_fn(kept.len(), kept.len(), |i, j| if j <= i { factor[i][j] } else { 0.0 });
    (kept, lower)
}

/// Returns a basis Z of the directions that the active constraints leave free: A D⁻¹ Z = 0 and ZᵀZ
/// = I, for constraint rows A = `active`, shape = (constraints, n), and the scale D of the
/// unknowns. `None` if there are no constraints.
fn free_directions(active: &DMatrix<f64>, scale: &[f64]) -> Option<DMatrix<f64>> {
    let mut rows =
        DMatrix::from_fn(active.nrows(), active.ncols(), |i, j| active[(i, j)] / scale[j]);
    if rows.iter().all(|coefficient| *coefficient == 0.0) {
        return None;
    }
    for mut row in rows.row_iter_mut() {
        let length = row.norm();
        if length > 0.0 {
            row /= length;
        }
    }
    let eigen = (rows.transpose() * &rows).symmetric_eigen();
    let free_directions: Vec<usize> = (0..active.ncols())
        .filter(|&k| eigen.eigenvalues[k] < MIN_INDEPENDENT_LENGTH * MIN_INDEPENDENT_LENGTH)
        .collect();
    Some(eigen.eigenvectors.select_columns(&free_directions))
}

/// Returns Q and T for the Jacobian with additional rows `below`, as [`orthonormal_above`] does,
/// but only for the directions that the constraints `active` leave free.
pub(super) fn constrained(
    jacobian: &DMatrix<f64>,
    below: &[(usize, f64)],
    active: &DMatrix<f64>,
) -> (DMatrix<f64>, DMatrix<f64>) {
    let rows = jacobian.nrows();
    let mut columns = lengthened(jacobian, below.len());
    below.iter().enumerate().for_each(|(row, &(j, value))| columns[(rows + row, j)] = value);
    let scale: Vec<f64> =
        columns.column_iter().map(|c| c.norm()).map(|s| if s > 0.0 { s } else { 1.0 }).collect();
    let Some(free_directions) = free_directions(active, &scale) else {
        return orthonormal(&columns, None);
    };
    columns.column_iter_mut().zip(&scale).for_each(|(mut column, scale)| column /= *scale);
    let (basis, within) = orthonormal(&product(&columns, &free_directions), None);
    let mut root = free_directions * within;
    root.row_iter_mut().zip(&scale).for_each(|(mut row, scale)| row /= *scale);
    (basis, root)
}

/// Returns a matrix with `more` rows of zeros appended.
pub(super) fn lengthened(matrix: &DMatrix<f64>, more: usize) -> DMatrix<f64> {
    let (rows, n) = matrix.shape();
    let mut long = zeros(rows + more, n);
    parallel::write_chunks(long.as_mut_slice(), (rows + more).max(1), &|j, out| {
        out[..rows].copy_from_slice(matrix.column(j).as_slice());
    });
    long
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_open_keeps_every_constraint() {
        // The third row depends linearly on the others; the last one is zero.
        let active = DMatrix::from_row_slice(
            4,
            4,
            &[1., -1., 0., 0., 0., 0., 2., 0., 1., -1., 2., 0., 0., 0., 0., 0.],
        );
        let scale = [10.0, 1.0, 1e-3, 5.0];
        let basis = free_directions(&active, &scale).unwrap_or_default();
        assert_eq!(basis.shape(), (4, 2));
        assert!((basis.transpose() * &basis - DMatrix::identity(2, 2)).amax() < 1e-14);
        let moved = DMatrix::from_fn(4, 2, |j, k| basis[(j, k)] / scale[j]);
        assert!((active * moved).amax() < 1e-12);
        assert_eq!(free_directions(&DMatrix::zeros(1, 3), &[1.0; 3]), None);
    }

    #[test]
    fn columns_that_nearly_depend_on_others_keep_a_basis() {
        let columns =
            DMatrix::from_fn(300, 60, |i, j| ((1.0 + 0.02 * j as f64) * i as f64 / 300.0).sin());
        let (basis, within) = orthonormal(&columns, None);
        assert!(basis.ncols() > 3 && within.ncols() == basis.ncols(), "{}", basis.ncols());
        assert!(
            (basis.transpose() * &basis - DMatrix::identity(basis.ncols(), basis.ncols())).amax()
                < 1e-10
        );
    }

    #[test]
    fn rows_below_are_rows_of_the_columns() {
        let mut columns =
            DMatrix::from_fn(200, 40, |i, j| ((1.0 + 0.3 * j as f64) * i as f64 / 20.0).sin());
        // The columns include a sum of the first two, one of zeros in the data rows with a prior
        // row, and one that contains NaN.
        let sum = columns.column(0) + columns.column(1);
        columns.set_column(7, &sum);
        columns.column_mut(9).fill(0.0);
        columns.column_mut(11)[3] = f64::NAN;
        let below = [(9, 2.0), (3, 5.0), (11, 1.0)];
        let mut stacked = columns.clone().resize_vertically(203, 0.0);
        below.iter().enumerate().for_each(|(row, &(j, value))| stacked[(200 + row, j)] = value);
        let ((basis, within), (expected, turn)) =
            (orthonormal_above(Cow::Borrowed(&columns), &below, None), orthonormal(&stacked, None));
        let (same, _) = orthonormal_above(Cow::Owned(columns), &below, None);
        assert!((same - &basis).amax() < 1e-13);
        assert_eq!((basis.shape(), within.shape()), ((203, 38), (40, 38)));
        assert!(
            (&basis - expected).amax() < 1e-10 && (&within - turn).amax() < 1e-10 * within.amax()
        );
        assert!((basis.transpose() * &basis - DMatrix::identity(38, 38)).amax() < 1e-13);
    }
}
