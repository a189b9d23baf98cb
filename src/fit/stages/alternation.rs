//! Alternating fits (block coordinate descent): rate of convergence, and Anderson acceleration.

use std::collections::VecDeque;

use nalgebra::{DMatrix, DVector};

/// Maximum number of earlier sweeps that the acceleration combines.
const MAX_COMBINED_SWEEPS: usize = 10;
/// Smallest singular value of the differences of sweeps, relative to the largest one, that is used;
/// smaller ones are rounding.
const RANK_TOLERANCE: f64 = 1e-8;
/// Maximum number of power iterations that estimate the contraction factor.
const MAX_POWER_ITERATIONS: usize = 2000;
/// Change of the contraction factor, relative to 1 minus the factor, at which the power iteration
/// has converged.
const CONTRACTION_TOLERANCE: f64 = 1e-6;

/// Convergence of a fit that alternates between several stages.
#[doc(hidden)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alternation {
    /// Number of sweeps over all stages.
    pub sweeps: usize,
    /// Factor by which one sweep without acceleration multiplies the error near the optimum. The
    /// error is measured by the change of the predictions that it causes. `None` if it was not
    /// computed, or if data and priors leave a combination undetermined.
    pub contraction: Option<f64>,
}

/// Anderson acceleration of the fixed-point iteration x ← g(x) of a sweep  [Anderson 1965; Walker &
/// Ni 2011].
///
/// The next point is x + f − (ΔX + ΔF) γ with f = g(x) − x and γ = argmin ‖f − ΔF γ‖. The columns
/// of ΔX and ΔF are differences of x and f between successive sweeps. In the norm, unknowns are
/// scaled by their effect on the residual.
#[derive(Debug, Clone, Default)]
pub(in crate::fit) struct Anderson {
    /// Pairs of g(x) and scaled f of earlier sweeps, oldest first.
    sweeps: VecDeque<(DVector<f64>, DVector<f64>)>,
}

impl Anderson {
    /// Discards all earlier sweeps.
    pub fn restart(&mut self) {
        self.sweeps.clear();
    }

    /// Returns the next x to try after a sweep from `x` to `image` = g(x). `scale` holds the
    /// factors by which unknowns are scaled. Returns `None` after the first sweep, or if the next x
    /// is not finite.
    pub fn next(
        &mut self,
        x: &DVector<f64>,
        image: &DVector<f64>,
        scale: &DVector<f64>,
    ) -> Option<DVector<f64>> {
        self.sweeps.push_back((image.clone(), (image - x).component_mul(scale)));
        if self.sweeps.len() > MAX_COMBINED_SWEEPS + 1 {
            self.sweeps.pop_front();
        }
        let pairs: Vec<_> = self.sweeps.iter().zip(self.sweeps.iter().skip(1)).collect();
        let (_, residual) = self.sweeps.back()?;
        let column =
            |of: &dyn Fn(usize) -> DVector<f64>| (0..pairs.len()).map(of).collect::<Vec<_>>();
        let images = column(&|k| &pairs[k].1.0 - &pairs[k].0.0);
        let residuals = column(&|k| &pairs[k].1.1 - &pairs[k].0.1);
        if residuals.is_empty() {
            return None;
        }
        let svd = DMatrix::from_columns(&residuals).svd(true, true);
        let weights = svd.solve(residual, RANK_TOLERANCE * svd.singular_values.max()).ok()?;
        let next = image - DMatrix::from_columns(&images) * weights;
        next.iter().all(|value| value.is_finite()).then_some(next)
    }
}

/// Returns the asymptotic factor by which one sweep multiplies ‖R e‖ of an error e of the unknowns,
/// by power iteration. Each of `stages` in turn minimises ‖R e‖ over the unknowns that it lists.
///
/// `triangle` is the factor R of data and priors. Returns `None` if a stage leaves a combination of
/// its unknowns undetermined.
pub(in crate::fit) fn contraction(triangle: &DMatrix<f64>, stages: &[Vec<usize>]) -> Option<f64> {
    let hessian = triangle.tr_mul(triangle);
    let roots: Option<Vec<_>> = stages
        .iter()
        .map(|stage| hessian.select_rows(stage).select_columns(stage).cholesky())
        .collect();
    let roots = roots?;
    let n = triangle.ncols();
    let mut error = DVector::from_fn(n, |j, _| (1.0 + j as f64).sin() / hessian[(j, j)].sqrt());
    let mut rate = f64::INFINITY;
    for _ in 0..MAX_POWER_ITERATIONS {
        error /= (triangle * &error).norm();
        for (stage, root) in stages.iter().zip(&roots) {
            let step = root.solve(&(&hessian * &error).select_rows(stage));
            stage.iter().zip(step.iter()).for_each(|(&j, step)| error[j] -= step);
        }
        let next = (triangle * &error).norm();
        if !next.is_finite() || next < f64::EPSILON {
            return next.is_finite().then_some(0.0);
        }
        if (next - rate).abs() <= CONTRACTION_TOLERANCE * (1.0 - next) {
            return Some(next);
        }
        rate = next;
    }
    Some(rate.min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_unknowns_that_couple_contract_by_the_square_of_their_cosine() {
        // Two columns of length one are at 60° to each other, so each sweep multiplies the error by
        // cos² = ¼.
        let triangle = DMatrix::from_row_slice(2, 2, &[1.0, 0.5, 0.0, 0.75_f64.sqrt()]);
        let rate = contraction(&triangle, &[vec![0], vec![1]]).unwrap();
        assert!((rate - 0.25).abs() < 1e-9, "{rate}");
        assert_eq!(contraction(&triangle, &[vec![0, 1]]), Some(0.0));
    }

    #[test]
    fn a_linear_sweep_is_solved_in_as_many_sweeps_as_there_are_unknowns() {
        let slope = DMatrix::from_row_slice(3, 3, &[0.9, 0.2, 0.0, 0.1, 0.8, 0.1, 0.0, 0.1, 0.95]);
        let fixed = DVector::from_vec(vec![1.0, -2.0, 3.0]);
        let sweep = |x: &DVector<f64>| &fixed + &slope * (x - &fixed);
        let (mut anderson, mut x) = (Anderson::default(), DVector::zeros(3));
        for _ in 0..5 {
            let image = sweep(&x);
            x = anderson.next(&x, &image, &DVector::from_element(3, 1.0)).unwrap_or(image);
        }
        assert!((&x - &fixed).norm() < 1e-9, "{x}");
    }
}
