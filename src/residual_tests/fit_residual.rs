//! Input of the residual tests.

use nalgebra::{DMatrix, DVector};

use super::covariate::Covariate;
use super::outcome::Untestable;

/// Root mean square residual, in units of a declared σ, below which a residual is rounding error and
/// is not tested.
pub(crate) const ROUNDING: f64 = 1e-3;

/// Values of a covariate, one for each pose.
#[derive(Debug, Clone, PartialEq)]
pub struct CovariateValues {
    /// Quantity of which these are the values.
    pub covariate: Covariate,
    /// Value in each pose, any unit.
    pub values: Vec<f64>,
}

/// Residual of a linear least-squares fit: N poses, p fitted directions.
#[derive(Debug, Clone, Copy)]
pub struct FitResidual<'a> {
    /// Whitened residuals (measured − predicted) / σ, measuring frame, pose after pose, shape = (3
    /// N); 0 behind the last of the numbers that a pose measures.
    pub residual: &'a DVector<f64>,
    /// Q, shape = (3 N, p): H = Q Qᵀ takes data to fitted values.
    ///
    /// The data's rows of the thin orthonormal factor of [J; prior rows]: with priors, H has
    /// eigenvalues between 0 and 1.
    pub fitted: &'a DMatrix<f64>,
    /// Number of measured coordinates of each pose, 1…3; empty where all poses measure three.
    pub coordinates: &'a [usize],
    /// True if σ was declared; a σ estimated from the residuals says nothing about their size.
    pub sigma_is_declared: bool,
    /// Time of each pose, any unit and origin.
    pub time: &'a [f64],
    /// Session of each pose, as a number.
    pub session: &'a [usize],
    /// Setup of each pose, as a number: poses with the same one are repeats, for which the model
    /// predicts the same position.
    pub setup: &'a [usize],
    /// Covariates whose influence on the residuals is tested.
    pub covariates: &'a [CovariateValues],
}

impl FitResidual<'_> {
    /// Returns the number of measured coordinates of a pose.
    pub(super) fn coordinates_of(&self, pose: usize) -> usize {
        self.coordinates.get(pose).copied().unwrap_or(3)
    }

    /// Checks that sizes agree and values are finite.
    pub(super) fn testable(&self) -> Result<(), Untestable> {
        let rows = self.residual.len();
        let poses = rows / 3;
        let shapes = rows == 3 * poses
            && self.fitted.nrows() == rows
            && [self.time.len(), self.session.len(), self.setup.len()] == [poses; 3];
        if !shapes {
            return Err(Untestable::SizeMismatch);
        }
        let finite = self.fitted.iter().all(|value| value.is_finite());
        // Statistics are variances of squares.
        if finite && self.residual.norm_squared().powi(2).is_finite() {
            Ok(())
        } else {
            Err(Untestable::NotFinite)
        }
    }

    /// Returns an error if the residual is so far below a declared σ that it is rounding.
    pub(super) fn above_rounding(&self) -> Result<(), Untestable> {
        let size = self.residual.norm_squared() / self.residual.len().max(1) as f64;
        let is_rounding = self.sigma_is_declared && size < ROUNDING.powi(2);
        if is_rounding { Err(Untestable::Rounding) } else { Ok(()) }
    }
}
