//! Gaussian prior of the parameters about a fit.

use nalgebra::{DMatrix, DVector};

use super::rows::Rows;

/// Prior δ ~ N(m, S) of the parameters' deviations from a fit; S is diagonal.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ParameterPrior {
    /// m: the declared prior's mean − the fit.
    pub mean: DVector<f64>,
    /// S½.
    pub spread: DVector<f64>,
}

impl ParameterPrior {
    /// Residuals of the prior's mean, r − J m, and the scaled Jacobian J S½.
    pub fn reduce(&self, rows: &Rows) -> (DVector<f64>, DMatrix<f64>) {
        (&rows.residual - &rows.jacobian * &self.mean, self.scale(&rows.jacobian))
    }

    /// J S½.
    pub fn scale(&self, jacobian: &DMatrix<f64>) -> DMatrix<f64> {
        let mut scaled = jacobian.clone();
        for (mut column, spread) in scaled.column_iter_mut().zip(self.spread.iter()) {
            column *= *spread;
        }
        scaled
    }
}
