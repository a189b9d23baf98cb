//! Fit of bases and tools to rows after their correction.

use nalgebra::{DMatrix, DVector, Vector3};

use super::linearise::Linearisation;
use super::posterior::RowFactors;
use super::rows::AXES;
use crate::model::{Model, Pose};
use crate::problem::Problem;

/// Smallest eigenvalue of CᵀC, relative to the largest, whose direction is fitted. C holds the
/// derivatives of the positions with respect to bases and tools, scaled to unit columns.
const RANK_TOLERANCE: f64 = 1e-9;

/// Linear least-squares fit of those bases, tools and points that are no parameters of the
/// correction, to the rows that use them.
///
/// With an orthonormal basis Q of their derivatives, the fit turns errors e of the rows into e − Q
/// Qᵀ e.
pub(super) struct PlacementFit {
    /// Basis Q, shape = (3 rows, directions); 0 for rows without equilibrium.
    basis: DMatrix<f64>,
}

/// Products of Qᵀ with the corrections of all rows: with their posterior mean, and with the factor
/// of their posterior covariance.
pub(super) struct CorrectionProducts {
    mean: DVector<f64>,
    spread: DMatrix<f64>,
}

impl PlacementFit {
    /// Linearises the rows `poses` in the parameters `placed` of bases and tools, with the arm at
    /// the full parameter vector `x` of `model`. Rows that measure no position take no part.
    pub fn new(
        (problem, model, x): (&Problem, &Model, &DVector<f64>),
        placed: &[usize],
        poses: &[Pose],
    ) -> Self {
        if placed.is_empty() {
            return Self { basis: DMatrix::zeros(AXES * poses.len(), 0) };
        }
        let linearisation =
            Linearisation { problem, model, x, unknowns: placed.to_vec(), sigma: 1.0 };
        let mut columns = linearisation.jacobian(poses.to_vec());
        for (row, pose) in poses.iter().enumerate() {
            if !pose.observation.is_of_position() {
                columns.rows_mut(AXES * row, AXES).fill(0.0);
            }
        }
        Self { basis: orthonormal(columns) }
    }

    /// Returns true if at least one direction of bases or tools is fitted.
    pub fn has_columns(&self) -> bool {
        self.basis.ncols() > 0
    }

    /// Adds to `sums` the products of Qᵀ with the corrections of the rows from index `first` on.
    pub fn add_to(
        &self,
        sums: &mut Option<CorrectionProducts>,
        first: usize,
        factors: &RowFactors,
    ) {
        let basis = self.basis.rows(AXES * first, factors.mean.len());
        let (mean, spread) = (basis.tr_mul(&factors.mean), basis.tr_mul(&factors.spread));
        match sums {
            Some(sums) => {
                sums.mean += mean;
                sums.spread += spread;
            }
            None => *sums = Some(CorrectionProducts { mean, spread }),
        }
    }

    /// Subtracts from the corrections of the rows from index `first` on the part that the fit of
    /// bases and tools reproduces.
    pub fn subtract(&self, sums: &CorrectionProducts, first: usize, factors: &mut RowFactors) {
        let basis = self.basis.rows(AXES * first, factors.mean.len());
        factors.mean -= basis * &sums.mean;
        factors.spread -= basis * &sums.spread;
    }

    /// Returns the fraction of the variance of independent noise that remains in each coordinate of
    /// a row after the fit, 0 to 1.
    pub fn remaining_noise_shares(&self, row: usize) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| {
            (1.0 - self.basis.row(AXES * row + axis).norm_squared()).max(0.0)
        })
    }

    /// Fits bases and tools to the residuals that remain after the shifts \[m\], and adds their
    /// motion to the shifts.
    pub fn refit(&self, shifts: &mut [Vector3<f64>], residuals: &[Vector3<f64>]) {
        let remaining = residuals.iter().zip(shifts.iter()).flat_map(|(residual, shift)| {
            let difference = residual - shift;
            let is_usable = difference.iter().all(|value| value.is_finite());
            (0..AXES).map(move |axis| if is_usable { difference[axis] } else { 0.0 })
        });
        let remaining = DVector::from_iterator(AXES * residuals.len(), remaining);
        let explained = &self.basis * self.basis.tr_mul(&remaining);
        for (row, shift) in shifts.iter_mut().enumerate() {
            *shift += Vector3::from_fn(|axis, _| explained[AXES * row + axis]);
        }
    }
}

/// Returns an orthonormal basis of the columns of a matrix. Rows that contain a number that is not
/// finite become 0.
fn orthonormal(mut columns: DMatrix<f64>) -> DMatrix<f64> {
    for mut row in columns.row_iter_mut() {
        if row.iter().any(|value| !value.is_finite()) {
            row.fill(0.0);
        }
    }
    for mut column in columns.column_iter_mut() {
        let length = column.norm();
        if length > 0.0 {
            column /= length;
        }
    }
    let gram = columns.tr_mul(&columns).symmetric_eigen();
    let largest = gram.eigenvalues.amax();
    let kept: Vec<usize> = (0..gram.eigenvalues.len())
        .filter(|&k| gram.eigenvalues[k] > RANK_TOLERANCE * largest)
        .collect();
    let mut directions = gram.eigenvectors.select_columns(&kept);
    for (mut direction, &k) in directions.column_iter_mut().zip(&kept) {
        direction /= gram.eigenvalues[k].sqrt();
    }
    columns * directions
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_basis_spans_dependent_columns_and_leaves_the_orthogonal_part() {
        let first = DVector::from_vec(vec![1.0, 1.0, 0.0, 2.0, f64::NAN, 0.0]);
        let columns = DMatrix::from_columns(&[first.clone(), first * 3.0]);
        let basis = orthonormal(columns);
        assert_eq!(basis.shape(), (6, 1));
        let fit = PlacementFit { basis };
        let mut shifts = [Vector3::zeros(); 2];
        fit.refit(&mut shifts, &[Vector3::new(1.0, 3.0, 5.0), Vector3::new(4.0, 7.0, 8.0)]);
        // (1, 3, 4) · (1, 1, 2) / 6 = 2 times (1, 1, 2).
        assert!((shifts[0] - Vector3::new(2.0, 2.0, 0.0)).norm() < 1e-12, "{shifts:?}");
        assert!((shifts[1] - Vector3::new(4.0, 0.0, 0.0)).norm() < 1e-12, "{shifts:?}");
        assert!(
            (fit.remaining_noise_shares(1) - Vector3::new(1.0 - 4.0 / 6.0, 1.0, 1.0)).norm()
                < 1e-12
        );
    }
}
