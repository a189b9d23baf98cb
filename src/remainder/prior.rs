//! Gaussian prior of the parameters, as deviations from a fit.

use nalgebra::{DMatrix, DVector};

use super::rows::Rows;

/// Prior δ ~ N(m, S) of the parameters' deviations δ from their fitted values; S is diagonal.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ParameterPrior {
    /// Mean m: the declared prior's mean minus the fitted value; 0 without a declared prior.
    pub mean: DVector<f64>,
    /// Prior standard deviations of the parameters: the diagonal of S½.
    pub spread: DVector<f64>,
}

impl ParameterPrior {
    /// Returns the residuals r − J m at the mean of the prior, and the scaled Jacobian J S½.
    pub fn reduce(&self, rows: &Rows) -> (DVector<f64>, DMatrix<f64>) {
        (&rows.residual - &rows.jacobian * &self.mean, self.scale(&rows.jacobian))
    }

    /// Returns the Jacobian J with each column scaled by the prior σ of its parameter, J S½.
    pub fn scale(&self, jacobian: &DMatrix<f64>) -> DMatrix<f64> {
        let mut scaled = jacobian.clone();
        for (mut column, spread) in scaled.column_iter_mut().zip(self.spread.iter()) {
            column *= *spread;
        }
        scaled
    }
}
