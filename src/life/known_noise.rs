//! Noise of new rows, and the misfit that an earlier fit found beyond it.

use nalgebra::DVector;

use super::earlier::EQUAL_SIGMA;
use crate::fit::SavedEstimate;
use crate::least_squares::residual_vector;
use crate::model::{Model, Pose, PoseResiduals};
use crate::problem::Problem;
use crate::remainder::side_changes;

/// Number of standard errors by which the variance of prediction errors must exceed the declared
/// noise variance to count as misfit.
const MIN_EXCESS_ERRORS: f64 = 2.0;

/// Noise of new rows, and the misfit that the earlier fit found beyond it.
pub(super) struct KnownNoise {
    /// Standard deviation (1 σ) of the noise of a position's coordinate in rows that state none
    /// \[m\]; `None` if neither problem nor estimate states it.
    pub sigma: Option<f64>,
    /// Standard deviation (1 σ) of the misfit of a position's coordinate \[m\].
    misfit: f64,
    /// Standard deviation (1 σ) of the misfit of other coordinates, in units of their noise.
    other_misfit: f64,
}

impl KnownNoise {
    /// Returns the declared noise, or else that of the earlier fit, and the misfit beyond it. The
    /// misfit is the excess of the larger of two: the σ that the earlier fit took, and the noise of
    /// its predictions if that is significantly larger than the declared one.
    pub fn of(problem: &Problem, estimate: &SavedEstimate) -> Self {
        let saved = &estimate.posterior;
        let declared = problem.data.position_sigma.or(estimate.estimated_sigma);
        // For rows that state their σ, the noise is the σ that the fit took without its misfit.
        let of_rows = |taken: f64| taken / saved.noise_factor.max(1.0).sqrt();
        let sigma = declared.or(saved.sigma_taken.map(of_rows));
        let of_predictions = |sigma: f64| {
            let text = estimate.prediction.as_ref()?;
            let prediction: serde_json::Value = serde_json::from_str(text).ok()?;
            let number = |key: &str| prediction.get(key)?.as_f64();
            let noise = number("noise_m")?.hypot(number("configuration_noise_m")?);
            // Relative standard error of the variance, estimated from about half the coordinates.
            let configurations = prediction.get("scores")?.get("configurations")?.as_f64()?;
            let scatter = (2.0 / (1.5 * configurations).max(1.0)).sqrt();
            Some(noise).filter(|noise| (noise / sigma).powi(2) > 1.0 + MIN_EXCESS_ERRORS * scatter)
        };
        let misfit = sigma.map_or(0.0, |sigma| {
            let taken = saved.sigma_taken.filter(|taken| *taken > sigma * (1.0 + EQUAL_SIGMA));
            let largest = taken.unwrap_or(0.0).max(of_predictions(sigma).unwrap_or(0.0));
            (largest * largest - sigma * sigma).max(0.0).sqrt()
        });
        let excess = saved.noise_factor - 1.0;
        let other_misfit = if excess > EQUAL_SIGMA { excess.sqrt() } else { 0.0 };
        Self { sigma, misfit, other_misfit }
    }

    /// Returns the misfit of [`misfit_of`](Self::misfit_of) with what unknown directions of
    /// approach change at the full parameter vector `x` of a model.
    pub fn misfit_with_sides(
        &self,
        (problem, model, x): (&Problem, &Model, &DVector<f64>),
        poses: &[Pose],
    ) -> Option<Vec<Vec<f64>>> {
        let whitened = |poses: &[Pose], x: &[f64]| {
            let x = DVector::from_column_slice(x);
            let residuals = PoseResiduals::new(model, poses.to_vec(), Vec::new(), x);
            residual_vector(&residuals, &DVector::zeros(0)).as_slice().to_vec()
        };
        let mut misfit = self.misfit_of(poses);
        for change in side_changes((problem, model), x.as_slice(), poses, whitened) {
            let none = || poses.iter().map(|pose| vec![0.0; pose.coordinates()]).collect();
            let stride = (change.changes.len() / poses.len().max(1)).max(1);
            let of_rows = misfit.get_or_insert_with(none).iter_mut();
            for (sigmas, changes) in of_rows.zip(change.changes.chunks_exact(stride)) {
                let of_row = sigmas.iter_mut().zip(changes);
                of_row.for_each(|(sigma, change)| *sigma = sigma.hypot(*change));
            }
        }
        misfit
    }

    /// Returns 1 σ of the misfit of each coordinate of each pose in units of its noise; `None`
    /// without a misfit.
    fn misfit_of(&self, poses: &[Pose]) -> Option<Vec<Vec<f64>>> {
        if self.misfit == 0.0 && self.other_misfit == 0.0 {
            return None;
        }
        let of_pose = |pose: &Pose| {
            let is_position = pose.observation.is_position();
            let first = if is_position { self.misfit / pose.sigma } else { self.other_misfit };
            let mut misfit = vec![first; pose.observation.coordinates()];
            misfit.resize(pose.coordinates(), self.other_misfit);
            misfit
        };
        Some(poses.iter().map(of_pose).collect())
    }
}
