//! Trust-region loop shared by the solvers: try a step, compare it with its prediction, accept it
//! or shrink the radius.

use argmin::core::{ArgminError, Error, KV, Problem, Solver, State as _, TerminationReason};
use argmin::kv;
use nalgebra::{DMatrix, DVector};

use super::execute::{ReportsTermination, State};
use super::second_order::{ConvexModel, SecondOrder};
use super::step::Step;
use super::trial::{MIN_GROWTH_RATIO, Trial};
use super::{Settings, Termination};
use crate::least_squares::{Linearisation, Objective};

/// Smallest gain ratio ρ (actual over predicted reduction of the cost) at which a step is accepted.
const MIN_ACCEPTED_RATIO: f64 = 1e-4;
/// Largest ratio of geodesic acceleration to step length at which an accelerated step is used.
const MAX_ACCELERATION_RATIO: f64 = 0.75;
/// Maximum number of accelerated steps tried from one point, with decreasing radius.
const MAX_ACCELERATION_TRIES: usize = 6;
/// Largest relative change of the cost that counts as rounding.
const MAX_COST_ROUNDING: f64 = 1e3 * f64::EPSILON;

/// Method by which a solver chooses its step from a linearisation.
pub trait Subproblem {
    /// Returns the name of the solver.
    fn name(&self) -> &'static str;

    /// Moves a start to a feasible point; returns false if the sizes differ.
    fn admit_start(&self, start: &mut DVector<f64>) -> bool;

    /// Stores the linearised problem at x; `scale` is the diagonal of D.
    fn prepare(
        &mut self,
        x: &DVector<f64>,
        linearisation: &Linearisation,
        scale: &DVector<f64>,
        settings: &Settings,
    );

    /// Returns component `j` of the gradient, or zero if a constraint at `x` blocks descent along
    /// it; `gradient` is its unconstrained value.
    fn free_gradient(&self, x: &DVector<f64>, j: usize, gradient: f64) -> f64;

    /// Removes from a gradient with unit columns (divided by `scale`) the components that
    /// constraints at x block.
    fn project_gradient(
        &self,
        x: &DVector<f64>,
        scale: &DVector<f64>,
        gradient: &mut DVector<f64>,
    ) {
        let _ = scale;
        (0..x.len()).for_each(|j| gradient[j] = self.free_gradient(x, j, gradient[j]));
    }

    /// Returns true if the problem may be evaluated at x.
    fn is_feasible(&self, x: &DVector<f64>) -> bool {
        let _ = x;
        true
    }

    /// Returns true if constraints changed the last step; only then may second derivatives be
    /// formed.
    fn is_step_constrained(&self) -> bool {
        false
    }

    /// Returns true if steps may be accelerated although no constraint is active.
    fn accelerates_unconstrained(&self) -> bool {
        false
    }

    /// Returns the unit normals of the constraints at x that a step against the scaled gradient
    /// would violate, shape = (faces, n), in unknowns scaled by `scale`.
    fn active_normals(
        &self,
        x: &DVector<f64>,
        scale: &DVector<f64>,
        gradient: &DVector<f64>,
    ) -> DMatrix<f64> {
        let _ = (scale, gradient);
        DMatrix::zeros(0, x.len())
    }

    /// Returns the point reached by the last step with acceleration, at the same damping.
    ///
    /// ½ `acceleration` (Jᵀ r″) is added to the gradient of the model. Returns `None` if the method
    /// has no accelerated step.
    fn accelerated(
        &mut self,
        x: &DVector<f64>,
        acceleration: &DVector<f64>,
        damping: f64,
    ) -> Option<DVector<f64>> {
        let _ = (x, acceleration, damping);
        None
    }

    /// Returns the best step with ‖D p‖ ≤ `radius` to within 10 %.
    fn step(&mut self, x: &DVector<f64>, radius: f64) -> Step;
}

