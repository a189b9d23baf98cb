//! argmin's own Gauss–Newton method, seeing an [`Objective`] through a small adapter.

use std::cell::RefCell;

use argmin::core::{
    Error, Executor, IterState, Jacobian, Operator, State as _, TerminationReason,
    TerminationStatus,
};
use argmin::solver::gaussnewton::GaussNewton;
use nalgebra::{DMatrix, DVector};

use super::divergence::Watch;
use super::{Divergence, Solution, Termination};
use crate::least_squares::{Linearisation, Objective};

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaussNewtonSettings {
    /// argmin's test: | ‖Qᵀr‖ₖ₋₁ − ‖Qᵀr‖ₖ | < `tolerance`, above 0, in the units of r; default √ε ≈
    /// 1.5e-8.
    pub tolerance: f64,
    /// Largest number of steps; default 100.
    pub max_iterations: u64,
    /// When to give up; see [`Divergence`].
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
/// argmin sees the operator Qᵀr and the Jacobian R, whose steps are those of r and J = Q R. It
/// inverts JᵀJ, which squares the condition number; a singular one ends the run as
/// [`Termination::Singular`]. Where the run does not converge, x is the best point it has seen,
/// which may be `start`.
pub fn minimise_gauss_newton<O: Objective>(
    objective: O,
    start: DVector<f64>,
    settings: &GaussNewtonSettings,
) -> Solution {
    let seen = RefCell::new(Seen {
        last: None,
        best: (start.clone(), f64::INFINITY),
        watch: Watch::new(settings.divergence),
        linearisations: 0,
        termination: None,
    });
    let adapter = Adapter { objective, seen };
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
    // argmin counts the steps it has finished; a run that fails has evaluated the start and then a
    // point a step.
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
    let Seen { last, best, linearisations, termination, .. } = adapter.seen.into_inner();
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

struct Adapter<O> {
    objective: O,
    seen: RefCell<Seen>,
}

/// What the adapter remembers of a run, since argmin hands nothing back when it fails.
struct Seen {
    last: Option<(DVector<f64>, Linearisation)>,
    best: (DVector<f64>, f64),
    watch: Watch,
    linearisations: u64,
    termination: Option<Termination>,
}

/// Why the adapter ends a run.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
struct Stop(Termination);

impl<O: Objective> Adapter<O> {
    /// Linearises at x, unless that was the last point.
    fn at<T>(&self, x: &DVector<f64>, use_it: impl Fn(&Linearisation) -> T) -> Result<T, Error> {
        let seen = &mut *self.seen.borrow_mut();
        if let Some((_, linearisation)) = seen.last.as_ref().filter(|(point, _)| point == x) {
            return Ok(use_it(linearisation));
        }
        let linearisation = self.objective.linearise(x);
        let first = seen.linearisations == 0;
        seen.linearisations += 1;
        let cost = linearisation.cost;
        seen.termination = if seen.watch.diverges(cost) {
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
        if cost < seen.best.1 {
            seen.best = (x.clone(), cost);
        }
        if let Some(termination) = seen.termination {
            return Err(Stop(termination).into());
        }
        let out = use_it(&linearisation);
        seen.last = Some((x.clone(), linearisation));
        Ok(out)
    }
}

impl<O: Objective> Operator for &Adapter<O> {
    type Param = DVector<f64>;
    type Output = DVector<f64>;

    fn apply(&self, x: &DVector<f64>) -> Result<DVector<f64>, Error> {
        self.at(x, |linearisation| linearisation.projected.clone())
    }
}

impl<O: Objective> Jacobian for &Adapter<O> {
    type Param = DVector<f64>;
    type Jacobian = DMatrix<f64>;

    fn jacobian(&self, x: &DVector<f64>) -> Result<DMatrix<f64>, Error> {
        self.at(x, |linearisation| linearisation.triangle.clone())
    }
}
