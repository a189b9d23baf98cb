//! The outer loop that every solver here shares: try a step, compare with the prediction, move or
//! shrink.

use argmin::core::{
    ArgminError, Error, IterState, KV, Problem, Solver, State as _, TerminationReason,
};
use argmin::kv;
use nalgebra::{DMatrix, DVector};

use super::second_order::{Convex, SecondOrder};
use super::{Settings, Termination};
use crate::least_squares::{Linearisation, Objective};

/// The part of argmin's state in use: x and ½‖r‖².
pub type State = IterState<DVector<f64>, (), (), (), (), f64>;

/// A step is taken when ρ reaches this.
const ACCEPT: f64 = 1e-4;
/// A step may be bent by this part of its length, and is made longer towards the other; shorter
/// ones are tried so often.
const BENT: f64 = 0.75;
const WELL_BENT: f64 = 0.03;
const BENDINGS: usize = 6;
/// The radius grows when ρ reaches this.
const GOOD: f64 = 0.75;
/// A relative gain up to this is rounding of the cost.
const ROUNDING: f64 = 1e3 * f64::EPSILON;

/// A step within the radius, as the linearised problem sees it.
#[derive(Debug, Clone)]
pub struct Step {
    /// x + p.
    pub point: DVector<f64>,
    /// ‖D p‖.
    pub length: f64,
    /// −gᵀp, the reduction of ½‖r‖² to first order.
    pub slope: f64,
    /// ½‖r‖² − ½‖J p + r‖².
    pub predicted: f64,
    /// λ, zero when the radius did not matter.
    pub damping: f64,
}

impl Step {
    /// No step at all, which stops the solver.
    pub(super) fn none(x: &DVector<f64>) -> Self {
        Self { point: x.clone(), length: 0.0, slope: 0.0, predicted: 0.0, damping: 0.0 }
    }
}

/// How a solver chooses its step from a linearisation.
pub trait Subproblem {
    /// Name of the solver.
    fn name(&self) -> &'static str;

    /// Moves a start to where the problem may be evaluated; false when sizes differ.
    fn admit(&self, start: &mut DVector<f64>) -> bool;

    /// Takes in the linearised problem at x; D is `scale`.
    fn prepare(
        &mut self,
        x: &DVector<f64>,
        linearisation: &Linearisation,
        scale: &DVector<f64>,
        settings: &Settings,
    );

    /// Component j of the gradient g, or zero where a constraint holds x back.
    fn free_gradient(&self, x: &DVector<f64>, j: usize, gradient: f64) -> f64;

    /// Takes out of a gradient whose columns are divided by `scale` what constraints at x hold
    /// back.
    fn hold_back(&self, x: &DVector<f64>, scale: &DVector<f64>, gradient: &mut DVector<f64>) {
        let _ = scale;
        (0..x.len()).for_each(|j| gradient[j] = self.free_gradient(x, j, gradient[j]));
    }

    /// Whether the problem may be evaluated at x.
    fn admits(&self, x: &DVector<f64>) -> bool {
        let _ = x;
        true
    }

    /// Whether constraints changed the last step; only then second derivatives may be called for.
    fn is_confined(&self) -> bool {
        false
    }

    /// Whether steps may be bent although no constraint changes them.
    fn bends_freely(&self) -> bool {
        false
    }

    /// Normals, one a row and of length one in unknowns scaled by `scale`, of the constraints at x
    /// that a step against the scaled gradient would leave.
    fn pressed(
        &self,
        x: &DVector<f64>,
        scale: &DVector<f64>,
        gradient: &DVector<f64>,
    ) -> DMatrix<f64> {
        let _ = (scale, gradient);
        DMatrix::zeros(0, x.len())
    }

    /// The point that a step leads to whose model has a gradient larger by ½ `bend`, for the same
    /// damping.
    fn bent(
        &mut self,
        x: &DVector<f64>,
        bend: &DVector<f64>,
        damping: f64,
    ) -> Option<DVector<f64>> {
        let _ = (x, bend, damping);
        None
    }