/// Trust-region least squares after Moré, generic over the choice of step.
///
/// Dⱼ is the largest ‖Jⱼ‖ so far, so that the path does not depend on the units of the unknowns.
/// Radius and gain ratio follow MINPACK's `lmder` [Moré 1978]. After the first constrained step, Dⱼ
/// is the inverse of the plausible size of unknown j, where it is known. Constraints may keep
/// residuals large along combinations that they hardly determine, and scaling by ‖Jⱼ‖ would let
/// these combinations leave the range in which linearised residuals are valid.
#[derive(Debug, Clone)]
pub struct TrustRegion<S> {
    subproblem: S,
    settings: Settings,
    scale: DVector<f64>,
    radius: Option<f64>,
    /// True once the scaling D was set from the plausible sizes of the unknowns; it then no longer
    /// follows the columns of the Jacobian.
    is_scale_fixed: bool,
    second_order: SecondOrder,
    /// Residuals linearised at the present point x; `None` before the first evaluation.
    linearisation: Option<Linearisation>,
    /// Model with second derivatives that replaces the linearised problem, if S is in use.
    convex: Option<ConvexModel>,
    termination: Option<Termination>,
}

impl<S: Subproblem> TrustRegion<S> {
    /// Creates the loop around `subproblem`.
    pub fn new(subproblem: S, settings: Settings) -> Self {
        Self {
            subproblem,
            settings,
            scale: DVector::zeros(0),
            radius: None,
            is_scale_fixed: false,
            second_order: SecondOrder::default(),
            linearisation: None,
            convex: None,
            termination: None,
        }
    }

    /// Updates the scaling, tests the gradient for convergence and stores the linearisation.
    /// Returns the reason to stop, if any.
    fn accept_linearisation(
        &mut self,
        x: &DVector<f64>,
        linearisation: Linearisation,
    ) -> Option<Termination> {
        let Linearisation { cost, triangle, projected } = &linearisation;
        if !triangle.iter().chain(projected.iter()).all(|v| v.is_finite()) {
            return Some(Termination::DerivativesNotFinite);
        }
        if *cost == 0.0 {
            return Some(Termination::ZeroResidual);
        }
        let norms = DVector::from_iterator(x.len(), triangle.column_iter().map(|c| c.norm()));
        if !norms.iter().all(|norm| norm.is_finite()) {
            return Some(Termination::DerivativesNotFinite);
        }
        let lengths = norms.map(|norm| if norm == 0.0 { 1.0 } else { norm });
        if self.radius.is_none() {
            self.scale.clone_from(&lengths);
        } else if !self.is_scale_fixed {
            self.scale = self.scale.sup(&norms);
        }
        let residual = (2.0 * cost).sqrt();
        let mut gradient =
            DVector::from_fn(x.len(), |j, _| triangle.column(j).dot(projected) / lengths[j]);
        self.subproblem.project_gradient(x, &lengths, &mut gradient);
        let cosine = gradient.amax() / residual;
        if cosine <= self.settings.gradient_tolerance {
            return Some(Termination::Gradient);
        }
        if cosine <= f64::EPSILON {
            return Some(Termination::GradientPrecision);
        }
        if self.radius.is_none() {
            let length = self.scale.component_mul(x).norm();
            let factor = self.settings.initial_radius;
            self.radius = Some(residual.max(if length > 0.0 { factor * length } else { factor }));
        }
        self.linearisation = Some(linearisation);
        None
    }

    /// Passes the model of the next steps to the subproblem.
    fn prepare(&mut self, x: &DVector<f64>) {
        let Some(linearisation) = &self.linearisation else { return };
        let gradient =
            || linearisation.triangle.tr_mul(&linearisation.projected).component_div(&self.scale);
        let normals = || self.subproblem.active_normals(x, &self.scale, &gradient());
        self.convex = self.second_order.model(linearisation, &self.scale, normals);
        let model = self.convex.as_ref().map_or(linearisation, |convex| &convex.linearisation);
        self.subproblem.prepare(x, model, &self.scale, &self.settings);
    }

