//! Fits of an identification: registration of bases and targets, the stages of the strategy, and
//! the set-up that only held-out rows use.

use nalgebra::DVector;

use crate::fit::errors::of_kind;
use crate::fit::stages::alternation::{Alternation, Anderson, contraction};
use crate::fit::stages::custom_solver::CustomSolver;
use crate::fit::stages::earlier_data::EarlierData;
use crate::fit::stages::fixture_location::locate;
use crate::fit::stages::gauge::Gauge;
use crate::fit::stages::noise_model::NoiseModel;
use crate::fit::stages::placement::HeldOutOnly;
use crate::fit::stages::registration::register;
use crate::fit::stages::stage::{COST_TOLERANCE, Stage, StageEnd, StageError};
use crate::fit::{
    ErrorSummary, Errors, OrientationErrors, Placement, ProgressSink, SolverChoice, Stop, Strategy,
};
use crate::least_squares::solver::{AtBound, Termination};
use crate::least_squares::{LinearisationCache, Loss};
use crate::measurement::{Measurements, Split};
use crate::model::parameter::Parameter;
use crate::model::{LinearModel, Model, Pose};
use crate::problem::Observation;
use crate::quantity::Unit;

/// Maximum number of sweeps of a sequential strategy; one sweep runs each of its stages once.
const MAX_SWEEPS: usize = 500;
/// Relative reduction of the cost in one sweep at which a sequential strategy counts as converged.
const SWEEP_TOLERANCE: f64 = 1e-7;
/// Number of parameters of the set-up from which they come first among the unknowns.
const MANY_PLACEMENTS: usize = 128;
/// Maximum number of solver steps of each stage in a repeated sweep. More would be wasted, because
/// the next stage moves the optimum.
const MAX_SWEEP_STEPS: u64 = 2;
/// Maximum number of steps of a registration to images, whose start in closed form is near the
/// optimum unless the table was misread.
const MAX_STEPS_OF_VIEWS: u64 = 60;
/// Largest ratio of the median error of images after a registration to that before it, at which the
/// registration is kept.
const MAX_DRAWN_RATIO: f64 = 1.5;

/// Change of ν ln ‖r‖² (ν measured coordinates) by one step below which a provisional fit has
/// converged. It is a thousandth of the change that decides whether an effect is added.
const PROVISIONAL_TOLERANCE: f64 = 0.01;
/// Relative reduction of the cost by one step below which a fit stops if its declared σ is tested
/// next. The relative error of an estimated σ is then about half of this.
const TESTED_NOISE_TOLERANCE: f64 = 1e-3;

/// Input that all fits of one identification share.
pub(in crate::fit) struct Fitting<'a> {
    pub model: &'a Model,
    pub measurements: &'a Measurements,
    pub split: &'a Split,
    pub placement: &'a Placement,
    /// Bases, targets and fixtures that only held-out rows use.
    pub held_out_only: HeldOutOnly,
    pub strategy: Strategy,
    pub solver: SolverChoice,
    /// Solver of the caller, required by [`SolverChoice::Custom`].
    pub custom_solver: Option<&'a dyn CustomSolver>,
    /// Loss of the residual of a pose in the stages of the strategy.
    pub loss: Loss,
    pub progress: Option<&'a ProgressSink>,
    pub stop: Option<&'a Stop>,
    /// Maximum number of solver steps of a stage of the strategy; `None` for the solver's default.
    pub max_steps: Option<u64>,
    /// True if the fit may stop before it has converged, because its declared σ is tested next.
    pub to_be_judged: bool,
    /// Standard deviation (1 σ) of a coordinate in rows that state none, declared or assumed \[m\].
    pub sigma: f64,
    /// Declared 1 σ of an orientation about each axis \[rad\]; `None` if orientations are not
    /// fitted.
    pub turn_sigma: Option<f64>,
    /// Noise model that converts the declared σ of positions to the one that the fit assumes.
    pub noise_model: NoiseModel,
    /// Noise model that converts the declared σ of orientations to the one that the fit assumes.
    pub turn_noise_model: NoiseModel,
    /// Cache of linearisations, shared by the fits of one problem.
    pub cache: &'a LinearisationCache,
    /// Jacobian at the optimum of an earlier fit, reused if this fit starts there.
    pub linear_model: Option<&'a LinearModel>,
    /// Earlier data that are fitted together with the identification rows; `None` without any.
    pub earlier: Option<&'a EarlierData>,
}