    /// The best step with ‖D p‖ ≤ `radius` to within 10 %.
    fn step(&mut self, x: &DVector<f64>, radius: f64) -> Step;
}

/// Trust-region least squares after Moré, over any choice of step.
///
/// Dⱼ is the largest ‖Jⱼ‖ seen so far, so the path does not depend on the units of the unknowns.
/// Radius and gain ratio follow MINPACK's `lmder` [Moré 1978]. From the first step that limits hold
/// back, Dⱼ is 1 over how far unknown j may plausibly go, where that is known: residuals that
/// limits keep large go with combinations of which they say little, and ‖Jⱼ‖ would let these run
/// where linearised residuals are not valid.
#[derive(Debug, Clone)]
pub struct TrustRegion<S> {
    subproblem: S,
    settings: Settings,
    scale: DVector<f64>,
    radius: Option<f64>,
    /// Whether D has been taken from what unknowns may plausibly do.
    measured: bool,
    second_order: SecondOrder,
    /// The linearised problem at x, and the model with second derivatives that steps come from
    /// instead.
    linearisation: Option<Linearisation>,
    convex: Option<Convex>,
    termination: Option<Termination>,
}

impl<S: Subproblem> TrustRegion<S> {
    /// The loop around `subproblem`.
    pub fn new(subproblem: S, settings: Settings) -> Self {
        Self {
            subproblem,
            settings,
            scale: DVector::zeros(0),
            radius: None,
            measured: false,
            second_order: SecondOrder::default(),
            linearisation: None,
            convex: None,
            termination: None,
        }
    }

    /// Why it stopped, once it has.
    pub fn termination(&self) -> Option<Termination> {
        self.termination
    }

    /// The choice of step.
    pub fn subproblem(&self) -> &S {
        &self.subproblem
    }

    fn stop(&mut self, state: State, termination: Termination) -> State {
        self.termination = Some(termination);
        stopped(state, termination)
    }

    /// Scales, judges the gradient, and hands the linearisation on; the reason to stop, if there is
    /// one.
    fn take_in(&mut self, x: &DVector<f64>, linearisation: Linearisation) -> Option<Termination> {
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
        } else if !self.measured {
            self.scale = self.scale.sup(&norms);
        }
        let residual = (2.0 * cost).sqrt();
        let mut gradient =
            DVector::from_fn(x.len(), |j, _| triangle.column(j).dot(projected) / lengths[j]);
        self.subproblem.hold_back(x, &lengths, &mut gradient);
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

    /// Hands the subproblem the model that steps come from.
    fn prepare(&mut self, x: &DVector<f64>) {
        let Some(linearisation) = &self.linearisation else { return };
        let gradient =
            || linearisation.triangle.tr_mul(&linearisation.projected).component_div(&self.scale);
        let pressed = || self.subproblem.pressed(x, &self.scale, &gradient());
        self.convex = self.second_order.model(linearisation, &self.scale, pressed);
        let model = self.convex.as_ref().map_or(linearisation, |convex| &convex.linearisation);
        self.subproblem.prepare(x, model, &self.scale, &self.settings);
    }

    /// The step from x, bent where that is called for, and by which part of its length; the radius
    /// becomes that which it took.
    fn step<O: Objective>(
        &mut self,
        problem: &mut Problem<O>,
        x: &DVector<f64>,
        radius: &mut f64,
    ) -> Result<(Step, Option<f64>), Error> {
        let mut bendings = if self.second_order.bends() { BENDINGS } else { 0 };
        loop {
            let mut step = self.subproblem.step(x, *radius);
            if let Some(convex) = &self.convex {
                step.predicted += convex.excess(&(&step.point - x).component_mul(&self.scale));
            }
            if bendings == 0 || step.length == 0.0 {
                return Ok((step, None));
            }
            let straight = &step.point - x;
            let bend = problem.problem("bend_count", |o| Ok(o.bend(x, &straight)))?;
            let Some(point) = bend.and_then(|bend| self.subproblem.bent(x, &bend, step.damping))
            else {
                return Ok((step, None));
            };
            let share = (&point - &step.point).component_mul(&self.scale).norm() / step.length;
            if share.is_nan() {
                return Ok((step, None));
            }
            if share <= BENT {
                self.second_order.bent(share, step.damping);
                step.point = point;
                return Ok((step, Some(share)));
            }
            *radius = step.length * (BENT / share).clamp(0.1, 0.5);
            bendings -= 1;
        }
    }

