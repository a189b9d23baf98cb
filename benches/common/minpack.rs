//! The MINPACK port of the crate `levenberg-marquardt` on the same residuals and derivatives.

use flexcal::fit::{LeastSquares, jacobian, residual_vector};
use levenberg_marquardt::{LeastSquaresProblem, LevenbergMarquardt};
use nalgebra::storage::Owned;
use nalgebra::{DMatrix, DVector, Dyn};

/// A problem as that crate sees it: residuals and Jacobian whole.
pub struct Minpack<'a, P> {
    problem: &'a P,
    x: DVector<f64>,
}

impl<'a, P: LeastSquares> Minpack<'a, P> {
    /// ½‖r‖² at the minimum found from x = 0.
    pub fn minimise(problem: &'a P) -> f64 {
        let start = Self { problem, x: DVector::zeros(problem.parameters()) };
        let solver = LevenbergMarquardt::new().with_ftol(1e-12).with_xtol(1e-10).with_gtol(1e-10);
        let (_, report) = solver.minimize(start);
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
    }

    fn params(&self) -> DVector<f64> {
        self.x.clone()
    }

    fn residuals(&self) -> Option<DVector<f64>> {
        Some(residual_vector(self.problem, &self.x))
    }

    fn jacobian(&self) -> Option<DMatrix<f64>> {
        Some(jacobian(self.problem, &self.x))
    }
}
