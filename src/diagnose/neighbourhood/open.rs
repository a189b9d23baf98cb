//! Directions that active constraints leave to the unknowns of a fit.

use nalgebra::DMatrix;

/// An eigenvalue of AᵀA, the rows of A of length one, below which all of them leave its direction open.
const OPEN: f64 = 1e-10;

/// Z with A D⁻¹ Z = 0 and ZᵀZ = I for the rows A of active constraints, shape = (constraints, n), and the scale D of the
/// unknowns; `None` where nothing holds them.
pub(in crate::diagnose) fn open(closed: &DMatrix<f64>, scale: &[f64]) -> Option<DMatrix<f64>> {
    let mut rows = DMatrix::from_fn(closed.nrows(), closed.ncols(), |i, j| closed[(i, j)] / scale[j]);
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
    let left: Vec<usize> = (0..closed.ncols()).filter(|&k| eigen.eigenvalues[k] < OPEN).collect();
    Some(eigen.eigenvectors.select_columns(&left))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_open_keeps_every_constraint() {
        // The third row follows from the others, the last says nothing.
        let closed = DMatrix::from_row_slice(4, 4, &[1., -1., 0., 0., 0., 0., 2., 0., 1., -1., 2., 0., 0., 0., 0., 0.]);
        let scale = [10.0, 1.0, 1e-3, 5.0];
        let left = open(&closed, &scale).unwrap_or_default();
        assert_eq!(left.shape(), (4, 2));
        assert!((left.transpose() * &left - DMatrix::identity(2, 2)).amax() < 1e-14);
        let moved = DMatrix::from_fn(4, 2, |j, k| left[(j, k)] / scale[j]);
        assert!((closed * moved).amax() < 1e-12);
        assert_eq!(open(&DMatrix::zeros(1, 3), &[1.0; 3]), None);
    }
}
