//! Pseudo-inverse iteration: full Gauss–Newton steps of minimum norm, without damping or scaling.

use argmin::core::observers::Observe;
use argmin::core::{Error, KV, Problem, Solver};
use argmin::kv;
use nalgebra::DVector;

use super::divergence::DivergenceMonitor;
use super::execute::{NoObserver, ReportsTermination, run};
use super::spectrum::Spectrum;
use super::trust_region::{state_after_iteration, take_point};
use super::{Divergence, Solution, State, Termination};
use crate::least_squares::{Linearisation, Objective};

/// Settings of the pseudo-inverse iteration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PseudoInverseSettings {
    /// Singular values σᵢ ≤ `tolerance`·σ₁ of J are dropped; 0 keeps every non-zero one. Default
    /// 1e-8.
    pub tolerance: f64,
    /// Step tolerance: the run ends if ‖p‖ ≤ `step_tolerance` (‖x‖ + `step_tolerance`); default
    /// 1e-10.
    pub step_tolerance: f64,
    /// Maximum number of steps; default 100.
    pub max_iterations: u64,
    /// Divergence test that ends the run; see [`Divergence`].
    pub divergence: Divergence,
}

impl Default for PseudoInverseSettings {
    fn default() -> Self {
        Self {
            tolerance: 1e-8,
            step_tolerance: 1e-10,
            max_iterations: 100,
            divergence: Divergence::default(),
        }
    }
}

/// Pseudo-inverse iteration of \[Chen2021\].
///
/// xₖ₊₁ = xₖ − J(xₖ)⁺ r(xₖ),  J⁺r = R⁺Qᵀr = Σ vᵢ (uᵢᵀQᵀr)/σᵢ over σᵢ > `tolerance`·σ₁ [Chen2021,
/// eq. 45]
///
/// R = U Σ Vᵀ is the n × n triangular factor of J = ∂r/∂x. The paper does not scale the unknowns,
/// so the dropped directions depend on their units. Every step is taken in full.
#[derive(Debug, Clone)]
pub struct PseudoInverse {
    settings: PseudoInverseSettings,
    monitor: DivergenceMonitor,
    linearisation: Option<Linearisation>,
    termination: Option<Termination>,
}

impl PseudoInverse {
    /// Creates the iteration with these settings.
    pub fn new(settings: PseudoInverseSettings) -> Self {
        Self {
            settings,
            monitor: DivergenceMonitor::new(settings.divergence),
            linearisation: None,
            termination: None,
        }
    }

    /// Stores the linearisation at a new point. Returns the reason to stop there, or `None`.
    fn accept_linearisation(&mut self, linearisation: Linearisation) -> Option<Termination> {
        let Linearisation { cost, triangle, projected } = &linearisation;
        let termination = if self.monitor.diverges(*cost) {
            Some(Termination::Diverged)
        } else if !triangle.iter().chain(projected.iter()).all(|value| value.is_finite()) {
            Some(Termination::DerivativesNotFinite)
        } else if *cost == 0.0 {
            Some(Termination::ZeroResidual)
        } else {
            None
        };
        self.linearisation = Some(linearisation);
        termination
    }
}

impl ReportsTermination for PseudoInverse {
    fn termination(&self) -> Option<Termination> {
        self.termination
    }
}

/// Returns the minimum-norm step p = −J⁺ r = −R⁺ Qᵀr; singular values up to `tolerance`·σ₁ are
/// dropped.
///
/// R and Qᵀr must be finite.
pub fn minimum_norm_step(linearisation: &Linearisation, tolerance: f64) -> DVector<f64> {
    let Linearisation { triangle, projected, .. } = linearisation;
    Spectrum::new(triangle, projected, tolerance.max(0.0)).solution(0.0, projected.len())
}

impl<O: Objective> Solver<O, State> for PseudoInverse {
    fn name(&self) -> &'static str {
        "pseudo-inverse"
    }

    fn init(
        &mut self,
        problem: &mut Problem<O>,
        mut state: State,
    ) -> Result<(State, Option<KV>), Error> {
        let x = take_point(&mut state)?;
        if problem.problem.as_ref().map(Objective::parameters) != Some(x.len()) {
            self.termination = Some(Termination::SizeMismatch);
            return Ok((state_after_iteration(state, x, f64::INFINITY, self.termination), None));
        }
        let linearisation = problem.problem("linearise_count", |o| Ok(o.linearise(&x)))?;
        let cost = linearisation.cost;
        self.termination = match self.accept_linearisation(linearisation) {
            Some(Termination::Diverged) => Some(Termination::OutsideDomainAtStart),
            termination => termination,
        };
        Ok((state_after_iteration(state, x, cost, self.termination), None))
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<O>,
        mut state: State,
    ) -> Result<(State, Option<KV>), Error> {
        let x = take_point(&mut state)?;
        let step = self.linearisation.take().map_or_else(
            || DVector::zeros(x.len()),
            |linearisation| minimum_norm_step(&linearisation, self.settings.tolerance),
        );
        let length = step.norm();
        let point = &x + step;
        let linearisation = problem.problem("linearise_count", |o| Ok(o.linearise(&point)))?;
        let cost = linearisation.cost;
        let size = point.norm() + self.settings.step_tolerance;
        let small_step =
            (length <= self.settings.step_tolerance * size).then_some(Termination::Step);
        self.termination = self.accept_linearisation(linearisation).or(small_step);
        let cost = if cost.is_nan() { f64::INFINITY } else { cost };
        let log = kv!("length" => length;);
        Ok((state_after_iteration(state, point, cost, self.termination), Some(log)))
    }
}

/// Minimises ½‖r(x)‖² from `start` by the pseudo-inverse iteration.
///
/// If the iteration does not converge, the solution is the best point evaluated, which may be
/// `start`.
pub fn minimise_pseudo_inverse<O: Objective>(
    objective: O,
    start: DVector<f64>,
    settings: &PseudoInverseSettings,
) -> Solution {
    minimise_pseudo_inverse_observed(objective, start, settings, None::<NoObserver>)
}

/// Minimises like [`minimise_pseudo_inverse`] and calls `observer`, if any, after every iteration.
pub fn minimise_pseudo_inverse_observed<O: Objective>(
    objective: O,
    start: DVector<f64>,
    settings: &PseudoInverseSettings,
    observer: Option<impl Observe<State> + 'static>,
) -> Solution {
    run(objective, start, PseudoInverse::new(*settings), settings.max_iterations, observer)
}
