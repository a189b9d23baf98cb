//! Covariance of predicted positions, from the covariance of the estimates.

use nalgebra::{DMatrix, Matrix3, Vector3};

use crate::fit::IdentifyError;
use crate::fit::outcome::Identification;
use crate::fit::stages::placement::Placement;
use crate::least_squares::{Block, LeastSquares as _};
use crate::measurement::Measurements;
use crate::model::PoseResiduals;
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
    /// Predicts the positions of `rows` with their covariance J C Jᵀ.
    ///
    /// J are the derivatives of the position with respect to the estimates that have a variance,
    /// and C is the covariance of these estimates. `problem` is the one that was identified; `rows`
    /// as for [`predict`](Self::predict).
    ///
    /// # Errors
    /// Returns the errors of [`predict`](Self::predict).
    pub fn predict_with_covariance(
        &self,
        problem: &Problem,
        rows: &Measurements,
    ) -> Result<Vec<PredictedPosition>, IdentifyError> {
        let model = self.model(problem, &Placement::of(rows))?;
        let positions = self.predict_with(&model, rows)?;
        let x = self.vector(&model)?;
        // Estimates of other sessions have no part in these rows.
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
        let poses = self.poses(rows, None);
        let residuals = PoseResiduals::new(&model, poses, unknowns, x.clone());
        let (at, per_pose, n) =
            (residuals.reduced(&x), residuals.rows_per_item(), residuals.parameters());
        let of_row = |(row, position): (usize, Vector3<f64>)| {
            let mut block = Block::zeros(per_pose, n);
            residuals.linearise(&at, row..row + 1, &mut block);
            let jacobian = DMatrix::from_fn(3, n, |i, j| block.column(j)[i]);
            let spread = &jacobian * &covariance * jacobian.transpose();
            let covariance = Matrix3::from_fn(|i, j| spread[(i, j)]);
            PredictedPosition { position, covariance }
        };
        Ok(positions.into_iter().enumerate().map(of_row).collect())
    }
}