    /// Returns the step from x, and its ratio of acceleration to length if it is accelerated. Sets
    /// `radius` to the radius of that step.
    fn step<O: Objective>(
        &mut self,
        problem: &mut Problem<O>,
        x: &DVector<f64>,
        radius: &mut f64,
    ) -> Result<(Step, Option<f64>), Error> {
        let mut tries = if self.second_order.accelerates() { MAX_ACCELERATION_TRIES } else { 0 };
        loop {
            let mut step = self.subproblem.step(x, *radius);
            if let Some(convex) = &self.convex {
                step.predicted +=
                    convex.underestimated_reduction(&(&step.point - x).component_mul(&self.scale));
            }
            if tries == 0 || step.length == 0.0 {
                return Ok((step, None));
            }
            let unaccelerated = &step.point - x;
            let acceleration = problem.problem("acceleration_count", |o| {
                Ok(o.acceleration_gradient(x, &unaccelerated))
            })?;
            let Some(point) = acceleration.and_then(|acceleration| {
                self.subproblem.accelerated(x, &acceleration, step.damping)
            }) else {
                return Ok((step, None));
            };
            let ratio = (&point - &step.point).component_mul(&self.scale).norm() / step.length;
            if ratio.is_nan() {
                return Ok((step, None));
            }
            if ratio <= MAX_ACCELERATION_RATIO {
                self.second_order.record_acceleration(ratio, step.damping);
                step.point = point;
                return Ok((step, Some(ratio)));
            }
            *radius = step.length * (MAX_ACCELERATION_RATIO / ratio).clamp(0.1, 0.5);
            tries -= 1;
        }
    }

    /// Sets D to the inverse plausible sizes of the unknowns. For an unknown without a plausible
    /// size, D is the inverse of the change that would remove the whole residual.
    ///
    /// Returns false, with D unchanged, if no size is known.
    fn rescale_by_sizes<O: Objective>(
        &mut self,
        problem: &mut Problem<O>,
        x: &DVector<f64>,
    ) -> Result<bool, Error> {
        let sizes = problem.problem("size_count", |o| Ok(o.plausible_sizes()))?;
        let Some(Linearisation { cost, triangle, .. }) = &self.linearisation else {
            return Ok(false);
        };
        if sizes.iter().all(Option::is_none) {
            return Ok(false);
        }
        let residual = (2.0 * cost).sqrt();
        let lengths = sizes.iter().zip(triangle.column_iter());
        let lengths =
            lengths.map(|(size, column)| size.map_or(column.norm() / residual, f64::recip));
        let lengths = lengths.map(|length| if length.is_normal() { length } else { 1.0 });
        self.scale = DVector::from_iterator(x.len(), lengths);
        self.is_scale_fixed = true;
        self.prepare(x);
        Ok(true)
    }

    /// Applies the convergence tests of MINPACK to a step; `size` is ‖D x‖ and reductions are
    /// relative.
    fn test_convergence(&self, trial: &Trial, size: f64) -> Option<Termination> {
        let settings = &self.settings;
        if trial.damping > 0.0 && trial.ratio >= MIN_GROWTH_RATIO {
            // The radius alone limits this step and will grow, so the length of the step does not
            // indicate convergence.
            return None;
        }
        let is_predicted = 0.5 * trial.ratio <= 1.0 || trial.actual.abs() <= MAX_COST_ROUNDING;
        let is_settled = |tolerance: f64| {
            trial.actual.abs() <= tolerance && trial.predicted <= tolerance && is_predicted
        };
        if is_settled(settings.cost_tolerance) {
            return Some(Termination::Cost);
        }
        if trial.length <= settings.step_tolerance * size {
            return Some(if trial.cost.is_finite() {
                Termination::Step
            } else {
                Termination::DomainEdge
            });
        }
        if is_settled(f64::EPSILON) {
            return Some(Termination::CostPrecision);
        }
        if self.radius.is_some_and(|radius| radius <= f64::EPSILON * size) {
            return Some(if trial.cost.is_finite() {
                Termination::StepPrecision
            } else {
                Termination::DomainEdge
            });
        }
        None
    }
}