/// Result of a fit by all stages of the strategy.
pub(in crate::fit) struct FitEnd {
    /// Full parameter vector at the end of the fit.
    pub x: DVector<f64>,
    pub termination: Termination,
    pub iterations: u64,
    pub evaluations: u64,
    /// Active bound of each unknown; `None` if it is inside its bounds.
    pub at_bound: Vec<Option<AtBound>>,
    pub gauge: Gauge,
    /// Convergence of alternating stages; `None` if the strategy has one stage or runs them once.
    pub alternation: Option<Alternation>,
}

impl FitEnd {
    /// Creates the result of a fit of `unknowns` unknowns before its first step, at `start`.
    fn at(start: &DVector<f64>, unknowns: usize) -> Self {
        Self {
            x: start.clone(),
            termination: Termination::IterationLimit,
            iterations: 0,
            evaluations: 0,
            at_bound: vec![None; unknowns],
            gauge: Gauge::default(),
            alternation: None,
        }
    }
}

impl From<StageEnd> for FitEnd {
    fn from(end: StageEnd) -> Self {
        let StageEnd { x, solution, gauge } = end;
        let evaluations = solution.evaluations();
        let (termination, iterations) = (solution.termination, solution.iterations);
        Self {
            x,
            termination,
            iterations,
            evaluations,
            at_bound: solution.at_bound,
            gauge,
            alternation: None,
        }
    }
}

impl<'a> Fitting<'a> {
    /// Returns the indices of the parameters for which `choose` returns true, except those of
    /// bases, targets and fixtures that only held-out rows use.
    ///
    /// Many parameters of the set-up come first. Each row involves few of them, and so does then
    /// each row of the triangular factor.
    fn choose(&self, choose: impl Fn(&Parameter) -> bool) -> Vec<usize> {
        let parameters = &self.model.parameters;
        let is_chosen = |&k: &usize| !self.held_out_only.parameters[k] && choose(&parameters[k]);
        let of_arm = |k: &usize| !parameters[*k].site.is_placement();
        let mut chosen: Vec<usize> = (0..parameters.len()).filter(is_chosen).collect();
        if chosen.iter().filter(|k| !of_arm(k)).count() >= MANY_PLACEMENTS {
            chosen.sort_by_key(of_arm);
        }
        chosen
    }

    /// Returns the indices of the parameters of the set-up that the identification rows use: bases,
    /// targets and positions of fixtures.
    pub fn placements(&self) -> Vec<usize> {
        self.choose(|parameter| parameter.site.is_placement())
    }

    /// Returns true if earlier data contain information about the parameter with index `k`.
    pub fn is_covered(&self, k: usize) -> bool {
        self.earlier.is_some_and(|earlier| earlier.covers(&self.model.parameters[k].name))
    }

