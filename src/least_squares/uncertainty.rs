//! Covariance of an estimate.

use nalgebra::{DMatrix, DVector};

use super::Triangle;
use super::inverse::regular_inverse;
use super::singular::SingularValues;

/// Weight that turns gauge rows into constraints: their variance falls below rounding.
const HARD: f64 = 1e5;
/// Scaled singular values below this part of the largest carry no information.
const NO_INFORMATION: f64 = 1e-13;
/// Where no singular value is below this part of the largest, an inverse is exact enough: to 1e-7
/// at worst.
const WELL_CONDITIONED: f64 = 1e-9;

/// Covariance of the unknowns of a fit, and what it rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertainty {
    /// Covariance, shape = (n, n); rows and columns of held unknowns are zero.
    pub covariance: DMatrix<f64>,
    /// How many unknowns the data determine, the priors' share taken off.
    pub effective_parameters: f64,
}

impl Uncertainty {
    /// (`RᵀR` / s² + `PᵀP`)⁻¹ on the free unknowns, with the unidentifiable combinations held.
    ///
    /// `data` is the triangular factor R of the whitened data, `prior_sigma` 1 σ of each unknown's
    /// prior, `gauge` rows that span the unidentifiable combinations, `held` marks unknowns that
    /// are not estimated (at a bound), and s² = `noise_factor` multiplies the assumed variance of
    /// the data.
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
            let gauged = gauge.column(k) * HARD;
            stack.view_mut((n + priors.len(), j), (gauge.nrows(), 1)).copy_from(&gauged);
        }
        for (i, &(j, sigma)) in priors.iter().enumerate() {
            stack[(n + i, j)] = sigma.recip();
        }
        let small = inverse_normal(stack);
        let mut covariance = DMatrix::zeros(n, n);
        for (a, &j) in free.iter().enumerate() {
            for (b, &k) in free.iter().enumerate() {
                covariance[(j, k)] = small[(a, b)];
            }
        }
        let from_priors: f64 =
            priors.iter().map(|&(j, sigma)| small[(j, j)] / (sigma * sigma)).sum();
        let effective_parameters =
            (free.len() as f64 - gauge.nrows() as f64 - from_priors).max(0.0);
        Self { covariance, effective_parameters }
    }

    /// Standard error of each unknown.
    pub fn standard_errors(&self) -> Vec<f64> {
        self.covariance.diagonal().iter().map(|variance| variance.max(0.0).sqrt()).collect()
    }
}

/// (`AᵀA`)⁺ through the triangular factor of A with its columns scaled to unit norm, or through its
/// singular values.
fn inverse_normal(mut a: DMatrix<f64>) -> DMatrix<f64> {
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
    let triangle = Triangle::of(&a);
    let mut v = regular_inverse(&triangle, WELL_CONDITIONED).unwrap_or_else(|| {
        let SingularValues { values, right: mut v } = SingularValues::of(&a);
        let largest = values[0];
        for (mut column, &value) in v.column_iter_mut().zip(&values) {
            column.scale_mut(if value > NO_INFORMATION * largest { value.recip() } else { 0.0 });
        }
        v
    });
    for (mut row, scale) in v.row_iter_mut().zip(scale.iter()) {
        row.unscale_mut(*scale);
    }
    &v * v.transpose()
}
