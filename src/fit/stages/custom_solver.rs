//! Interface by which a caller supplies a solver.

use nalgebra::DVector;

use crate::least_squares::Objective;
use crate::least_squares::solver::{Bounds, Solution};

/// Least-squares solver that a caller supplies for the fits of an identification, by
/// [`Options::with_custom_solver`](crate::fit::Options::with_custom_solver).
pub trait CustomSolver: Send + Sync {
    /// Returns true if the solutions of this solver satisfy the bounds. If it returns false,
    /// problems with bounds are refused. Problems with a `[[constraint]]` are always refused.
    fn keeps_bounds(&self) -> bool {
        false
    }

    /// Minimises `objective` from the unknowns `start` in at most `max_steps` steps.
    ///
    /// The unknowns are deviations from nominal: lengths in m, angles in rad, and stiffnesses by
    /// their logarithms. The solution must mark the unknowns that rest on a bound.
    fn minimise(
        &self,
        objective: &dyn Objective,
        start: DVector<f64>,
        bounds: &Bounds,
        max_steps: u64,
    ) -> Solution;
}
