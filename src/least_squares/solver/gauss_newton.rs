//! Gauss–Newton method of argmin, adapted to an [`Objective`].

use std::cell::RefCell;

use argmin::core::{
    Error, Executor, IterState, Jacobian, Operator, State as _, TerminationReason,
    TerminationStatus,
};
use argmin::solver::gaussnewton::GaussNewton;
use nalgebra::{DMatrix, DVector};

use super::divergence::DivergenceMonitor;
use super::{Divergence, Solution, Termination};
use crate::least_squares::{Linearisation, Objective};

/// Settings of argmin's Gauss–Newton method.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaussNewtonSettings {
    /// Stopping tolerance of argmin, above 0, in the units of r: | ‖Qᵀr‖ₖ₋₁ − ‖Qᵀr‖ₖ | <
    /// `tolerance`. Default √ε ≈ 1.5e-8.
    pub tolerance: f64,
    /// Maximum number of steps; default 100.
    pub max_iterations: u64,
    /// Divergence test that ends the run; see [`Divergence`].
    pub divergence: Divergence,
}

impl Default for GaussNewtonSettings {
    fn default() -> Self {
        Self {
            tolerance: f64::EPSILON.sqrt(),
            max_iterations: 100,
            divergence: Divergence::default(),
        }
    }
}

/// Minimises ½‖r(x)‖² from `start` by argmin's Gauss–Newton method: full steps −(RᵀR)⁻¹Rᵀ(Qᵀr).
///
/// argmin receives the operator Qᵀr and the Jacobian R, whose steps equal those of r and J = Q R.
/// It inverts JᵀJ, which squares the condition number; a singular matrix ends the run with
/// [`Termination::Singular`]. If the run does not converge, the solution is the best point
/// evaluated, which may be `start`.
pub fn minimise_gauss_newton<O: Objective>(
    objective: O,
    start: DVector<f64>,
    settings: &GaussNewtonSettings,
) -> Solution {
    let record = RefCell::new(RunRecord {
        last: None,
        best: (start.clone(), f64::INFINITY),
        monitor: DivergenceMonitor::new(settings.divergence),
        linearisations: 0,
        termination: None,
    });
    let adapter = ArgminAdapter { objective, record };
    let mut solution = Solution::at(start);
    if adapter.objective.parameters() != solution.x.len() {
        solution.termination = Termination::SizeMismatch;
        return solution;
    }
    let method = GaussNewton::new();
    let method = method.clone().with_tolerance(settings.tolerance).unwrap_or(method);
    let result = Executor::new(&adapter, method)
        .configure(|state: GaussNewtonState| {
            state.param(solution.x.clone()).max_iters(settings.max_iterations)
        })
        .ctrlc(false)
        .timer(false)
        .run();
    // argmin counts the steps it has finished. A run that fails has evaluated the start and one
    // point per step.
    let (finished, iterations) = match result {
        Ok(result) => {
            let finished = match result.state.get_termination_status() {
                TerminationStatus::Terminated(TerminationReason::SolverConverged) => {
                    Termination::Unchanged
                }
                TerminationStatus::Terminated(TerminationReason::MaxItersReached) => {
                    Termination::IterationLimit
                }
                _ => Termination::Interrupted,
            };
            (finished, Some(result.state.get_iter()))
        }
        Err(_) => (Termination::Singular, None),
    };
    let RunRecord { last, best, linearisations, termination, .. } = adapter.record.into_inner();
    solution.termination = termination.unwrap_or(finished);
    solution.iterations = iterations.unwrap_or_else(|| linearisations.saturating_sub(1));
    solution.linearisations = linearisations;
    (solution.x, solution.cost) = match last {
        Some((x, linearisation)) if solution.termination.converged() => (x, linearisation.cost),
        _ => best,
    };
    solution
}

type GaussNewtonState = IterState<DVector<f64>, (), DMatrix<f64>, (), DVector<f64>, f64>;

/// Objective with a record of the run, in the form that argmin's method expects.
struct ArgminAdapter<O> {
    objective: O,
    record: RefCell<RunRecord>,
}

/// Points and counts of a run, recorded because argmin returns nothing when a run fails.
struct RunRecord {
    last: Option<(DVector<f64>, Linearisation)>,
    best: (DVector<f64>, f64),
    monitor: DivergenceMonitor,
    linearisations: u64,
    termination: Option<Termination>,
}

/// Error that ends a run from within the adapter.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Stopped(Termination);

impl<O: Objective> ArgminAdapter<O> {
    /// Calls `extract` with the linearisation at x, which is computed unless x is the last point.
    /// Returns an error if the run ends there.
    fn with_linearisation<T>(
        &self,
        x: &DVector<f64>,
        extract: impl Fn(&Linearisation) -> T,
    ) -> Result<T, Error> {
        let record = &mut *self.record.borrow_mut();
        if let Some((_, linearisation)) = record.last.as_ref().filter(|(point, _)| point == x) {
            return Ok(extract(linearisation));
        }
        let linearisation = self.objective.linearise(x);
        let first = record.linearisations == 0;
        record.linearisations += 1;
        let cost = linearisation.cost;
        record.termination = if record.monitor.diverges(cost) {
            Some(if first { Termination::OutsideDomainAtStart } else { Termination::Diverged })
        } else if linearisation
            .triangle
            .iter()
            .chain(&linearisation.projected)
            .all(|value| value.is_finite())
        {
            None
        } else {
            Some(Termination::DerivativesNotFinite)
        };
        if cost < record.best.1 {
            record.best = (x.clone(), cost);
        }
        if let Some(termination) = record.termination {
            return Err(Stopped(termination).into());
        }
        let out = extract(&linearisation);
        record.last = Some((x.clone(), linearisation));
        Ok(out)
    }
}

impl<O: Objective> Operator for &ArgminAdapter<O> {
    type Param = DVector<f64>;
    type Output = DVector<f64>;

    fn apply(&self, x: &DVector<f64>) -> Result<DVector<f64>, Error> {
        self.with_linearisation(x, |linearisation| linearisation.projected.clone())
    }
}

impl<O: Objective> Jacobian for &ArgminAdapter<O> {
    type Param = DVector<f64>;
    type Jacobian = DMatrix<f64>;

    fn jacobian(&self, x: &DVector<f64>) -> Result<DMatrix<f64>, Error> {
        self.with_linearisation(x, |linearisation| linearisation.triangle.clone())
    }
}
