//! Command nearest to a seed that brings an arm to its target: damped Newton steps in closed form.

use nalgebra::{DMatrix, DVector};

/// Weight of a misfit of 1 m or 1 rad, squared, below that of a distance of 1 rad from the seed.
const WEIGHT_SQUARED: f64 = 1e-12;
/// Maximum number of steps; most commands take 4 to 8, near singular poses more.
const MAX_STEPS: usize = 1000;
/// Length of a step at which a command has settled \[rad\] or \[m\].
const SETTLED: f64 = 1e-12;
/// Damping after the first step that does not help [1/rad²], and where the search ends.
const DAMPING: (f64, f64) = (0.3, 1e20);
/// Factors of the damping after a step that does not help, and after one that does.
const FACTORS: (f64, f64) = (30.0, 0.03);
/// Increase of the cost by rounding that is accepted, relative to it.
const COST_ROUNDING: f64 = 1e4 * f64::EPSILON;

/// Target of some commands.
pub(super) struct Goal<'a> {
    /// Misfit desired − predicted at commands q, shape = (3 or 6) \[m, rad\]; NaN without equilibrium.
    pub misfit: &'a dyn Fn(&DVector<f64>) -> DVector<f64>,
    /// Slopes J of the prediction by the coordinates, shape = (3 or 6, commands).
    pub slopes: &'a dyn Fn(&DVector<f64>) -> DMatrix<f64>,
    /// Range of each command.
    pub limits: &'a [(f64, f64)],
}

impl Goal<'_> {
    /// Returns the commands q that minimise ‖r(q)‖² / 10⁻¹² + ‖q − seed‖² within the limits.
    ///
    /// A step d minimises ‖r − J d‖² / 10⁻¹² + ‖d − z‖² + μ ‖d‖², z = seed − q:
    /// d = z / (1 + μ) + Jᵀ λ, (J Jᵀ + 10⁻¹² (1 + μ)) λ = r − J z / (1 + μ), over the commands that
    /// no limit holds. The damping μ rises when a step does not help.  [Levenberg 1944]
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
                // A damped step is shorter than what is left.
                if step.amax() * (1.0 + damping) <= SETTLED {
                    break;
                }
                damping = if damping > DAMPING.0 { FACTORS.1 * damping } else { 0.0 };
            } else {
                damping = if damping > 0.0 { FACTORS.0 * damping } else { DAMPING.0 };
                if damping >= DAMPING.1 {
                    break;
                }
            }
        }
        q
    }

    /// Returns a step within the limits, by an active-set method.
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
                    // Without the limit the command would move inwards.
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
