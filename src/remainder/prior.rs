//! Gaussian prior of the parameters, as deviations from a fit.

use nalgebra::{DMatrix, DVector};

use super::rows::Rows;
use crate::numeric::{gram, lower_factor};

/// Prior δ ~ N(m, S) of the parameters' deviations δ from their fitted values; S is diagonal.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ParameterPrior {
    /// Mean m: the declared prior's mean minus the fitted value; 0 without a declared prior.
    pub mean: DVector<f64>,
    /// Prior standard deviations of the parameters: the diagonal of S½.
    pub spread: DVector<f64>,
    /// Rows that inform about the parameters alone; `None` if there are none.
    pub information: Option<InformationRows>,
}

/// Linearised rows that inform about the parameters alone, divided by their σ: known distances,
/// which no error of a joint moves, and other rows that measure no position, beside which no
/// remainder is fitted.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct InformationRows {
    /// Jacobian J of the rows that inform about the parameters alone, times the root S½ of the
    /// prior covariance.
    scaled: DMatrix<f64>,
    /// Residuals at the mean of the prior, r − J m.
    target: DVector<f64>,
}

impl ParameterPrior {
    /// Adds rows that inform about the parameters alone. `jacobian` and `residual` are divided by
    /// their σ.
    pub fn with_information(mut self, jacobian: &DMatrix<f64>, residual: &DVector<f64>) -> Self {
        if jacobian.nrows() > 0 {
            let target = residual - jacobian * &self.mean;
            self.information = Some(InformationRows { scaled: self.scale(jacobian), target });
        }
        self
    }

    /// Returns the residuals r − J m of `rows` at the mean of the prior.
    pub fn residuals(&self, rows: &Rows) -> DVector<f64> {
        &rows.residual - &rows.jacobian * &self.mean
    }

    /// Returns the residuals of `rows` at the mean of the parameters given the information rows, and
    /// their Jacobian times a factor of the covariance of the parameters given these rows. Without
    /// information rows these are r − J m and J S½.
    ///
    /// With the scaled information rows G and g, z = S^(−½) (δ − m) has the precision I + GᵀG
    /// = L Lᵀ and the mean (L Lᵀ)⁻¹ Gᵀg. Returns `None` if L does not exist because of rounding.
    pub fn reduce(&self, rows: &Rows) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let (mut target, mut scaled) = (self.residuals(rows), self.scale(&rows.jacobian));
        if let Some(InformationRows { scaled: known, target: measured }) = &self.information {
            let n = known.ncols();
            let factor = lower_factor(DMatrix::identity(n, n) + gram(known))?;
            // With X = L⁻¹ (J S½)ᵀ, the Jacobian times the factor is Xᵀ.
            let transposed = factor.solve_lower_triangular(&scaled.transpose())?;
            let mean = factor.solve_lower_triangular(&known.tr_mul(measured))?;
            target -= transposed.tr_mul(&mean);
            scaled = transposed.transpose();
        }
        Some((target, scaled))
    }

    /// Adds what the information rows tell about the last of the standardised `features`:
    /// GᵀG to their precision, and Gᵀg to its product with their mean.
    pub fn add_information(&self, precision: &mut DMatrix<f64>, product: &mut DVector<f64>) {
        let Some(InformationRows { scaled, target }) = &self.information else { return };
        let (count, first) = (scaled.ncols(), product.len() - scaled.ncols());
        let mut block = precision.view_mut((first, first), (count, count));
        block += gram(scaled);
        let mut part = product.rows_mut(first, count);
        part += scaled.tr_mul(target);
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
