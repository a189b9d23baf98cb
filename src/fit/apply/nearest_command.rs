//! Inverse kinematics: the command nearest to a seed that brings an arm to its target, by damped
//! Newton steps.

use nalgebra::{DMatrix, DVector};

/// Weight of the squared distance from the seed [rad² or m²] relative to the squared misfit [m² or
/// rad²]. It is so small that the distance only selects among the commands that reach the target.
const WEIGHT_SQUARED: f64 = 1e-12;
/// Maximum number of steps for one target. Most targets take 4 to 8; near singular poses they take
/// more.
const MAX_STEPS: usize = 1000;
/// Largest undamped step of a command at which the search has converged \[rad\] or \[m\].
const MAX_CONVERGED_STEP: f64 = 1e-12;
/// Damping μ after the first rejected step, and damping at which the search ends without success;
/// both relative to the weight of the distance from the seed.
const DAMPING_RANGE: (f64, f64) = (0.3, 1e20);
/// Factors on the damping μ after a rejected and after an accepted step.
const DAMPING_FACTORS: (f64, f64) = (30.0, 0.03);
/// Largest relative increase of the cost by a step that is rounding, so that the step is accepted.
const COST_ROUNDING: f64 = 1e4 * f64::EPSILON;

/// Target of an inverse-kinematics search: its misfit and the derivatives as functions of the
/// commands q, and the limits of q.
pub(super) struct Goal<'a> {
    /// Function that returns the misfit r at q, desired − predicted position \[m\] and, if it is
    /// desired, the orientation error \[rad\], shape = (3 or 6); NaN without an equilibrium.
    pub misfit: &'a dyn Fn(&DVector<f64>) -> DVector<f64>,
    /// Function that returns the derivatives J of the predicted pose with respect to q, shape = (3
    /// or 6, commands).
    pub slopes: &'a dyn Fn(&DVector<f64>) -> DMatrix<f64>,
    /// Lower and upper limit of each command \[rad\] or \[m\].
    pub limits: &'a [(f64, f64)],
}

impl Goal<'_> {
    /// Returns the commands q that minimise ‖r(q)‖² / 10⁻¹² + ‖q − seed‖² within the limits.
    ///
    /// A step d minimises ‖r − J d‖² / 10⁻¹² + ‖d − z‖² + μ ‖d‖², z = seed − q: d = z / (1 + μ) +
    /// Jᵀ λ, (J Jᵀ + 10⁻¹² (1 + μ)) λ = r − J z / (1 + μ), over the commands that are on no limit.
    /// The damping μ rises after a rejected step. [Levenberg 1944]
    pub fn nearest(&self, seed: &DVector<f64>) -> DVector<f64> {
        let cost = |r: &DVector<f64>, q: &DVector<f64>| {
            r.norm_squared() + WEIGHT_SQUARED * (q - seed).norm_squared()
        };
        let (mut q, mut damping) = (seed.clone(), 0.0);
        let mut misfit = (self.misfit)(&q);
        let mut slopes = (self.slopes)(&q);
        for _ in 0..MAX_STEPS {
            let step = self.step((&q, seed), (&misfit, &slopes), damping);
            let mut next = &q + &step;
            for (value, (low, high)) in next.iter_mut().zip(self.limits) {
                *value = value.max(*low).min(*high);
            }
            let tried = (self.misfit)(&next);
            if cost(&tried, &next) <= (1.0 + COST_ROUNDING) * cost(&misfit, &q) {
                (q, misfit) = (next, tried);
                slopes = (self.slopes)(&q);
                // The damping μ shortens a step by up to the factor 1 + μ.
                if step.amax() * (1.0 + damping) <= MAX_CONVERGED_STEP {
                    break;
                }
                damping = if damping > DAMPING_RANGE.0 { DAMPING_FACTORS.1 * damping } else { 0.0 };
            } else {
                damping = if damping > 0.0 { DAMPING_FACTORS.0 * damping } else { DAMPING_RANGE.0 };
                if damping >= DAMPING_RANGE.1 {
                    break;
                }
            }
        }
        q
    }

    /// Returns the step d of [`nearest`](Self::nearest) at the commands `q` within their limits, by
    /// an active-set method.
    fn step(
        &self,
        (q, seed): (&DVector<f64>, &DVector<f64>),
        (misfit, slopes): (&DVector<f64>, &DMatrix<f64>),
        damping: f64,
    ) -> DVector<f64> {
        let (n, stiff) = (q.len(), 1.0 + damping);
        let away = (seed - q) / stiff;
        let room = |j: usize| (self.limits[j].0 - q[j], self.limits[j].1 - q[j]);
        let (mut held, mut step) = (vec![false; n], DVector::<f64>::zeros(n));
        for _ in 0..=2 * n {
            let mut matrix =
                DMatrix::identity(misfit.len(), misfit.len()) * (WEIGHT_SQUARED * stiff);
            let mut right = misfit.clone();
            for j in 0..n {
                let column = slopes.column(j);
                right.axpy(if held[j] { -step[j] } else { -away[j] }, &column, 1.0);
                if !held[j] {
                    matrix.ger(1.0, &column, &column, 1.0);
                }
            }
            let Some(factor) = matrix.cholesky() else { break };
            let multipliers = factor.solve(&right);
            let (mut worst, mut which) = (10.0 * f64::EPSILON, None);
            for j in 0..n {
                let along = away[j] + slopes.column(j).dot(&multipliers);
                let (low, high) = room(j);
                let beyond = if !held[j] {
                    step[j] = along;
                    (low - along).max(along - high)
                } else if step[j] <= low {
                    // A positive value means that the free step leaves the limit inwards.
                    along - step[j]
                } else {
                    step[j] - along
                };
                if beyond > worst {
                    (worst, which) = (beyond, Some(j));
                }
            }
            let Some(j) = which else { break };
            held[j] = !held[j];
            if held[j] {
                let (low, high) = room(j);
                step[j] = if step[j] < low { low } else { high };
            }
        }
        step
    }
}
