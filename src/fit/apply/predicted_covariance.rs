//! Covariance of predicted positions, and standard errors of the predicted numbers of rows, both
//! from the covariance of the estimates.

use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use crate::fit::IdentifyError;
use crate::fit::apply::predict_saved::PredictError;
use crate::fit::apply::saved_estimate::SavedEstimate;
use crate::fit::outcome::Identification;
use crate::fit::stages::placement::Placement;
use crate::least_squares::{Block, LeastSquares as _};
use crate::measurement::Measurements;
use crate::model::{Model, Pose, PoseResiduals};
use crate::numeric::parallel;
use crate::problem::Problem;

/// Predicted position of a row with its uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PredictedPosition {
    /// Predicted position, measuring frame \[m\]; NaN where the arm has no equilibrium.
    pub position: Vector3<f64>,
    /// Covariance J C Jᵀ due to the estimates, measuring frame \[m²\]. It contains neither
    /// measurement noise nor errors of the model.
    pub covariance: Matrix3<f64>,
}

impl Identification {
    /// Predicts the positions of the identified arm in the poses of `rows`, with their covariance
    /// J C Jᵀ.
    ///
    /// J are the derivatives of the position with respect to the estimates that have a variance,
    /// and C is the covariance of these estimates. `problem` and `rows` are as for
    /// [`predict`](Self::predict).
    ///
    /// # Errors
    /// Returns the errors of [`predict`](Self::predict).
    pub fn predict_with_covariance(
        &self,
        problem: &Problem,
        rows: &Measurements,
    ) -> Result<Vec<PredictedPosition>, IdentifyError> {
        let rows = &*rows.with_sides(self.has_approach);
        let model = self.model(problem, &Placement::of(rows))?;
        let positions = self.predict_with(&model, rows)?;
        let x = self.vector(&model)?;
        // Estimates of sessions and targets that these rows do not use are left out.
        let place = |k: usize| {
            let name = &self.estimates[k].name;
            model.parameters.iter().position(|parameter| parameter.name == *name)
        };
        let (kept, unknowns): (Vec<usize>, Vec<usize>) = (self.covariance.parameters.iter())
            .enumerate()
            .filter_map(|(entry, &k)| Some((entry, place(k)?)))
            .unzip();
        let scale: Vec<f64> =
            unknowns.iter().map(|&k| model.parameters[k].value_error(x[k], 1.0)).collect();
        let of_values = self.covariance.matrix.select_rows(&kept).select_columns(&kept);
        let covariance = DMatrix::from_fn(kept.len(), kept.len(), |i, j| {
            of_values[(i, j)] / (scale[i] * scale[j])
        });
        // The derivatives are those of metres, also for rows that state their σ.
        let poses: Vec<Pose> =
            self.poses(rows, None).into_iter().map(|pose| Pose { sigma: 1.0, ..pose }).collect();
        let residuals = PoseResiduals::new(&model, poses, unknowns, x.clone());
        let at = residuals.unknowns_in(&x);
        let of_row = |(row, position): (usize, Vector3<f64>)| {
            let jacobian = row_jacobian(&residuals, &at, row);
            let spread = &jacobian * &covariance * jacobian.transpose();
            let covariance = Matrix3::from_fn(|i, j| spread[(i, j)]);
            PredictedPosition { position, covariance }
        };
        Ok(positions.into_iter().enumerate().map(of_row).collect())
    }
}

/// Returns the derivatives of the residuals of a row with respect to the unknowns, shape = (3,
/// unknowns): those of its predicted numbers, divided by −σ of its pose.
fn row_jacobian(residuals: &PoseResiduals, at: &DVector<f64>, row: usize) -> DMatrix<f64> {
    let mut block = Block::zeros(residuals.rows_per_item(), residuals.parameters());
    residuals.linearise(at, row..row + 1, &mut block);
    DMatrix::from_fn(3, residuals.parameters(), |i, j| block.column(j)[i])
}

/// Returns the standard error (1 σ) of each predicted number of `rows`, in the unit of the row's
/// kind, from the covariance of the estimates. It contains neither measurement noise nor errors of
/// the model. `x` is the full parameter vector of the prediction.
///
/// NaN where a row depends on a parameter without a variance, for example one that the data do not
/// determine.
///
/// # Errors
/// Returns an error if problem and rows are not compatible.
pub fn standard_errors(
    problem: &Problem,
    estimate: &SavedEstimate,
    rows: &Measurements,
    x: &DVector<f64>,
) -> Result<Vec<Vector3<f64>>, PredictError> {
    let rows = &*rows.with_sides(estimate.has_approach);
    let placement = Placement::of(rows);
    let model = estimate.model(Model::new(problem, &placement.bases, &placement.targets)?);
    let all: Vec<usize> = (0..rows.len()).collect();
    let mut poses = placement.poses(rows, &all, 1.0);
    estimate.count_time_in(&placement, &mut poses);
    let poses: Vec<Pose> = poses.into_iter().map(|pose| Pose { sigma: 1.0, ..pose }).collect();
    let of_values = &estimate.posterior.covariance;
    let entry =
        |k: usize| estimate.entries().position(|(name, ..)| name == model.parameters[k].name);
    let entries: Vec<Option<usize>> = (0..model.parameters.len())
        .map(|k| entry(k).filter(|&entry| of_values[(entry, entry)].is_finite()))
        .collect();
    let scale = |k: usize| model.parameters[k].value_error(x[k], 1.0);
    let covariance = DMatrix::from_fn(entries.len(), entries.len(), |i, j| {
        let both = entries[i].zip(entries[j]);
        let value = both.map_or(0.0, |both| of_values[both]) / (scale(i) * scale(j));
        if value.is_finite() { value } else { 0.0 }
    });
    let residuals = PoseResiduals::new(&model, poses, (0..entries.len()).collect(), x.clone());
    let of_row = |row: usize| {
        let jacobian = row_jacobian(&residuals, x, row);
        let is_open = |k: usize| entries[k].is_none() && jacobian.column(k).amax() > 0.0;
        if (0..entries.len()).any(is_open) {
            return Vector3::from_element(f64::NAN);
        }
        let spread = &jacobian * &covariance * jacobian.transpose();
        Vector3::from_fn(|i, _| spread[(i, i)].sqrt())
    };
    Ok(parallel::map(rows.len(), of_row))
}