impl<S: Subproblem> ReportsTermination for TrustRegion<S> {
    fn termination(&self) -> Option<Termination> {
        self.termination
    }
}

/// Returns the state at x after an iteration, marked as terminated if there is a `termination`.
pub(super) fn state_after_iteration(
    state: State,
    x: DVector<f64>,
    cost: f64,
    termination: Option<Termination>,
) -> State {
    let state = state.param(x).cost(cost);
    match termination {
        None => state,
        Some(termination) if termination.converged() => {
            state.terminate_with(TerminationReason::SolverConverged)
        }
        Some(termination) => {
            state.terminate_with(TerminationReason::SolverExit(termination.to_string()))
        }
    }
}

/// Takes x out of argmin's state.
pub(super) fn take_point(state: &mut State) -> Result<DVector<f64>, Error> {
    let text = "a solver needs a start".to_owned();
    state.take_param().ok_or_else(|| ArgminError::NotInitialized { text }.into())
}

impl<O: Objective, S: Subproblem> Solver<O, State> for TrustRegion<S> {
    fn name(&self) -> &str {
        self.subproblem.name()
    }

    fn init(
        &mut self,
        problem: &mut Problem<O>,
        mut state: State,
    ) -> Result<(State, Option<KV>), Error> {
        let mut x = take_point(&mut state)?;
        let parameters = problem.problem.as_ref().map(Objective::parameters);
        if parameters != Some(x.len()) || !self.subproblem.admit_start(&mut x) {
            self.termination = Some(Termination::SizeMismatch);
            return Ok((state_after_iteration(state, x, f64::INFINITY, self.termination), None));
        }
        let linearisation = problem.problem("linearise_count", |o| Ok(o.linearise(&x)))?;
        let cost = linearisation.cost;
        self.termination = if cost.is_finite() {
            self.accept_linearisation(&x, linearisation)
        } else {
            Some(Termination::OutsideDomainAtStart)
        };
        if self.termination.is_none() {
            self.prepare(&x);
        }
        Ok((state_after_iteration(state, x, cost, self.termination), None))
    }

    fn next_iter(
        &mut self,
        problem: &mut Problem<O>,
        mut state: State,
    ) -> Result<(State, Option<KV>), Error> {
        let x = take_point(&mut state)?;
        let cost = state.get_cost();
        let first = state.get_iter() == 0;
        let mut radius = self.radius.unwrap_or(self.settings.initial_radius);
        let (mut step, mut acceleration) = self.step(problem, &x, &mut radius)?;
        if self.subproblem.is_step_constrained()
            && !self.is_scale_fixed
            && self.rescale_by_sizes(problem, &x)?
        {
            radius = self.scale.component_mul(&(&step.point - &x)).norm();
            (step, acceleration) = self.step(problem, &x, &mut radius)?;
        }
        if first {
            radius = radius.min(step.length);
        }
        let after = problem.problem("cost_count", |o| Ok(o.cost(&step.point)))?;
        let after = if after.is_nan() { f64::INFINITY } else { after };
        let trial = Trial::new((&step, acceleration), cost, after);
        self.radius = Some(trial.next_radius(radius));
        let is_accepted = trial.ratio >= MIN_ACCEPTED_RATIO;
        let size = self.scale.component_mul(if is_accepted { &step.point } else { &x }).norm();
        let log = kv!("ratio" => trial.ratio; "radius" => radius; "length" => trial.length;);
        let mut termination = self.test_convergence(&trial, size);
        let retired = termination.is_some_and(Termination::converged)
            && self.second_order.stop_second_derivatives();
        if retired {
            termination = None;
        }
        if is_accepted && termination.is_none() {
            let linearisation =
                problem.problem("linearise_count", |o| Ok(o.linearise(&step.point)))?;
            termination = self.accept_linearisation(&step.point, linearisation);
        }
        let (x, cost) = if is_accepted { (step.point, trial.cost) } else { (x, cost) };
        if termination.is_none() {
            let ratio = trial.significant_ratio(self.settings.cost_tolerance);
            self.second_order.resume_acceleration_if_missed(ratio);
            if self.subproblem.accelerates_unconstrained() {
                self.second_order.count_miss(ratio);
            }
            let worth = trial.predicted / self.settings.cost_tolerance;
            let remaining = state.get_max_iters().saturating_sub(state.get_iter());
            let forms = self.subproblem.is_step_constrained()
                && self.second_order.should_form_second_derivatives(
                    (ratio, is_accepted),
                    (trial.length, trial.damping),
                    (worth, remaining),
                    x.len(),
                );
            if forms {
                let is_feasible = |x: &DVector<f64>| self.subproblem.is_feasible(x);
                let matrix =
                    problem.problem("curvature_count", |o| Ok(o.curvature(&x, &is_feasible)))?;
                self.second_order.set_matrix(matrix);
            }
            if is_accepted || forms || retired {
                self.prepare(&x);
            }
        }
        self.termination = termination;
        Ok((state_after_iteration(state, x, cost, termination), Some(log)))
    }
}

