//! Measured rows as a least-squares problem.

use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DVector, Vector3};

use super::Model;
use super::jacobian::JacobianWriter;
use super::linear_model::LinearModel;
use super::load_moments::JacobianColumns;
use super::pose::Pose;
use super::predictor::{Prediction, Predictor};
use crate::least_squares::{Block, CHUNK_ITEMS, LeastSquares};
use crate::numeric::parallel;
use crate::observation::Needs;

/// Number of residuals of a row if no row has an orientation.
const RESIDUALS_PER_POSITION: usize = 3;
const RESIDUALS_PER_POSE: usize = 6;

/// Whitened residuals (measured − predicted) / σ of some rows as a function of some of the
/// parameters.
///
/// A row has three residuals; those beyond the numbers that it measures are 0. If any row has an
/// orientation that is fitted, each has six. The last three are log(R Rₚᵀ) / σ of measured R and
/// predicted Rₚ, measuring frame. They are 0 for rows without an orientation.
pub struct PoseResiduals<'a> {
    model: &'a Model,
    poses: Arc<Vec<Pose<'a>>>,
    /// Indices of the unknown parameters.
    unknowns: Vec<usize>,
    /// Full parameter vector. Parameters that are not unknown keep these values.
    fixed: DVector<f64>,
    residuals_per_row: usize,
    measures_tilts: bool,
    /// Linear model whose derivatives are reused if the residuals are linearised at its point.
    linear_model: Option<&'a LinearModel>,
}

impl<'a> PoseResiduals<'a> {
    /// Creates the residuals of `poses`. The parameters listed in `unknowns` vary, the others keep
    /// their values in `fixed`.
    pub fn new(
        model: &'a Model,
        poses: impl Into<Arc<Vec<Pose<'a>>>>,
        unknowns: Vec<usize>,
        fixed: DVector<f64>,
    ) -> Self {
        let poses = poses.into();
        let oriented = poses.iter().any(|pose| pose.orientation.is_some());
        let residuals_per_row = if oriented { RESIDUALS_PER_POSE } else { RESIDUALS_PER_POSITION };
        let measures_tilts =
            poses.iter().any(|pose| pose.observation.description().needs == Needs::Frame);
        Self {
            model,
            poses,
            unknowns,
            fixed,
            residuals_per_row,
            measures_tilts,
            linear_model: None,
        }
    }

    /// Sets the linear model whose derivatives are reused at its point.
    #[must_use]
    pub(crate) fn with_linear_model(self, linear_model: Option<&'a LinearModel>) -> Self {
        Self { linear_model, ..self }
    }

    /// Returns the full parameter vector for unknowns `x`.
    pub fn full_vector(&self, x: &DVector<f64>) -> DVector<f64> {
        let mut full = self.fixed.clone();
        for (&k, &value) in self.unknowns.iter().zip(x.iter()) {
            full[k] = value;
        }
        full
    }

    /// Returns the entries of a full parameter vector that belong to the unknowns.
    pub fn unknowns_in(&self, full: &DVector<f64>) -> DVector<f64> {
        DVector::from_iterator(self.unknowns.len(), self.unknowns.iter().map(|&k| full[k]))
    }

    /// Returns the measured rows.
    pub fn poses(&self) -> &[Pose<'a>] {
        &self.poses
    }

    /// Returns the indices of the unknown parameters.
    pub fn unknowns(&self) -> &[usize] {
        &self.unknowns
    }

    /// Returns measured − predicted of each row \[m\], \[rad\] or \[px\]; NaN without equilibrium.
    pub fn position_errors(&self, x: &DVector<f64>) -> Vec<Vector3<f64>> {
        self.map_errors(x, |pose, predicted| pose.measured - predicted.numbers)
    }

    /// Returns the rotation vectors from the predicted to the measured orientations, measuring
    /// frame \[rad\]; 0 for rows without one, NaN without equilibrium.
    pub fn orientation_errors(&self, x: &DVector<f64>) -> Vec<Vector3<f64>> {
        self.map_errors(x, |_, predicted| predicted.orientation_error.unwrap_or_default())
    }

    fn map_errors(
        &self,
        x: &DVector<f64>,
        error: impl Fn(&Pose, &Prediction) -> Vector3<f64> + Sync,
    ) -> Vec<Vector3<f64>> {
        let full = self.full_vector(x);
        let chunk = |poses: &[Pose]| {
            let mut predictor = Predictor::new(self.model, full.as_slice());
            poses.iter().map(|pose| error(pose, &predictor.predict(pose))).collect::<Vec<_>>()
        };
        if self.poses.len() <= CHUNK_ITEMS {
            return chunk(&self.poses);
        }
        parallel::map_chunks(&self.poses, CHUNK_ITEMS, chunk)
    }
}

impl LeastSquares for PoseResiduals<'_> {
    fn parameters(&self) -> usize {
        self.unknowns.len()
    }

    fn items(&self) -> usize {
        self.poses.len()
    }

    fn rows_per_item(&self) -> usize {
        self.residuals_per_row
    }

    fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]) {
        let mut predictor = Predictor::new(self.model, self.full_vector(x).as_slice());
        for (pose, out) in
            self.poses[items].iter().zip(out.chunks_exact_mut(self.residuals_per_row))
        {
            let predicted = predictor.predict(pose);
            let (position, turn) = out.split_at_mut(RESIDUALS_PER_POSITION);
            position.copy_from_slice(((pose.measured - predicted.numbers) / pose.sigma).as_slice());
            let sigma = pose.orientation.map_or(1.0, |orientation| orientation.sigma);
            let error = predicted.orientation_error.unwrap_or_default() / sigma;
            turn.iter_mut().zip(&error).for_each(|(out, error)| *out = *error);
        }
    }

    fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block) {
        let full = self.full_vector(x);
        let write = |unknowns: &[usize], block: &mut Block| {
            let kinds = (self.residuals_per_row == RESIDUALS_PER_POSE, self.measures_tilts);
            let columns = JacobianColumns::new(self.model, full.as_slice(), unknowns);
            let mut writer = JacobianWriter::new(self.model, full.as_slice(), columns.all(), kinds);
            columns.write(block, |block| {
                for (k, pose) in self.poses[items.clone()].iter().enumerate() {
                    writer.write(pose, block, self.residuals_per_row * k);
                }
            });
        };
        let usable = self.linear_model.filter(|_| self.residuals_per_row == RESIDUALS_PER_POSITION);
        let is_reused = usable.is_some_and(|linear_model| {
            let parameters = &self.model.parameters;
            linear_model.fill(
                (&self.poses, items.clone()),
                (parameters, full.as_slice()),
                &self.unknowns,
                block,
                write,
            )
        });
        if !is_reused {
            write(&self.unknowns, block);
        }
    }
}