    /// Returns `rows` as poses with their declared σ, or `sigma` in rows that state none.
    pub fn poses(&self, rows: &[usize]) -> Vec<Pose<'a>> {
        self.placement.oriented_poses(self.measurements, rows, (self.sigma, self.turn_sigma))
    }

    /// Returns the same input with the declared σ instead of the σ of the noise models.
    pub fn with_declared_noise(&self) -> Self {
        Self {
            noise_model: NoiseModel::DECLARED,
            turn_noise_model: NoiseModel::DECLARED,
            held_out_only: self.held_out_only.clone(),
            ..*self
        }
    }

    /// Creates a stage that fits `unknowns` to `rows`, with the σ that the noise models assume.
    pub fn stage(&self, rows: &[usize], unknowns: Vec<usize>) -> Stage<'a> {
        let mut poses = self.poses(rows);
        let declared = poses.iter().map(|pose| pose.sigma).collect();
        for pose in &mut poses {
            // Known distances between fixtures keep their declared σ, however much contacts
            // scatter.
            if pose.observation.is_of_arm() {
                pose.sigma = self.noise_model.assumed_sigma(pose.sigma);
            }
            if let Some(orientation) = &mut pose.orientation {
                orientation.sigma = self.turn_noise_model.assumed_sigma(orientation.sigma);
            }
        }
        Stage {
            declared,
            declared_turn: self.turn_sigma,
            custom_solver: self.custom_solver,
            linear_model: self.linear_model,
            progress: self.progress,
            stop: self.stop,
            ..Stage::new(self.model, poses, unknowns, self.solver, self.cache)
        }
    }

    /// Creates a stage that fits `unknowns` of the set-up to `rows`, always by the solver that
    /// `auto` chooses.
    fn placement_stage(&self, rows: &[usize], unknowns: Vec<usize>) -> Stage<'a> {
        let mut stage = self.stage(rows, unknowns);
        stage.solver = SolverChoice::Auto.decide(self.model);
        stage
    }

    /// Creates a stage of the strategy, which fits `unknowns` to the identification rows with the
    /// loss of the problem.
    fn strategy_stage(&self, unknowns: Vec<usize>) -> Stage<'a> {
        let stage = self.stage(&self.split.identification, unknowns);
        let max_steps = self.max_steps.unwrap_or(stage.max_steps);
        let tolerance = if self.cache.is_provisional() {
            PROVISIONAL_TOLERANCE / stage.count().max(1) as f64
        } else {
            stage.cost_tolerance
        };
        let cost_tolerance =
            if self.to_be_judged { tolerance.max(TESTED_NOISE_TOLERANCE) } else { tolerance };
        let earlier = self.earlier;
        Stage { loss: self.loss, max_steps, cost_tolerance, earlier, ..stage }
    }

    /// Creates the stage that fits all parameters which any stage of the strategy varies to the
    /// identification rows.
    pub fn whole(&self) -> Stage<'a> {
        let varied =
            |parameter: &Parameter| self.strategy.stages().iter().any(|chosen| chosen(parameter));
        self.strategy_stage(self.choose(varied))
    }

    /// Creates the stage that fits the bases, targets and fixtures which only held-out rows use to
    /// those rows; `None` if there are none.
    pub fn held_out_stage(&self) -> Option<Stage<'a>> {
        let HeldOutOnly { parameters, rows } = &self.held_out_only;
        let unknowns: Vec<usize> = (0..parameters.len()).filter(|&k| parameters[k]).collect();
        (!unknowns.is_empty())
            .then(|| Stage { counts_fixed: true, ..self.placement_stage(rows, unknowns) })
    }

    /// Returns the full parameter vector of the nominal arm, with free bases, targets and fixtures
    /// located in closed form.
    pub fn located(&self) -> DVector<f64> {
        let mut x = DVector::zeros(self.model.parameters.len());
        let mut poses = self.poses(&self.split.identification);
        let mut has_rows = vec![false; self.placement.bases.len()];
        for pose in &poses {
            has_rows[pose.base] = true;
        }
        let held_out = self.poses(&self.held_out_only.rows);
        poses.extend(held_out.into_iter().filter(|pose| !has_rows[pose.base]));
        register(self.model, &poses, &mut x);
        let later = &self.held_out_only;
        locate(
            self.model,
            &self.poses(&self.split.identification),
            |k| !later.parameters[k],
            &mut x,
        );
        locate(self.model, &self.poses(&later.rows), |k| later.parameters[k], &mut x);
        x
    }

    /// Returns the full parameter vector of the registered nominal arm, with free bases and targets
    /// fitted.
    pub fn registered(&self) -> Result<DVector<f64>, StageError> {
        self.registered_to(COST_TOLERANCE)
    }

    /// Returns what [`Self::registered`] returns, but stops when a step reduces the cost by less
    /// than `cost_tolerance`, relative to the cost.
    pub fn registered_to(&self, cost_tolerance: f64) -> Result<DVector<f64>, StageError> {
        let mut x = self.located();
        let placements = self.placements();
        if !placements.is_empty() {
            let stage = self.placement_stage(&self.split.identification, placements);
            let is_of_views = self.measurements.leading().description().unit == Unit::Pixel;
            let max_steps = if is_of_views { MAX_STEPS_OF_VIEWS } else { stage.max_steps };
            let end = Stage { max_steps, cost_tolerance, ..stage }.run(&x)?.x;
            // A single view from near, whose pixels move far with every error of the nominal arm,
            // may draw camera and marker away from where all other views have them.
            let is_drawn_away =
                is_of_views && self.typical_error(&end) > MAX_DRAWN_RATIO * self.typical_error(&x);
            if !is_drawn_away {
                x = end;
            }
        }
        match self.held_out_stage() {
            Some(stage) => Ok(stage.run(&x)?.x),
            None => Ok(x),
        }
    }

    /// Returns the median length of the errors of the identification rows of the leading kind
    /// (positions, if there are any) at the full parameter vector `x`; infinity if most rows cannot
    /// be predicted.
    pub fn typical_error(&self, x: &DVector<f64>) -> f64 {
        let errors = self.position_errors(&self.leading_rows(), x);
        let length = |norm: f64| if norm.is_nan() { f64::INFINITY } else { norm };
        let mut lengths: Vec<f64> = errors.iter().map(|error| length(error.norm())).collect();
        lengths.sort_by(f64::total_cmp);
        lengths.get(lengths.len() / 2).copied().unwrap_or(f64::INFINITY)
    }

    /// Returns the identification rows of the leading kind (positions, if there are any).
    pub fn leading_rows(&self) -> Vec<usize> {
        let leading = self.measurements.leading().kind();
        let leads = |row: &usize| self.measurements.observation(*row).kind() == leading;
        self.split.identification.iter().copied().filter(leads).collect()
    }

    /// Returns the end of the fit from the registered nominal arm; `None` if it fails.
    pub fn refitted(&self) -> Option<FitEnd> {
        self.run(&self.registered().ok()?).ok()
    }

    /// Runs the stages of the strategy from `start`; several stages are repeated in turn until the
    /// cost converges.
    pub fn run(&self, start: &DVector<f64>) -> Result<FitEnd, StageError> {
        let whole = self.whole();
        let [first, rest @ ..] = self.strategy.stages() else {
            return Ok(whole.run(start)?.into());
        };
        if rest.is_empty() {
            return Ok(self.strategy_stage(self.choose(first)).run(start)?.into());
        }
        if self.strategy == Strategy::OneSweep {
            let mut end = FitEnd::at(start, whole.unknowns.len());
            end.termination = self.sweep(&whole, &mut end, None)?;
            return Self::with_gauge(&whole, end);
        }
        let mut end = self.alternate(&whole, start)?;
        let stages: Vec<Vec<usize>> =
            self.strategy.stages().iter().map(|chosen| self.choose(chosen)).collect();
        let free = |k: &usize| end.at_bound[*k].is_none();
        let places = |stage: &Vec<usize>| {
            let place =
                |k: &usize| whole.unknowns.iter().position(|unknown| unknown == k).filter(free);
            stage.iter().filter_map(place).collect::<Vec<usize>>()
        };
        let stages: Vec<Vec<usize>> = stages.iter().map(places).collect();
        if let Some(alternation) = &mut end.alternation {
            alternation.contraction = contraction(&whole.triangle_with_priors(&end.x), &stages);
        }
        Self::with_gauge(&whole, end)
    }

    /// Repeats accelerated sweeps over the stages of the strategy until the cost converges.
    fn alternate(&self, whole: &Stage, start: &DVector<f64>) -> Result<FitEnd, StageError> {
        let mut end = FitEnd::at(start, whole.unknowns.len());
        let scale = whole
            .triangle_with_priors(start)
            .column_iter()
            .map(|column| column.norm())
            .collect::<Vec<f64>>();
        let scale = DVector::from_vec(scale);
        let mut anderson = Anderson::default();
        let mut cost = f64::INFINITY;
        // Short stages may all fail where a longer one succeeds. The alternation therefore only
        // ends after a sweep of stages without a small limit of steps.
        let mut long = false;
        for sweep in 1..=MAX_SWEEPS {
            let begin = whole.unknowns_in(&end.x);
            let termination = self.sweep(whole, &mut end, (!long).then_some(MAX_SWEEP_STEPS))?;
            end.alternation = Some(Alternation { sweeps: sweep, contraction: None });
            let next = whole.cost(&end.x);
            let settled = cost - next <= SWEEP_TOLERANCE * next;
            if !next.is_finite() || (settled && long) {
                end.termination = termination;
                break;
            }
            long = settled;
            cost = next;
            if let Some(tried) = anderson.next(&begin, &whole.unknowns_in(&end.x), &scale) {
                let tried = whole.full_vector(&end.x, &tried);
                end.evaluations += 1;
                if whole.allows(&tried)? && whole.cost(&tried) < cost {
                    end.x = tried;
                } else {
                    anderson.restart();
                }
            }
        }
        Ok(end)
    }

    /// Runs each stage of the strategy once from the point in `end`, with at most `steps` solver
    /// steps or the default limit, and updates `end`. Returns the termination of the first stage
    /// that did not converge, else that of the last stage.
    fn sweep(
        &self,
        whole: &Stage,
        end: &mut FitEnd,
        steps: Option<u64>,
    ) -> Result<Termination, StageError> {
        let mut termination = Termination::Cost;
        for chosen in self.strategy.stages() {
            let mut stage = self.strategy_stage(self.choose(chosen));
            stage.max_steps = steps.unwrap_or(stage.max_steps);
            let StageEnd { x, solution, .. } = stage.run(&end.x)?;
            end.x = x;
            end.iterations += solution.iterations;
            end.evaluations += solution.evaluations();
            if termination.converged() {
                termination = solution.termination;
            }
            for (k, at_bound) in stage.unknowns.iter().zip(solution.at_bound) {
                if let Some(j) = whole.unknowns.iter().position(|unknown| unknown == k) {
                    end.at_bound[j] = at_bound;
                }
            }
        }
        Ok(termination)
    }

    /// Completes `end` with the combinations of unknowns that data and priors do not determine at
    /// its point.
    fn with_gauge(whole: &Stage, mut end: FitEnd) -> Result<FitEnd, StageError> {
        let held: Vec<bool> = end.at_bound.iter().map(Option::is_some).collect();
        end.gauge = whole.gauge(&end.x, &held, &whole.held(&end.x)?);
        Ok(end)
    }

    /// Returns the errors of identification and held-out rows of the leading kind (positions, if
    /// there are any) at the full parameter vector `x`.
    pub fn errors(&self, x: &DVector<f64>) -> Errors {
        self.errors_of(self.measurements.leading(), x)
    }

    /// Returns the errors of identification and held-out rows of the kind of the observation `kind`
    /// at the full parameter vector `x`.
    fn errors_of(&self, kind: Observation, x: &DVector<f64>) -> Errors {
        let of = |rows: &[usize]| {
            let errors = self.position_errors(rows, x);
            let summary = of_kind(self.measurements, rows.iter().copied(), &errors, kind);
            if kind.description().unit == Unit::Pixel {
                summary.with_lengths(&self.model.lengths_at_points(&self.poses(rows), &errors, x))
            } else {
                summary
            }
        };
        Errors {
            identification: of(&self.split.identification),
            held_out: of(&self.split.held_out),
            is_left_out: false,
        }
    }

    /// Returns the errors of every kind of rows, with the full parameter vectors of the registered
    /// nominal and of the fitted arm. Empty if there is only one kind.
    pub fn errors_by_kind(
        &self,
        registered: &DVector<f64>,
        fitted: &DVector<f64>,
    ) -> Vec<(Errors, Errors)> {
        let kinds = self.measurements.kinds();
        let each = kinds
            .iter()
            .map(|&kind| (self.errors_of(kind, registered), self.errors_of(kind, fitted)));
        if kinds.len() > 1 { each.collect() } else { Vec::new() }
    }

    /// Returns the orientation errors of identification and held-out rows with the full parameter
    /// vectors of the registered nominal and of the fitted arm; `None` if orientation is not
    /// fitted.
    pub fn orientation(
        &self,
        registered: &DVector<f64>,
        fitted: &DVector<f64>,
    ) -> Option<OrientationErrors> {
        let sigma_taken = self.turn_noise_model.assumed_sigma(self.turn_sigma?);
        let errors = |x: &DVector<f64>| {
            let of = |rows: &[usize]| {
                ErrorSummary::of(&self.model.orientation_residuals(self.poses(rows), x))
            };
            Errors {
                identification: of(&self.split.identification),
                held_out: of(&self.split.held_out),
                is_left_out: false,
            }
        };
        Some(OrientationErrors {
            registered: errors(registered),
            fitted: errors(fitted),
            sigma_taken,
        })
    }

    /// Returns the residuals measured − predicted of `rows` at the full parameter vector `x`:
    /// positions in the measuring frame \[m\], other rows in the unit of their kind.
    pub fn position_errors(&self, rows: &[usize], x: &DVector<f64>) -> Vec<nalgebra::Vector3<f64>> {
        self.placement.position_errors(self.model, x, self.measurements, rows)
    }
}
