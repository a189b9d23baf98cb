//! Execution of a solver by argmin's executor.

use argmin::core::observers::{Observe, ObserverMode};
use argmin::core::{Executor, IterState, Solver, State as _, TerminationReason, TerminationStatus};
use nalgebra::DVector;

use super::{Solution, Termination};
use crate::least_squares::Objective;

/// State of argmin's executor; only x and the cost ½‖r‖² are used.
pub type State = IterState<DVector<f64>, (), (), (), (), f64>;

/// Observer that ignores every iteration.
pub(super) struct NoObserver;

impl Observe<State> for NoObserver {}

/// Solver that reports the reason of its termination.
pub(super) trait ReportsTermination {
    /// Returns the reason of termination, or `None` while the solver runs.
    fn termination(&self) -> Option<Termination>;
}

/// Runs a solver from `start`. If it does not converge, the solution is the best point it
/// evaluated.
pub(super) fn run<O: Objective, S: Solver<O, State> + ReportsTermination>(
    objective: O,
    start: DVector<f64>,
    solver: S,
    max_iterations: u64,
    observer: Option<impl Observe<State> + 'static>,
) -> Solution {
    let mut executor = Executor::new(objective, solver)
        .configure(|state: State| state.param(start.clone()).max_iters(max_iterations))
        .ctrlc(false)
        .timer(false);
    if let Some(observer) = observer {
        executor = executor.add_observer(observer, ObserverMode::Always);
    }
    let mut solution = Solution::at(start);
    // The executor fails only when an observer does.
    let Ok(mut result) = executor.run() else { return solution };
    let count = |what: &str| result.problem.counts.get(what).copied().unwrap_or(0);
    // An acceleration takes one evaluation of residuals and one linearisation; differencing the
    // gradient takes one linearisation more than there are unknowns.
    let accelerations = count("acceleration_count");
    solution.cost_evaluations = count("cost_count") + accelerations;
    solution.linearisations = count("linearise_count")
        + accelerations
        + count("curvature_count") * (solution.x.len() as u64 + 1);
    solution.iterations = result.state.get_iter();
    solution.termination =
        match (result.solver.termination(), result.state.get_termination_status()) {
            (Some(termination), _) => termination,
            (None, TerminationStatus::Terminated(TerminationReason::MaxItersReached)) => {
                Termination::IterationLimit
            }
            (None, _) => Termination::Interrupted,
        };
    solution.cost = result.state.get_cost();
    let mut last = result.state.take_param();
    if !solution.termination.converged() && result.state.get_best_cost() < solution.cost {
        solution.cost = result.state.get_best_cost();
        last = result.state.take_best_param();
    }
    if let Some(x) = last {
        solution.x = x;
    }
    solution
}
