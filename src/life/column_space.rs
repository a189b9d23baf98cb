//! Spaces that columns of the sensitivities of rows span.

use nalgebra::{DMatrix, DVector};

use super::rows::SensitiveRows;

/// Largest part of a column outside of a space, relative to the column, at which the column counts
/// as one of the space. Derivatives have a relative error of about 1e-10.
pub(super) const MAX_OUTSIDE: f64 = 1e-7;

/// Space that columns of the sensitivities span.
pub(super) struct ColumnSpace {
    /// Orthonormal basis, one column for each dimension.
    pub basis: DMatrix<f64>,
}

impl ColumnSpace {
    /// Creates the space of some columns by Gram–Schmidt orthogonalisation, done twice.
    pub fn new(rows: &SensitiveRows, columns: &[usize]) -> Self {
        let mut space = Self { basis: DMatrix::zeros(rows.sensitivity.nrows(), 0) };
        for &k in columns {
            let column = rows.sensitivity.column(k).into_owned();
            let outside = space.outside(&space.outside(&column));
            let (length, whole) = (outside.norm(), column.norm());
            if length > MAX_OUTSIDE * whole {
                let place = space.basis.ncols();
                space.basis = space.basis.insert_column(place, 0.0);
                space.basis.set_column(place, &(outside / length));
            }
        }
        space
    }

    /// Returns the part of a vector that is orthogonal to the space.
    pub fn outside(&self, vector: &DVector<f64>) -> DVector<f64> {
        vector - &self.basis * self.basis.tr_mul(vector)
    }

    /// Returns the parts of the columns of a matrix that are orthogonal to the space.
    pub fn outside_of(&self, matrix: &DMatrix<f64>) -> DMatrix<f64> {
        matrix - &self.basis * self.basis.tr_mul(matrix)
    }

    /// Returns true if the columns lie in the space and at least one of them is not zero.
    pub fn contains(&self, rows: &SensitiveRows, columns: &[usize]) -> bool {
        let parts = columns.iter().map(|&k| {
            let column = rows.sensitivity.column(k).into_owned();
            (self.outside(&column).norm(), column.norm())
        });
        let parts: Vec<(f64, f64)> = parts.collect();
        parts.iter().all(|(outside, whole)| *outside <= MAX_OUTSIDE * whole)
            && parts.iter().any(|(_, whole)| *whole > 0.0)
    }
}
