//! Result of a solver.

use nalgebra::DVector;

use super::{AtBound, Bounds, Termination};
use crate::least_squares::Objective;

/// Solution with the reason of termination and the number of evaluations.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Values of the unknowns with the smallest cost that was found, length n.
    pub x: DVector<f64>,
    /// Cost ½‖r(x)‖² at the point `x`.
    pub cost: f64,
    /// Reason for which the solver stopped.
    pub termination: Termination,
    /// Number of steps tried.
    pub iterations: u64,
    /// Number of evaluations of the cost alone.
    pub cost_evaluations: u64,
    /// Number of evaluations of residuals and derivatives.
    pub linearisations: u64,
    /// Bound at which each unknown ends; `None` for an unknown between its bounds.
    pub at_bound: Vec<Option<AtBound>>,
    /// Limit at which each inequality ends; `None` for an inequality between its limits.
    pub at_limit: Vec<Option<AtBound>>,
}

impl Solution {
    /// Creates the solution of a caller's solver at `x`, with the cost there, the bounds that `x`
    /// rests on, and all counts zero.
    pub fn new(
        objective: &dyn Objective,
        x: DVector<f64>,
        termination: Termination,
        bounds: &Bounds,
    ) -> Self {
        let at_bound = (0..x.len()).map(|j| bounds.at(&x, j)).collect();
        Self { cost: objective.cost(&x), termination, at_bound, ..Self::at(x) }
    }

    /// Creates the solution of a run that stops at `start` before its first evaluation.
    pub(super) fn at(start: DVector<f64>) -> Self {
        Self {
            at_bound: vec![None; start.len()],
            x: start,
            cost: f64::INFINITY,
            termination: Termination::Interrupted,
            iterations: 0,
            cost_evaluations: 0,
            linearisations: 0,
            at_limit: Vec::new(),
        }
    }

    /// Returns the number of evaluations of the residual, with derivatives or without.
    #[doc(hidden)]
    pub fn evaluations(&self) -> u64 {
        self.cost_evaluations + self.linearisations
    }
}
