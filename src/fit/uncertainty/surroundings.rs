//! Residuals of a fit around an optimum, to second order.

use nalgebra::{DMatrix, DVector};

use crate::fit::stages::fitting::{FitEnd, Fitting};
use crate::fit::stages::stage::Stage;
use crate::least_squares::{jacobian_and_residual, residual_vector};
use crate::model::PoseResiduals;

/// Number of predictions of a rigid arm that take as long as one of an arm that gives way, with its
/// equilibrium.
const RIGID_PREDICTIONS_PER_ELASTIC: usize = 50;

/// Residuals and their derivatives at an optimum.
pub(super) struct Surroundings<'a> {
    pub stage: &'a Stage<'a>,
    covariance: &'a DMatrix<f64>,
    residuals: PoseResiduals<'a>,
    /// Unknowns at the optimum.
    pub x: DVector<f64>,
    /// Whitened residuals at the optimum.
    pub r: DVector<f64>,
    derivatives: DMatrix<f64>,
    /// Rows of the priors and of earlier data, which are linear in the unknowns.
    linear: DMatrix<f64>,
}

impl<'a> Surroundings<'a> {
    /// Linearises the residuals of a stage at the full parameter vector `at`.
    pub fn new(stage: &'a Stage<'a>, at: &DVector<f64>, covariance: &'a DMatrix<f64>) -> Self {
        let residuals = stage.residuals(at);
        let x = residuals.unknowns_in(at);
        let (derivatives, r) = jacobian_and_residual(&residuals, &x);
        let (priors, earlier) = (stage.priors(), stage.earlier_rows(at).matrix);
        let mut linear = priors.clone().resize_vertically(priors.nrows() + earlier.nrows(), 0.0);
        linear.view_mut((priors.nrows(), 0), earlier.shape()).copy_from(&earlier);
        Self { stage, covariance, residuals, x, r, derivatives, linear }
    }

    /// Returns the change of all rows along a direction: of the data, then of the linear rows.
    pub fn change(&self, v: &DVector<f64>) -> DVector<f64> {
        let (data, linear) = (&self.derivatives * v, &self.linear * v);
        DVector::from_iterator(data.len() + linear.len(), data.iter().chain(&linear).copied())
    }

    /// Returns the second difference of the residuals along the step v.
    pub fn bend(&self, v: &DVector<f64>) -> DVector<f64> {
        let [after, before] =
            [&self.x + v, &self.x - v].map(|x| residual_vector(&self.residuals, &x));
        after + before - &self.r * 2.0
    }

    /// Returns the least-squares adjustment of the unknowns to a change of the residuals.
    pub fn adjusted(&self, bend: &DVector<f64>) -> DVector<f64> {
        self.covariance * self.derivatives.tr_mul(bend)
    }

    /// Returns twice the movement of the optimum of the unknowns that the curvature of the model
    /// causes at the step v.
    pub fn movement(&self, v: &DVector<f64>) -> DVector<f64> {
        -self.adjusted(&self.bend(v))
    }
}

/// Returns the number of predicted rows of a rigid arm that take as long as one prediction of all
/// rows.
pub(super) fn rigid_predictions(fitting: &Fitting, end: &FitEnd) -> usize {
    let gives_way = fitting.model.arm(|k| end.x[k]).is_elastic();
    let weight = if gives_way { RIGID_PREDICTIONS_PER_ELASTIC } else { 1 };
    weight * fitting.whole().poses.len()
}
