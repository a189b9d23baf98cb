//! One call from objective and start to solution.

use argmin::core::observers::Observe;
use nalgebra::DVector;

use super::execute::{Silent, run};
use super::{Bounds, Inequalities, Settings, Solution, State, Termination};
use super::{
    clamped_levenberg_marquardt, constrained_levenberg_marquardt,
    interior_point_levenberg_marquardt, levenberg_marquardt, nearest,
    reflective_levenberg_marquardt,
};
use crate::least_squares::Objective;

/// Part of the width between bounds within which an interior point is beside a bound.
const BESIDE: f64 = 1e-3;
/// Relative change of the cost that is rounding.
const NO_WORSE: f64 = 1e-12;

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
    run(objective, start, levenberg_marquardt(*settings), settings.max_iterations, None::<Silent>)
}

/// As [`minimise`], telling `observer` of every iteration.
pub fn minimise_observed<O: Objective>(
    objective: O,
    start: DVector<f64>,
    settings: &Settings,
    observer: impl Observe<State> + 'static,
) -> Solution {
    run(objective, start, levenberg_marquardt(*settings), settings.max_iterations, Some(observer))
}

/// How bounds are kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum Within {
    /// [`constrained_levenberg_marquardt`].
    #[default]
    ActiveSet,
    /// [`interior_point_levenberg_marquardt`].
    InteriorPoint,
    /// [`reflective_levenberg_marquardt`]; inequalities are not seen.
    Reflective,
    /// [`clamped_levenberg_marquardt`]; inequalities are not seen.
    Clamped,
}

/// Minimises ½‖r(x)‖² within `bounds` from `start`.
pub fn minimise_bounded<O: Objective>(
    objective: O,
    start: DVector<f64>,
    bounds: &Bounds,
    settings: &Settings,
) -> Solution {
    minimise_constrained(
        objective,
        start,
        bounds,
        &Inequalities::none(bounds.lower().len()),
        settings,
    )
}

/// Minimises ½‖r(x)‖² within `bounds` and inequalities `rows` from `start`.
pub fn minimise_constrained<O: Objective>(
    objective: O,
    start: DVector<f64>,
    bounds: &Bounds,
    rows: &Inequalities,
    settings: &Settings,
) -> Solution {
    minimise_within(Within::ActiveSet, objective, start, (bounds, rows), settings, None::<Silent>)
}

/// The same in the way that `within` says, telling `observer` of every iteration.
pub fn minimise_within<O: Objective>(
    within: Within,
    objective: O,
    start: DVector<f64>,
    (bounds, rows): (&Bounds, &Inequalities),
    settings: &Settings,
    observer: Option<impl Observe<State> + 'static>,
) -> Solution {
    let fits = start.len() == bounds.lower().len() && start.len() == rows.matrix().ncols();
    let infeasible = fits && nearest(&start, bounds, rows).is_none();
    let (box_alone, limit) = (bounds.clone(), settings.max_iterations);
    let mut solution = match within {
        Within::ActiveSet => {
            let solver = constrained_levenberg_marquardt(box_alone, rows.clone(), *settings);
            run(&objective, start, solver, limit, observer)
        }
        Within::InteriorPoint => {
            let solver = interior_point_levenberg_marquardt(box_alone, rows.clone(), *settings);
            run(&objective, start, solver, limit, observer)
        }
        Within::Reflective => run(
            &objective,
            start,
            reflective_levenberg_marquardt(box_alone, *settings),
            limit,
            observer,
        ),
        Within::Clamped => run(
            &objective,
            start,
            clamped_levenberg_marquardt(box_alone, *settings),
            limit,
            observer,
        ),
    };
    if infeasible {
        solution.termination = Termination::Infeasible;
    } else if fits {
        if matches!(within, Within::InteriorPoint | Within::Reflective) {
            settle(&objective, bounds, rows, &mut solution);
        }
        solution.at_bound = (0..solution.x.len()).map(|j| bounds.at(&solution.x, j)).collect();
        solution.at_limit = (0..rows.len()).map(|i| rows.at(&solution.x, i)).collect();
    }
    solution
}

/// Puts unknowns on bounds that they are near where that does not raise the cost, each by itself.
fn settle<O: Objective>(
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
            if !bound.is_finite() || distance == 0.0 || distance > BESIDE * size {
                continue;
            }
            let mut settled = solution.x.clone();
            settled[j] = bound;
            if !rows.contain(&settled) {
                continue;
            }
            let cost = objective.cost(&settled);
            solution.cost_evaluations += 1;
            if cost <= solution.cost * (1.0 + NO_WORSE) {
                (solution.x, solution.cost) = (settled, cost);
            }
        }
    }
}
