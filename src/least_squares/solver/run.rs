//! Entry points: minimisation of an objective from a start in one call.

use argmin::core::observers::Observe;
use nalgebra::DVector;

use super::bounded::{Constrained, StepMethod, nearest};
use super::execute::{NoObserver, run};
use super::levenberg_marquardt::Unconstrained;
use super::reflective::Reflective;
use super::{
    Bounds, Inequalities, Settings, Solution, State, Subproblem, Termination, TrustRegion,
};
use crate::least_squares::Objective;

/// Distance to a bound, as a fraction of the width between the bounds, up to which a solution is
/// moved onto the bound.
const MAX_DISTANCE_TO_BOUND: f64 = 1e-3;
/// Largest relative increase of the cost that counts as rounding.
const MAX_COST_ROUNDING: f64 = 1e-12;

/// Minimises ½‖r(x)‖² from `start` by Levenberg–Marquardt.
///
/// ```
/// use std::ops::Range;
///
/// use flexcal::least_squares::{Block, Fit, LeastSquares};
/// use flexcal::least_squares::solver::{Settings, minimise};
/// use nalgebra::{DVector, dvector};
///
/// /// Readings of an exponential decay y = x₀ exp(−x₁ t) at t = 0, 1, 2, 3.
/// struct Decay([f64; 4]);
///
/// impl LeastSquares for Decay {
///     fn parameters(&self) -> usize { 2 }
///     fn items(&self) -> usize { 4 }
///     fn rows_per_item(&self) -> usize { 1 }
///
///     fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]) {
///         for (out, t) in out.iter_mut().zip(items) {
///             *out = self.0[t] - x[0] * (-x[1] * t as f64).exp();
///         }
///     }
///
///     fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block) {
///         self.residuals(x, items.clone(), block.column_mut(2));
///         for (row, t) in items.enumerate() {
///             let decay = (-x[1] * t as f64).exp();
///             block.column_mut(0)[row] = -decay;
///             block.column_mut(1)[row] = x[0] * t as f64 * decay;
///         }
///     }
/// }
///
/// let decay = Decay([2.0, 1.0, 0.5, 0.25]);
/// let solution = minimise(Fit::new(&decay), dvector![1.0, 0.0], &Settings::default());
/// assert!(solution.termination.converged());
/// assert!((solution.x[1] - 2.0_f64.ln()).abs() < 1e-9);
/// ```
pub fn minimise<O: Objective>(objective: O, start: DVector<f64>, settings: &Settings) -> Solution {
    minimise_observed(objective, start, settings, None::<NoObserver>)
}

/// Minimises like [`minimise`] and calls `observer`, if any, after every iteration.
pub fn minimise_observed<O: Objective>(
    objective: O,
    start: DVector<f64>,
    settings: &Settings,
    observer: Option<impl Observe<State> + 'static>,
) -> Solution {
    solve(objective, start, Unconstrained::default(), settings, observer)
}

/// Runs the trust-region loop around a subproblem.
fn solve<O: Objective>(
    objective: O,
    start: DVector<f64>,
    subproblem: impl Subproblem,
    settings: &Settings,
    observer: Option<impl Observe<State> + 'static>,
) -> Solution {
    let solver = TrustRegion::new(subproblem, *settings);
    run(objective, start, solver, settings.max_iterations, observer)
}

/// Method that keeps the unknowns within bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum BoundMethod {
    /// Damped steps in the polyhedron of the constraints by an active-set method.
    #[default]
    ActiveSet,
    /// Damped steps in the polyhedron of the constraints by Clarabel's interior-point method.
    InteriorPoint,
    /// Interior reflective steps [Branch, Coleman & Li 1999]; ignores inequalities.
    Reflective,
    /// Unconstrained steps clamped to the bounds, a baseline; ignores inequalities.
    Clamped,
}

/// Minimises ½‖r(x)‖² within `bounds` from `start` with active-set steps.
pub fn minimise_bounded<O: Objective>(
    objective: O,
    start: DVector<f64>,
    bounds: &Bounds,
    settings: &Settings,
) -> Solution {
    let rows = Inequalities::none(bounds.lower().len());
    minimise_constrained(objective, start, bounds, &rows, settings)
}

/// Minimises ½‖r(x)‖² within `bounds` and inequalities `rows` from `start` with active-set steps.
pub fn minimise_constrained<O: Objective>(
    objective: O,
    start: DVector<f64>,
    bounds: &Bounds,
    rows: &Inequalities,
    settings: &Settings,
) -> Solution {
    let method = BoundMethod::ActiveSet;
    minimise_constrained_by(method, objective, start, (bounds, rows), settings, None::<NoObserver>)
}

/// Minimises ½‖r(x)‖² within `bounds` and inequalities `rows` by the given method and calls
/// `observer`, if any, after every iteration.
pub fn minimise_constrained_by<O: Objective>(
    method: BoundMethod,
    objective: O,
    start: DVector<f64>,
    (bounds, rows): (&Bounds, &Inequalities),
    settings: &Settings,
    observer: Option<impl Observe<State> + 'static>,
) -> Solution {
    let sizes_match = start.len() == bounds.lower().len() && start.len() == rows.matrix().ncols();
    let is_infeasible = sizes_match && nearest(&start, bounds, rows).is_none();
    let constrained = |method, rows| Constrained::new(method, bounds.clone(), rows);
    let subproblem = match method {
        BoundMethod::ActiveSet => Some(constrained(StepMethod::ActiveSet, rows.clone())),
        BoundMethod::InteriorPoint => Some(constrained(StepMethod::InteriorPoint, rows.clone())),
        BoundMethod::Clamped => {
            Some(constrained(StepMethod::Clamped, Inequalities::none(bounds.lower().len())))
        }
        BoundMethod::Reflective => None,
    };
    let mut solution = match subproblem {
        Some(subproblem) => solve(&objective, start, subproblem, settings, observer),
        None => solve(&objective, start, Reflective::new(bounds.clone()), settings, observer),
    };
    if is_infeasible {
        solution.termination = Termination::Infeasible;
    } else if sizes_match {
        if matches!(method, BoundMethod::InteriorPoint | BoundMethod::Reflective) {
            move_onto_bounds(&objective, bounds, rows, &mut solution);
        }
        solution.at_bound = (0..solution.x.len()).map(|j| bounds.at(&solution.x, j)).collect();
        solution.at_limit = (0..rows.len()).map(|i| rows.at(&solution.x, i)).collect();
    }
    solution
}

/// Moves each unknown onto a bound that is near, one at a time, if that does not raise the cost.
fn move_onto_bounds<O: Objective>(
    objective: &O,
    bounds: &Bounds,
    rows: &Inequalities,
    solution: &mut Solution,
) {
    for j in 0..solution.x.len() {
        for bound in [bounds.lower()[j], bounds.upper()[j]] {
            let (value, width) = (solution.x[j], bounds.upper()[j] - bounds.lower()[j]);
            let size = if width.is_finite() { width } else { bound.abs().max(value.abs()) };
            let distance = (value - bound).abs();
            if !bound.is_finite() || distance == 0.0 || distance > MAX_DISTANCE_TO_BOUND * size {
                continue;
            }
            let mut moved = solution.x.clone();
            moved[j] = bound;
            if !rows.contain(&moved) {
                continue;
            }
            let cost = objective.cost(&moved);
            solution.cost_evaluations += 1;
            if cost <= solution.cost * (1.0 + MAX_COST_ROUNDING) {
                (solution.x, solution.cost) = (moved, cost);
            }
        }
    }
}
