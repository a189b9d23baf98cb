//! Input of the residual tests.

use nalgebra::{DMatrix, DVector};

use super::covariate::Covariate;
use super::outcome::Untestable;

/// Smallest root mean square residual, in units of the declared σ, that is tested. A smaller one is
/// rounding error.
pub(crate) const MIN_RESIDUAL_SIGMAS: f64 = 1e-3;

/// Values of a covariate, one for each pose.
#[derive(Debug, Clone, PartialEq)]
pub struct CovariateValues {
    /// Quantity that the values measure.
    pub covariate: Covariate,
    /// Value in each pose, in any unit.
    pub values: Vec<f64>,
}

/// Residual of a linear least-squares fit: N poses, p fitted directions.
#[derive(Debug, Clone, Copy)]
pub struct FitResidual<'a> {
    /// Whitened residuals (measured − predicted) / σ, measuring frame, pose after pose, shape = (3
    /// N). A pose has three entries; those beyond its measured coordinates are 0.
    pub residual: &'a DVector<f64>,
    /// Matrix Q, shape = (3 N, p): H = Q Qᵀ maps data to fitted values.
    ///
    /// It consists of the data's rows of the thin orthonormal factor of [J; prior rows]. With
    /// priors, H has eigenvalues between 0 and 1.
    pub fitted: &'a DMatrix<f64>,
    /// Number of measured coordinates of each pose, 1…3; empty if all poses measure three.
    pub coordinates: &'a [usize],
    /// True if σ was declared. A σ estimated from the residuals cannot be tested against their
    /// size.
    pub sigma_is_declared: bool,
    /// Time of each pose, in any unit and from any origin; empty if it was not measured.
    pub time: &'a [f64],
    /// Identifier of each pose's session. Tests of order compare poses of one session only.
    pub session: &'a [usize],
    /// Identifier of each pose's setup. Poses with equal setup are repeats, for which the model
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

    /// Returns an error if the numbers of poses disagree, or if Q or a residual is not finite.
    pub(super) fn check_input(&self) -> Result<(), Untestable> {
        let rows = self.residual.len();
        let poses = rows / 3;
        let shapes = rows == 3 * poses
            && self.fitted.nrows() == rows
            && (self.time.is_empty() || self.time.len() == poses)
            && [self.session.len(), self.setup.len()] == [poses; 2];
        if !shapes {
            return Err(Untestable::SizeMismatch);
        }
        let finite = self.fitted.iter().all(|value| value.is_finite());
        // The statistics contain fourth powers of residuals, which must be finite, too.
        if finite && self.residual.norm_squared().powi(2).is_finite() {
            Ok(())
        } else {
            Err(Untestable::NotFinite)
        }
    }

    /// Returns an error if the residual is so much smaller than the declared σ that it is rounding
    /// error.
    pub(super) fn check_above_rounding(&self) -> Result<(), Untestable> {
        let size = self.residual.norm_squared() / self.residual.len().max(1) as f64;
        let is_rounding = self.sigma_is_declared && size < MIN_RESIDUAL_SIGMAS.powi(2);
        if is_rounding { Err(Untestable::Rounding) } else { Ok(()) }
    }
}
