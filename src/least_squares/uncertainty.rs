//! Covariance of the estimate of a fit.

use nalgebra::{DMatrix, DVector};

use super::Triangle;
use super::inverse::regular_inverse;
use super::singular::SingularValues;
use super::sparse::square_of_rows;

/// Factor by which gauge rows are multiplied so that they act as constraints: the variance along
/// them falls below rounding.
pub(super) const CONSTRAINT_WEIGHT: f64 = 1e5;
/// Largest singular value of the column-scaled matrix, relative to its first one, whose direction
/// counts as undetermined.
const MAX_UNDETERMINED_SINGULAR_VALUE: f64 = 1e-13;
/// Smallest ratio of the last to the first singular value at which the explicit inverse is used;
/// its relative error is then at most 1e-7.
const MIN_WELL_CONDITIONED_RATIO: f64 = 1e-9;

/// Covariance of the unknowns of a fit and the effective number of parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertainty {
    /// Covariance, shape = (n, n); rows and columns of unknowns that are not estimated are zero.
    pub covariance: DMatrix<f64>,
    /// Effective number of parameters: estimated unknowns, less the unidentifiable combinations,
    /// less the part Σ posterior/prior variance that priors determine.
    pub effective_parameters: f64,
}

impl Uncertainty {
    /// Returns the covariance (`RᵀR` / s² + P²)⁻¹ of the free unknowns, P = diag(1 /
    /// `prior_sigma`), with the unidentifiable combinations fixed.
    ///
    /// `data` is the triangular factor R of the whitened data and `prior_sigma` the 1 σ of each
    /// unknown's prior. The rows of `gauge` span the unidentifiable combinations. `held` is true
    /// for unknowns that are not estimated (at a bound); their rows and columns are zero. s² =
    /// `noise_factor` multiplies the assumed variance of the data.
    pub fn of(
        data: &DMatrix<f64>,
        prior_sigma: &[Option<f64>],
        gauge: &DMatrix<f64>,
        held: &[bool],
        noise_factor: f64,
    ) -> Self {
        let n = data.ncols();
        let free: Vec<usize> = (0..n).filter(|&j| !held[j]).collect();
        let priors: Vec<(usize, f64)> =
            free.iter().enumerate().filter_map(|(j, &k)| Some((j, prior_sigma[k]?))).collect();
        let rows = data.nrows() + priors.len() + gauge.nrows();
        let mut stack = DMatrix::zeros(rows.max(free.len()), free.len());
        for (j, &k) in free.iter().enumerate() {
            stack.view_mut((0, j), (n, 1)).copy_from(&(data.column(k) / noise_factor.sqrt()));
            let gauged = gauge.column(k) * CONSTRAINT_WEIGHT;
            stack.view_mut((n + priors.len(), j), (gauge.nrows(), 1)).copy_from(&gauged);
        }
        for (i, &(j, sigma)) in priors.iter().enumerate() {
            stack[(n + i, j)] = sigma.recip();
        }
        let free_covariance = inverse_of_normal_matrix(stack);
        let mut covariance = DMatrix::zeros(n, n);
        for (a, &j) in free.iter().enumerate() {
            for (b, &k) in free.iter().enumerate() {
                covariance[(j, k)] = free_covariance[(a, b)];
            }
        }
        let from_priors: f64 =
            priors.iter().map(|&(j, sigma)| free_covariance[(j, j)] / (sigma * sigma)).sum();
        let effective_parameters =
            (free.len() as f64 - gauge.nrows() as f64 - from_priors).max(0.0);
        Self { covariance, effective_parameters }
    }

    /// Returns the standard error of each unknown, in its unit.
    pub fn standard_errors(&self) -> Vec<f64> {
        self.covariance.diagonal().iter().map(|variance| variance.max(0.0).sqrt()).collect()
    }
}

/// Returns (`AᵀA`)⁺ from the triangular factor of A with columns scaled to unit norm, or from the
/// singular values if that factor is ill-conditioned.
fn inverse_of_normal_matrix(mut a: DMatrix<f64>) -> DMatrix<f64> {
    let n = a.ncols();
    if n == 0 {
        return DMatrix::zeros(0, 0);
    }
    let scale = DVector::from_iterator(
        n,
        a.column_iter().map(|c| c.norm()).map(|s| if s > 0.0 { s } else { 1.0 }),
    );
    for (mut column, scale) in a.column_iter_mut().zip(scale.iter()) {
        column.unscale_mut(*scale);
    }
    let triangle = Triangle::factor(&a);
    let mut v = regular_inverse(&triangle, MIN_WELL_CONDITIONED_RATIO).unwrap_or_else(|| {
        let SingularValues { values, right: mut v } = SingularValues::of(&a);
        let largest = values[0];
        for (mut column, &value) in v.column_iter_mut().zip(&values) {
            column.scale_mut(if value > MAX_UNDETERMINED_SINGULAR_VALUE * largest {
                value.recip()
            } else {
                0.0
            });
        }
        v
    });
    for (mut row, scale) in v.row_iter_mut().zip(scale.iter()) {
        row.unscale_mut(*scale);
    }
    square_of_rows(&v)
}
