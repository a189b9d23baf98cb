//! Earlier data as linear residual rows that are fitted together with new data.

use nalgebra::{DMatrix, DVector};

use crate::least_squares::LinearRows;
use crate::model::Model;

/// Largest eigenvalue of the correlation matrix of the earlier estimate, relative to the largest
/// one, that is only rounding: the earlier fit held this combination constant.
const MAX_HELD_EIGENVALUE: f64 = 1e-13;
/// Largest eigenvalue of the correlation matrix of the earlier estimate, relative to the largest
/// one, at which the data determine the combination so well that its declared prior is negligible.
const MAX_WELL_KNOWN_EIGENVALUE: f64 = 1e-6;
/// Smallest eigenvalue of the information beyond the declared priors, relative to the largest one,
/// for which a row is made.
const MIN_INFORMATIVE_EIGENVALUE: f64 = 1e-10;

/// Linear residual rows A x + b that contain the information of earlier data about the deviations x
/// of some parameters from nominal. The parameters are given by their names.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct EarlierData {
    names: Vec<String>,
    /// Matrix A of the rows A x + b that stand for the earlier data, shape = (rows, names).
    matrix: DMatrix<f64>,
    /// Constant b of the rows A x + b that stand for the earlier data, length = rows.
    constant: DVector<f64>,
}

impl EarlierData {
    /// Creates the rows whose information AᵀA, together with the declared priors about 0, is that
    /// of a Gaussian of the deviations with this `mean` and `covariance`.
    ///
    /// `precision` holds the declared prior precision 1/σ² of each parameter, 0 without a prior.
    /// Directions in which the Gaussian is wider than the declared prior get no rows. Returns
    /// `None` if a variance is not positive and finite.
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
        // The covariance is scaled by the standard errors, so that no unit dominates.
        let correlation = DMatrix::from_fn(scale.len(), scale.len(), |i, j| {
            covariance[(i, j)] / (scale[i] * scale[j])
        });
        let eigen = correlation.symmetric_eigen();
        let largest = eigen.eigenvalues.amax();
        let chosen = |is_chosen: &dyn Fn(f64) -> bool| -> Vec<usize> {
            (0..scale.len()).filter(|&k| is_chosen(eigen.eigenvalues[k] / largest)).collect()
        };
        let mean = mean.component_div(&scale);
        let mut rows: Vec<(DVector<f64>, f64)> = Vec::with_capacity(scale.len());
        for k in chosen(&|value| value > MAX_HELD_EIGENVALUE && value <= MAX_WELL_KNOWN_EIGENVALUE)
        {
            let row = eigen.eigenvectors.column(k) / eigen.eigenvalues[k].sqrt();
            let constant = -row.dot(&mean);
            rows.push((row, constant));
        }
        let others = chosen(&|value| value > MAX_WELL_KNOWN_EIGENVALUE);
        let directions = eigen.eigenvectors.select_columns(&others);
        let information =
            DVector::from_fn(others.len(), |k, _| eigen.eigenvalues[others[k]].recip());
        let along = directions.tr_mul(&mean);
        let declared = precision.zip_map(&scale, |precision, scale| precision * scale * scale);
        // Through the declared priors, the part of the mean along the well-known combinations also
        // contributes.
        let beyond = (&mean - &directions * &along).component_mul(&declared);
        let pull = information.component_mul(&along) + directions.tr_mul(&beyond);
        let declared = directions.tr_mul(&DMatrix::from_diagonal(&declared)) * &directions;
        let added = (DMatrix::from_diagonal(&information) - declared).symmetric_eigen();
        let largest = added.eigenvalues.iter().copied().fold(0.0, f64::max);
        for (k, &value) in added.eigenvalues.iter().enumerate() {
            if value > MIN_INFORMATIVE_EIGENVALUE * largest {
                let direction = added.eigenvectors.column(k);
                let root = value.sqrt();
                rows.push((&directions * direction * root, -direction.dot(&pull) / root));
            }
        }
        let matrix = DMatrix::from_fn(rows.len(), scale.len(), |row, j| rows[row].0[j] / scale[j]);
        let constant =
            DVector::from_iterator(rows.len(), rows.iter().map(|(_, constant)| *constant));
        Some(Self { names, matrix, constant })
    }

    /// Returns true if the earlier data contain information about the parameter `name`.
    pub fn covers(&self, name: &str) -> bool {
        self.names.iter().any(|covered| covered == name)
    }

    /// Returns the rows as linear functions of the `unknowns`, which are indices into the
    /// parameters of `model`. All other parameters are as in the full parameter vector `at`.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Rows of a Gaussian restore its information and its mean, whatever the precision of its
    /// combinations; the information of the declared priors is left out.
    #[test]
    fn rows_restore_a_gaussian_with_combinations_of_every_precision() {
        let turn = DMatrix::from_row_slice(3, 3, &[0.6, 0.8, 0.0, -0.8, 0.6, 0.0, 0.0, 0.0, 1.0]);
        let mean = DVector::from_vec(vec![0.3, -0.2, 0.1]);
        let precision = DVector::from_vec(vec![0.25, 0.0, 0.5]);
        for narrow in [1.0, 1e-4, 1e-8, 1e-11] {
            let variances = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, narrow, 0.7]));
            let covariance = &turn * variances * turn.transpose();
            let names = vec!["a".to_owned(), "b".to_owned(), "c".to_owned()];
            let data = EarlierData::new(names, &mean, &covariance, &precision).unwrap();
            let total = data.matrix.tr_mul(&data.matrix) + DMatrix::from_diagonal(&precision);
            let inverse = total.cholesky().unwrap().inverse();
            let off = (&inverse - &covariance).amax();
            assert!(off < 1e-5, "{narrow}: {off}");
            let found = -&inverse * data.matrix.tr_mul(&data.constant);
            assert!((found - &mean).amax() < 1e-5, "{narrow}");
            // The narrow combination keeps its variance.
            let direction = turn.column(1);
            let variance = (&inverse * direction).dot(&direction);
            assert!((variance / narrow - 1.0).abs() < 0.01, "{narrow}: {variance}");
        }
    }
}