#[cfg(test)]
mod tests {
    use super::super::levenberg_marquardt::Unconstrained;
    use super::*;

    #[test]
    fn small_reductions_and_steps_are_convergence() {
        let settings =
            Settings { cost_tolerance: 1e-8, step_tolerance: 1e-6, ..Settings::default() };
        let solver = TrustRegion::new(Unconstrained::default(), settings);
        let trial = |actual: f64, predicted: f64, length: f64, damping: f64| {
            let step = Step { length, predicted, damping, ..Step::none(&DVector::zeros(1)) };
            let trial = Trial::new((&step, None), 1.0, 1.0 - actual);
            solver.test_convergence(&trial, 10.0)
        };
        assert_eq!(trial(1e-3, 1e-3, 1.0, 0.0), None);
        assert_eq!(trial(1e-9, 1e-9, 1.0, 0.0), Some(Termination::Cost));
        // A reduction up to twice the prediction agrees with it.
        assert_eq!(trial(1.5e-9, 1e-9, 1.0, 0.0), Some(Termination::Cost));
        assert_eq!(trial(3e-9, 1e-9, 1.0, 0.0), None);
        assert_eq!(trial(1e-3, 1e-3, 9e-6, 0.0), Some(Termination::Step));
        assert_eq!(trial(f64::NEG_INFINITY, 1e-3, 9e-6, 0.0), Some(Termination::DomainEdge));
        // The radius limits the step and will grow.
        assert_eq!(trial(1e-9, 1e-9, 9e-6, 1.0), None);
    }

    #[test]
    fn the_first_radius_is_a_multiple_of_the_start_or_the_residual() {
        let accept = |unit: f64, x: f64| {
            let mut solver = TrustRegion::new(Unconstrained::default(), Settings::default());
            let linearisation = Linearisation {
                cost: 0.5 * 25.0 * unit * unit,
                triangle: DMatrix::from_element(1, 1, 2.0 * unit),
                projected: DVector::from_element(1, 3.0 * unit),
            };
            assert!(
                solver.accept_linearisation(&DVector::from_element(1, x), linearisation).is_none()
            );
            solver.radius.unwrap()
        };
        // ‖r‖ = 5, ‖D x‖ = 2 |x|, in any unit of the residuals.
        for unit in [1.0, 1e3, 1e-6] {
            assert!((accept(unit, 1.5) / unit - 300.0).abs() < 1e-9);
            assert!((accept(unit, 1e-4) / unit - 5.0).abs() < 1e-12);
        }
        assert!((accept(1.0, 0.0) - 100.0).abs() < 1e-12);
    }
}
