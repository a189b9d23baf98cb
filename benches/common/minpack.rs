//! The MINPACK port of the crate `levenberg-marquardt` with flexcal's residuals and derivatives.

use flexcal::least_squares::solver::{Bounds, Settings};
use flexcal::least_squares::{LeastSquares, LinearRows, jacobian, residual_vector};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt, MinimizationReport};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};

/// A least-squares problem for that crate, which wants the whole residual vector and the whole
/// Jacobian.
pub struct Minpack<'a, P> {
    problem: &'a P,
    rows: Option<&'a LinearRows>,
    bounds: Option<&'a Bounds>,
    x: DVector<f64>,
}

impl<'a, P: LeastSquares> Minpack<'a, P> {
    /// Problem without linear rows and bounds, to be solved from `x`.
    pub fn new(problem: &'a P, x: DVector<f64>) -> Self {
        Self { problem, rows: None, bounds: None, x }
    }

    /// Appends linear rows, for example priors, to the residuals.
    pub fn with_rows(self, rows: Option<&'a LinearRows>) -> Self {
        Self { rows, ..self }
    }

    /// Moves every point that the solver asks for to the nearest one within `bounds`, of which the
    /// solver is not informed.
    pub fn clamped(self, bounds: Option<&'a Bounds>) -> Self {
        Self { bounds, ..self }
    }

    /// Solves the problem; returns the final point and the crate's report.
    pub fn solve(self, settings: &Settings) -> (DVector<f64>, MinimizationReport<f64>) {
        let solver = LevenbergMarquardt::new()
            .with_ftol(settings.cost_tolerance)
            .with_xtol(settings.step_tolerance)
            .with_gtol(settings.gradient_tolerance);
        let (end, report) = solver.minimize(self);
        (end.x, report)
    }

    /// Returns ½‖r‖² at the minimum found from x = 0.
    pub fn minimise(problem: &'a P) -> f64 {
        let (_, report) =
            Self::new(problem, DVector::zeros(problem.parameters())).solve(&Settings::default());
        assert!(report.termination.was_successful());
        report.objective_function
    }
}

impl<P: LeastSquares> LeastSquaresProblem<f64, Dyn, Dyn> for Minpack<'_, P> {
    type ResidualStorage = Owned<f64, Dyn>;
    type JacobianStorage = Owned<f64, Dyn, Dyn>;
    type ParameterStorage = Owned<f64, Dyn>;

    fn set_params(&mut self, x: &DVector<f64>) {
        self.x.copy_from(x);
        if let Some(bounds) = self.bounds {
            self.x = x.zip_zip_map(bounds.lower(), bounds.upper(), f64::clamp);
        }
    }

    fn params(&self) -> DVector<f64> {
        self.x.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        let data = residual_vector(self.problem, &self.x);
        Some(match self.rows {
            Some(rows) => {
                let m = data.len();
                let mut stacked = data.resize_vertically(m + rows.constant.len(), 0.0);
                stacked
                    .rows_mut(m, rows.constant.len())
                    .copy_from(&(&rows.matrix * &self.x + &rows.constant));
                stacked
            }
            None => data,
        })
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        let data = jacobian(self.problem, &self.x);
        Some(match self.rows {
            Some(rows) => {
                let m = data.nrows();
                let mut stacked = data.resize_vertically(m + rows.matrix.nrows(), 0.0);
                stacked.rows_mut(m, rows.matrix.nrows()).copy_from(&rows.matrix);
                stacked
            }
            None => data,
        })
    }
}
