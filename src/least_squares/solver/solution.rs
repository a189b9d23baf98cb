//! Where a solver stopped.

use nalgebra::DVector;

use super::{AtBound, Termination};

/// Where a solver stopped, and what it took.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// x, the best point found.
    pub x: DVector<f64>,
    /// ½‖r(x)‖².
    pub cost: f64,
    /// Why it stopped.
    pub termination: Termination,
    /// Steps tried.
    pub iterations: u64,
    /// Evaluations of the cost alone.
    pub cost_evaluations: u64,
    /// Evaluations of residual and derivatives.
    pub linearisations: u64,
    /// The bound each unknown rests on, one entry per unknown.
    pub at_bound: Vec<Option<AtBound>>,
    /// The limit each inequality rests on, one entry per inequality.
    pub at_limit: Vec<Option<AtBound>>,
}

impl Solution {
    /// Of a run from `start` that has not begun.
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

    /// Evaluations of the residual, with derivatives or without.
    pub fn evaluations(&self) -> u64 {
        self.cost_evaluations + self.linearisations
    }
}
