//! Minimisation within bounds by the BFGS method, for functions that compute value and gradient
//! together.

use nalgebra::{DMatrix, DVector};

/// Change of the function value in one step below which the search has converged.
const CONVERGENCE_TOLERANCE: f64 = 5e-3;
/// Largest change of a variable in one step. The variables are logarithms, so this is a factor e²
/// in a hyperparameter.
const MAX_STEP: f64 = 2.0;
/// Smallest decrease that a step must reach, as a fraction of the decrease that the gradient
/// predicts. [Armijo 1966]
const ARMIJO_FRACTION: f64 = 1e-4;
/// Maximum number of times that a step is halved before the search stops.
const MAX_HALVINGS: usize = 12;

/// Minimum of a function that a search has found.
#[derive(Debug, Clone)]
pub(super) struct Minimum {
    pub at: DVector<f64>,
    pub value: f64,
    /// Estimate of the inverse Hessian, from which the search for a similar function's minimum may
    /// start.
    pub inverse: DMatrix<f64>,
}

/// Minimises `function` by at most `max_steps` descent steps within `bounds`. Returns `None` if the
/// function has no value at the start.
///
/// `start` is the initial point; `inverse` is an estimate of the inverse Hessian there, if one
/// exists. A variable at a bound is held there for one step if the function decreases beyond the
/// bound. Each step evaluates value and gradient together, because both need the same
/// factorisation.
pub(super) fn minimise(
    function: impl Fn(&DVector<f64>) -> Option<(f64, DVector<f64>)>,
    (start, inverse): (DVector<f64>, Option<DMatrix<f64>>),
    bounds: &[(f64, f64)],
    max_steps: usize,
) -> Option<Minimum> {
    let within =
        |x: DVector<f64>| DVector::from_fn(x.len(), |k, _| x[k].clamp(bounds[k].0, bounds[k].1));
    let mut at = within(start);
    let (mut value, mut gradient) = function(&at)?;
    let n = at.len();
    let mut is_scaled = inverse.is_some();
    let mut inverse = inverse.unwrap_or_else(|| DMatrix::identity(n, n));
    for _ in 0..max_steps {
        let held: Vec<bool> = (0..n)
            .map(|k| {
                (at[k] <= bounds[k].0 && gradient[k] > 0.0)
                    || (at[k] >= bounds[k].1 && gradient[k] < 0.0)
            })
            .collect();
        let free = DVector::from_fn(n, |k, _| if held[k] { 0.0 } else { gradient[k] });
        let mut step = -(&inverse * &free);
        (0..n).filter(|&k| held[k]).for_each(|k| step[k] = 0.0);
        if step.dot(&free) >= 0.0 {
            step = -&free;
            inverse = DMatrix::identity(n, n);
            is_scaled = false;
        }
        let longest = step.amax();
        if !is_scaled {
            step *= (0.5 / longest.max(f64::MIN_POSITIVE)).min(1.0);
        } else if longest > MAX_STEP {
            step *= MAX_STEP / longest;
        }
        let mut next = None;
        for _ in 0..MAX_HALVINGS {
            let tried = within(&at + &step);
            let expected = gradient.dot(&(&tried - &at));
            match function(&tried) {
                Some((reached, slope)) if reached <= value + ARMIJO_FRACTION * expected => {
                    next = Some((tried, reached, slope));
                    break;
                }
                _ => step *= 0.5,
            }
        }
        let Some((tried, reached, slope)) = next else { break };
        let (moved, turned) = (&tried - &at, &slope - &gradient);
        let curvature = moved.dot(&turned);
        if curvature > 1e-10 * moved.norm() * turned.norm() {
            if !is_scaled {
                inverse *= curvature / turned.norm_squared();
                is_scaled = true;
            }
            // (I − ρ s yᵀ) H (I − ρ y sᵀ) + ρ s sᵀ.                 [Nocedal & Wright 2006, eq. 6.17]
            let along = &inverse * &turned;
            let factor = (1.0 + turned.dot(&along) / curvature) / curvature;
            inverse += &moved * moved.transpose() * factor
                - (&along * moved.transpose() + &moved * along.transpose()) / curvature;
        }
        let gain = value - reached;
        (at, value, gradient) = (tried, reached, slope);
        if gain < CONVERGENCE_TOLERANCE {
            break;
        }
    }
    Some(Minimum { at, value, inverse })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_valley_is_followed_into_a_corner() {
        // The function is Rosenbrock's valley with its minimum at (1, 1), and the same with x
        // limited to 0.5.
        let function = |x: &DVector<f64>| {
            let (a, b) = (1.0 - x[0], x[1] - x[0] * x[0]);
            let gradient = DVector::from_vec(vec![-2.0 * a - 400.0 * x[0] * b, 200.0 * b]);
            Some((1e3 * (a * a + 100.0 * b * b), gradient * 1e3))
        };
        let start = DVector::from_vec(vec![-1.2, 1.0]);
        let free = minimise(function, (start.clone(), None), &[(-5.0, 5.0); 2], 500).unwrap().at;
        assert!((&free - DVector::from_vec(vec![1.0, 1.0])).amax() < 0.1, "{free}");
        let cut = minimise(function, (start, None), &[(-5.0, 0.5), (-5.0, 5.0)], 500).unwrap().at;
        assert!((&cut - DVector::from_vec(vec![0.5, 0.25])).amax() < 0.05, "{cut}");
    }
}
