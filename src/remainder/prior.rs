//! Gaussian prior of the parameters, as deviations from a fit.

use nalgebra::{DMatrix, DVector};

use super::rows::Rows;

/// Prior standard deviation of a parameter that is held, as a fraction of its own. It is not zero,
/// because weights are deviations in units of it.
const HELD_SPREAD: f64 = 1e-6;

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

    /// Returns the same prior with some parameters held at given deviations from the fit.
    pub fn holding(&self, held: &[(usize, f64)]) -> Self {
        let mut prior = self.clone();
        for &(column, deviation) in held {
            prior.mean[column] = deviation;
            prior.spread[column] *= HELD_SPREAD;
        }
        prior
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

/// Effects that a search added to the model, in whose place a remainder may explain the residuals.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct SearchedEffects {
    /// Indices of the parameters of the effects, each with the deviation from the fit at which the
    /// effects vanish.
    pub parameters: Vec<(usize, f64)>,
    /// Logarithm of the prior odds that all of the effects act.
    pub ln_odds: f64,
}

/// Prior of the parameters under which a remainder is searched: that of the fit, or one that holds
/// the searched effects at zero.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct AssumedPrior {
    pub prior: ParameterPrior,
    /// Root mean square length of a residual under this prior, without a remainder \[m\].
    pub size: f64,
    /// Logarithm of the prior odds of this assumption.
    pub ln_odds: f64,
    /// True if the searched effects are held at zero.
    pub replaces_effects: bool,
}
