//! One call from objective and start to solution.

use argmin::core::observers::Observe;
use nalgebra::DVector;

use super::execute::{Silent, run};
use super::{Bounds, Inequalities, Settings, Solution, State, Termination};
use super::{constrained_levenberg_marquardt, levenberg_marquardt, nearest};
use crate::least_squares::Objective;

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

/// Minimises ½‖r(x)‖² within `bounds` from `start`.
pub fn minimise_bounded<O: Objective>(
    objective: O,
    start: DVector<f64>,
    bounds: &Bounds,
    settings: &Settings,
) -> Solution {
    constrained(objective, start, bounds, &Inequalities::none(bounds.lower().len()), settings, None::<Silent>)
}

/// As [`minimise_bounded`], telling `observer` of every iteration.
pub fn minimise_bounded_observed<O: Objective>(
    objective: O,
    start: DVector<f64>,
    bounds: &Bounds,
    settings: &Settings,
    observer: impl Observe<State> + 'static,
) -> Solution {
    constrained(objective, start, bounds, &Inequalities::none(bounds.lower().len()), settings, Some(observer))
}

/// Minimises ½‖r(x)‖² within `bounds` and inequalities `rows` from `start`.
pub fn minimise_constrained<O: Objective>(
    objective: O,
    start: DVector<f64>,
    bounds: &Bounds,
    rows: &Inequalities,
    settings: &Settings,
) -> Solution {
    constrained(objective, start, bounds, rows, settings, None::<Silent>)
}

/// As [`minimise_constrained`], telling `observer` of every iteration.
pub fn minimise_constrained_observed<O: Objective>(
    objective: O,
    start: DVector<f64>,
    bounds: &Bounds,
    rows: &Inequalities,
    settings: &Settings,
    observer: impl Observe<State> + 'static,
) -> Solution {
    constrained(objective, start, bounds, rows, settings, Some(observer))
}

fn constrained<O: Objective>(
    objective: O,
    start: DVector<f64>,
    bounds: &Bounds,
    rows: &Inequalities,
    settings: &Settings,
    observer: Option<impl Observe<State> + 'static>,
) -> Solution {
    let fits = start.len() == bounds.lower().len() && start.len() == rows.matrix().ncols();
    let infeasible = fits && nearest(&start, bounds, rows).is_none();
    let solver = constrained_levenberg_marquardt(bounds.clone(), rows.clone(), *settings);
    let mut solution = run(objective, start, solver, settings.max_iterations, observer);
    if infeasible {
        solution.termination = Termination::Infeasible;
    } else if fits {
        solution.at_bound = (0..solution.x.len()).map(|j| bounds.at(&solution.x, j)).collect();
        solution.at_limit = (0..rows.len()).map(|i| rows.at(&solution.x, i)).collect();
    }
    solution
}
