//! Earlier data as linear rows that join a fit of new data.

use nalgebra::{DMatrix, DVector};

use crate::least_squares::LinearRows;
use crate::model::Model;

/// Smallest eigenvalue of the scaled information, relative to the largest, that counts.
const NO_INFORMATION: f64 = 1e-10;

/// Linear residual rows A x + b that stand for earlier data on some parameters, given by their
/// names. x are deviations from nominal.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct EarlierData {
    names: Vec<String>,
    /// Matrix A, shape = (rows, names).
    matrix: DMatrix<f64>,
    /// Constant b, length = rows.
    constant: DVector<f64>,
}

impl EarlierData {
    /// Creates the rows whose information AᵀA, together with declared priors about 0, is that of a
    /// Gaussian with this `mean` and `covariance`.
    ///
    /// `precision` holds the declared prior precision 1/σ² of each parameter, 0 without a prior.
    /// Directions in which the Gaussian is wider than the declared prior get no rows. Returns `None`
    /// if the covariance is not positive.
    pub fn new(
        names: Vec<String>,
        mean: &DVector<f64>,
        covariance: &DMatrix<f64>,
        precision: &DVector<f64>,
    ) -> Option<Self> {
        let scale = covariance.diagonal().map(f64::sqrt);
        if !scale.iter().all(|scale| *scale > 0.0 && scale.is_finite()) {
            return None;
        }
        // In units of the standard errors, so that no unit dominates.
        let correlation = DMatrix::from_fn(scale.len(), scale.len(), |i, j| {
            covariance[(i, j)] / (scale[i] * scale[j])
        });
        let eigen = correlation.symmetric_eigen();
        let largest = eigen.eigenvalues.amax();
        let inverse = eigen
            .eigenvalues
            .map(|value| if value > NO_INFORMATION * largest { value.recip() } else { 0.0 });
        let total =
            &eigen.eigenvectors * DMatrix::from_diagonal(&inverse) * eigen.eigenvectors.transpose();
        let declared = precision.zip_map(&scale, |precision, scale| precision * scale * scale);
        let pull = &total * mean.component_div(&scale);
        let added = (total - DMatrix::from_diagonal(&declared)).symmetric_eigen();
        let largest = added.eigenvalues.amax();
        let kept: Vec<usize> =
            (0..scale.len()).filter(|&k| added.eigenvalues[k] > NO_INFORMATION * largest).collect();
        let (mut matrix, mut constant) =
            (DMatrix::zeros(kept.len(), scale.len()), DVector::zeros(kept.len()));
        for (row, &k) in kept.iter().enumerate() {
            let root = added.eigenvalues[k].sqrt();
            let direction = added.eigenvectors.column(k);
            constant[row] = -direction.dot(&pull) / root;
            for j in 0..scale.len() {
                matrix[(row, j)] = root * direction[j] / scale[j];
            }
        }
        Some(Self { names, matrix, constant })
    }

    /// Returns true if the earlier data inform on the parameter `name`.
    pub fn covers(&self, name: &str) -> bool {
        self.names.iter().any(|covered| covered == name)
    }

    /// Returns the rows as functions of the `unknowns` of a model; other parameters have their
    /// values in `at`.
    pub(in crate::fit) fn on(
        &self,
        model: &Model,
        unknowns: &[usize],
        at: &DVector<f64>,
    ) -> LinearRows {
        let mut rows = LinearRows {
            matrix: DMatrix::zeros(self.matrix.nrows(), unknowns.len()),
            constant: self.constant.clone(),
        };
        for (column, name) in self.matrix.column_iter().zip(&self.names) {
            let found = model.parameters.iter().position(|parameter| parameter.name == *name);
            let Some(k) = found else { continue };
            match unknowns.iter().position(|&unknown| unknown == k) {
                Some(j) => rows.matrix.set_column(j, &column),
                None => rows.constant += column * at[k],
            }
        }
        rows
    }
}
