//! argmin's executor, set up once for every solver.

use argmin::core::observers::{Observe, ObserverMode};
use argmin::core::{Executor, Solver, State as _, TerminationReason, TerminationStatus};
use nalgebra::DVector;

use super::{Solution, State, Subproblem, Termination, TrustRegion};
use crate::least_squares::Objective;

/// An observer that says nothing.
pub(super) struct Silent;

impl Observe<State> for Silent {}

/// A solver that says why it stopped.
pub(super) trait Ends {
    /// Why it stopped, once it has.
    fn end(&self) -> Option<Termination>;
}

impl<S: Subproblem> Ends for TrustRegion<S> {
    fn end(&self) -> Option<Termination> {
        self.termination()
    }
}

/// Runs a solver from `start`; where it does not converge, x is the best point that it has seen.
pub(super) fn run<O: Objective, S: Solver<O, State> + Ends>(
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
    // A bend takes a residual and a linearisation, second derivatives one linearisation more than
    // there are unknowns.
    let bends = count("bend_count");
    solution.cost_evaluations = count("cost_count") + bends;
    solution.linearisations =
        count("linearise_count") + bends + count("curvature_count") * (solution.x.len() as u64 + 1);
    solution.iterations = result.state.get_iter();
    solution.termination = match (result.solver.end(), result.state.get_termination_status()) {
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