    /// Takes D from how far each unknown may plausibly go; one of which that is not known, from
    /// what takes away all of the residual.
    ///
    /// False where nothing is known and D stays as it is.
    fn measure<O: Objective>(
        &mut self,
        problem: &mut Problem<O>,
        x: &DVector<f64>,
    ) -> Result<bool, Error> {
        let reach = problem.problem("reach_count", |o| Ok(o.reach()))?;
        let Some(Linearisation { cost, triangle, .. }) = &self.linearisation else {
            return Ok(false);
        };
        if reach.iter().all(Option::is_none) {
            return Ok(false);
        }
        let residual = (2.0 * cost).sqrt();
        let lengths = reach.iter().zip(triangle.column_iter());
        let lengths =
            lengths.map(|(reach, column)| reach.map_or(column.norm() / residual, f64::recip));
        let lengths = lengths.map(|length| if length.is_normal() { length } else { 1.0 });
        self.scale = DVector::from_iterator(x.len(), lengths);
        self.measured = true;
        self.prepare(x);
        Ok(true)
    }

    /// The tests of MINPACK after a step, with relative reductions.
    fn judge(&self, trial: &Trial, size: f64) -> Option<Termination> {
        let settings = &self.settings;
        if trial.damping > 0.0 && trial.ratio >= GOOD {
            // Held back by the radius only, which is about to grow: a short step says nothing yet.
            return None;
        }
        let foreseen = 0.5 * trial.ratio <= 1.0 || trial.actual.abs() <= ROUNDING;
        let settled = |tolerance: f64| {
            trial.actual.abs() <= tolerance && trial.predicted <= tolerance && foreseen
        };
        if settled(settings.cost_tolerance) {
            return Some(Termination::Cost);
        }
        if trial.length <= settings.step_tolerance * size {
            return Some(if trial.cost.is_finite() {
                Termination::Step
            } else {
                Termination::DomainEdge
            });
        }
        if settled(f64::EPSILON) {
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

/// A step tried: reductions relative to the cost before it.
struct Trial {
    cost: f64,
    actual: f64,
    predicted: f64,
    slope: f64,
    ratio: f64,
    length: f64,
    damping: f64,
    /// By how much the radius grows after it.
    growth: f64,
}

impl Trial {
    fn new((step, share): (&Step, Option<f64>), before: f64, after: f64) -> Self {
        // A cost a hundred times the old one carries no information on curvature.
        let actual = if after < 100.0 * before { 1.0 - after / before } else { -1.0 };
        let predicted = step.predicted / before;
        let ratio = if predicted > 0.0 { actual / predicted } else { 0.0 };
        Self {
            cost: after,
            actual,
            predicted,
            slope: step.slope / before,
            ratio,
            length: step.length,
            damping: step.damping,
            growth: share.map_or(2.0, |share| (WELL_BENT / share).clamp(1.5, 8.0)),
        }
    }

    /// ρ as far as it speaks of the model: a difference that would not be worth a step is rounding
    /// of the cost.
    fn forecast(&self, tolerance: f64) -> f64 {
        if (self.actual - self.predicted).abs() <= tolerance { 1.0 } else { self.ratio }
    }

    fn next_radius(&self, radius: f64) -> f64 {
        if self.ratio <= 0.25 {
            // The minimum of the parabola through the two costs and the slope, between a tenth and
            // a half.
            let shrink = if self.actual >= 0.0 {
                0.5
            } else {
                0.5 * self.slope / (self.slope - self.actual)
            };
            let shrink =
                if self.actual <= -1.0 || shrink.is_nan() { 0.1 } else { shrink.clamp(0.1, 0.5) };
            shrink * radius.min(10.0 * self.length)
        } else if self.ratio >= GOOD || self.damping == 0.0 {
            self.growth * self.length
        } else {
            radius
        }
    }
}

/// The state of a solver that stops for a reason of its own.
pub(super) fn stopped(state: State, termination: Termination) -> State {
    state.terminate_with(if termination.converged() {
        TerminationReason::SolverConverged
    } else {
        TerminationReason::SolverExit(termination.to_string())
    })
}

/// x out of argmin's state.
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
        if parameters != Some(x.len()) || !self.subproblem.admit(&mut x) {
            return Ok((
                self.stop(state.param(x).cost(f64::INFINITY), Termination::SizeMismatch),
                None,
            ));
        }
        let linearisation = problem.problem("linearise_count", |o| Ok(o.linearise(&x)))?;
        let cost = linearisation.cost;
        let termination = if cost.is_finite() {
            self.take_in(&x, linearisation)
        } else {
            Some(Termination::OutsideDomainAtStart)
        };
        if termination.is_none() {
            self.prepare(&x);
        }
        let state = state.param(x).cost(cost);
        Ok((termination.into_iter().fold(state, |state, t| self.stop(state, t)), None))
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
        let (mut step, mut share) = self.step(problem, &x, &mut radius)?;
        if self.subproblem.is_confined() && !self.measured && self.measure(problem, &x)? {
            radius = self.scale.component_mul(&(&step.point - &x)).norm();
            (step, share) = self.step(problem, &x, &mut radius)?;
        }
        if first {
            radius = radius.min(step.length);
        }
        let after = problem.problem("cost_count", |o| Ok(o.cost(&step.point)))?;
        let trial =
            Trial::new((&step, share), cost, if after.is_nan() { f64::INFINITY } else { after });
        self.radius = Some(trial.next_radius(radius));
        let taken = trial.ratio >= ACCEPT;
        let size = self.scale.component_mul(if taken { &step.point } else { &x }).norm();
        let log = kv!("ratio" => trial.ratio; "radius" => radius; "length" => trial.length;);
        let mut termination = self.judge(&trial, size);
        let retired = termination.is_some_and(Termination::converged) && self.second_order.retire();
        if retired {
            termination = None;
        }
        if taken && termination.is_none() {
            let linearisation =
                problem.problem("linearise_count", |o| Ok(o.linearise(&step.point)))?;
            termination = self.take_in(&step.point, linearisation);
        }
        let (x, cost) = if taken { (step.point, trial.cost) } else { (x, cost) };
        if termination.is_none() {
            let forecast = trial.forecast(self.settings.cost_tolerance);
            self.second_order.look(forecast);
            if self.subproblem.bends_freely() {
                self.second_order.watch(forecast);
            }
            let renew = self.subproblem.is_confined()
                && self.second_order.judge(
                    (forecast, taken),
                    (trial.length, trial.damping),
                    (
                        trial.predicted / self.settings.cost_tolerance,
                        state.get_max_iters().saturating_sub(state.get_iter()),
                    ),
                    x.len(),
                );
            if renew {
                let within = |x: &DVector<f64>| self.subproblem.admits(x);
                self.second_order
                    .renew(problem.problem("curvature_count", |o| Ok(o.curvature(&x, &within)))?);
            }
            if taken || renew || retired {
                self.prepare(&x);
            }
        }
        let state = state.param(x).cost(cost);
        Ok((termination.into_iter().fold(state, |state, t| self.stop(state, t)), Some(log)))
    }
}
