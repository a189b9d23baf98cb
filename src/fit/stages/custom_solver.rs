//! Interface for solvers of the caller.

use nalgebra::DVector;

use crate::least_squares::Objective;
use crate::least_squares::solver::{Bounds, Solution};

/// Solver that a caller gives to the fits of an identification, see
/// [`Options::with_custom_solver`](crate::fit::Options::with_custom_solver).
pub trait CustomSolver: Send + Sync {
    /// Returns true if solutions satisfy the bounds. If it returns false, problems with bounds are
    /// refused. Problems with a `[[constraint]]` are always refused.
    fn keeps_bounds(&self) -> bool {
        false
    }

    /// Minimises `objective` from the unknowns `start` in at most `max_steps` steps.
    ///
    /// Lengths are in m, angles in rad, and stiffnesses enter by their logarithms. The solution
    /// marks unknowns that rest on a bound.
    fn minimise(
        &self,
        objective: &dyn Objective,
        start: DVector<f64>,
        bounds: &Bounds,
        max_steps: u64,
    ) -> Solution;
}
