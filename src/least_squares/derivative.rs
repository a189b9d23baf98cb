//! Check of derivatives against extrapolated differences of the residuals.

use nalgebra::DVector;

use super::{LeastSquares, jacobian, residual_vector};

/// Largest number of decreasing difference steps from which one derivative is extrapolated to step
/// 0.
const MAX_EXTRAPOLATION_STEPS: usize = 12;
/// Ratio of successive difference steps, from which a derivative is extrapolated to step 0.
const STEP_RATIO: f64 = 1.4;
/// First steps tried, as fractions of an unknown's typical size.
const INITIAL_STEPS: [f64; 4] = [0.3, 3e-2, 3e-3, 3e-4];
/// Smallest denominator of a relative error, as a fraction of the largest ‖F‖ of all unknowns. It
/// avoids division by the effect of an unknown that moves nothing.
const MIN_RELATIVE_DENOMINATOR: f64 = 1e-9;

/// Comparison of one column of the Jacobian with differences.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ColumnCheck {
    /// Relative error ‖J − F‖ / ‖F‖ with the differences F; less where ‖F‖ is negligible.
    pub relative_error: f64,
    /// Estimated relative error of the differences F themselves. A relative error below it does not
    /// indicate a wrong derivative.
    pub accuracy: f64,
}

/// Comparison of a Jacobian with differences of the residuals, column by column.
#[derive(Debug, Clone, PartialEq)]
pub struct JacobianCheck {
    /// Comparison of each column of the Jacobian with differences, one entry per unknown.
    pub columns: Vec<ColumnCheck>,
}

impl JacobianCheck {
    /// Returns the unknown with the largest relative error and its comparison; `None` if there are
    /// no unknowns.
    pub fn worst(&self) -> Option<(usize, ColumnCheck)> {
        let nan_last = |error: f64| if error.is_nan() { f64::INFINITY } else { error };
        self.columns
            .iter()
            .copied()
            .enumerate()
            .max_by(|a, b| nan_last(a.1.relative_error).total_cmp(&nan_last(b.1.relative_error)))
    }
}

/// Compares the derivatives of `problem` at `x` with central differences extrapolated to step zero.
///
/// F = lim (r(x + h eⱼ) − r(x − h eⱼ)) / 2h, extrapolated in h² over steps h, h/1.4, h/1.4², …
/// [Ridders 1982]
///
/// `step` holds the typical size of each unknown (any sign, not zero), from which the steps h
/// start.
pub fn check_jacobian(
    problem: &impl LeastSquares,
    x: &DVector<f64>,
    step: &DVector<f64>,
) -> JacobianCheck {
    let exact = jacobian(problem, x);
    let differences: Vec<_> =
        (0..x.len()).map(|j| extrapolate(problem, x, j, step[j].abs())).collect();
    let effect = |j: usize| differences[j].0.norm() * step[j].abs();
    let largest = (0..x.len()).map(effect).filter(|e| e.is_finite()).fold(0.0, f64::max);
    let columns = differences
        .iter()
        .enumerate()
        .map(|(j, (difference, error))| {
            let floor = (MIN_RELATIVE_DENOMINATOR * largest / step[j].abs()).max(f64::MIN_POSITIVE);
            let size = difference.norm().max(floor);
            ColumnCheck {
                relative_error: (exact.column(j) - difference).norm() / size,
                accuracy: error / size,
            }
        })
        .collect();
    JacobianCheck { columns }
}

/// Returns ∂r/∂xⱼ by extrapolated differences, and its estimated error: the best of several first
/// steps. `size` is the typical size of unknown `j`.
fn extrapolate<P: LeastSquares>(
    problem: &P,
    x: &DVector<f64>,
    j: usize,
    size: f64,
) -> (DVector<f64>, f64) {
    let rows = problem.items() * problem.rows_per_item();
    let mut best = (DVector::from_element(rows, f64::NAN), f64::INFINITY);
    for first in INITIAL_STEPS {
        let estimate = ridders(|h| central_difference(problem, x, j, h), first * size);
        if estimate.1 < best.1 {
            best = estimate;
        }
    }
    best
}

fn central_difference<P: LeastSquares>(
    problem: &P,
    x: &DVector<f64>,
    j: usize,
    h: f64,
) -> DVector<f64> {
    let residual_at = |value: f64| {
        let mut moved = x.clone();
        moved[j] = value;
        residual_vector(problem, &moved)
    };
    // Divide by the step as it was rounded.
    let (above, below) = (x[j] + h, x[j] - h);
    (residual_at(above) - residual_at(below)) / (above - below)
}

/// Extrapolates the central differences `difference(h)` to h = 0 by Ridders' tableau, from the step
/// `first` downwards. Returns the limit and its estimated error. Stops once higher orders no longer
/// reduce that error.
fn ridders(difference: impl Fn(f64) -> DVector<f64>, first: f64) -> (DVector<f64>, f64) {
    let mut h = first;
    let mut previous = vec![difference(h)];
    let mut best = (previous[0].clone(), f64::INFINITY);
    for _ in 1..MAX_EXTRAPOLATION_STEPS {
        h /= STEP_RATIO;
        let mut row = vec![difference(h)];
        let mut factor = STEP_RATIO * STEP_RATIO;
        for order in 0..previous.len() {
            let next = (&row[order] * factor - &previous[order]) / (factor - 1.0);
            let error = (&next - &row[order]).norm().max((&next - &previous[order]).norm());
            if error < best.1 {
                best = (next.clone(), error);
            }
            row.push(next);
            factor *= STEP_RATIO * STEP_RATIO;
        }
        let last = row.len() - 1;
        if (&row[last] - &previous[last - 1]).norm() >= 2.0 * best.1 {
            break;
        }
        previous = row;
    }
    best
}
