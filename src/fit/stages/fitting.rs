//! The fits of an identification: bases and targets first, then the strategy's stages, then
//! held-out sessions.

use std::sync::Arc;

use nalgebra::DVector;

use crate::fit::errors::of_kind;
use crate::fit::stages::alternation::{Alternation, Anderson, contraction};
use crate::fit::stages::fixture_location::locate;
use crate::fit::stages::noise_model::NoiseModel;
use crate::fit::stages::placement::HeldOutOnly;
use crate::fit::stages::registration::register;
use crate::fit::stages::stage::{COST_TOLERANCE, Gauge, Stage, StageEnd, StageError};
use crate::fit::{
    ErrorSummary, Errors, OrientationErrors, Placement, ProgressSink, SolverChoice, Stop, Strategy,
};
use crate::least_squares::solver::{AtBound, Settings, Termination};
use crate::least_squares::{Loss, Memory};
use crate::measurement::{Measurements, Split};
use crate::model::parameter::Parameter;
use crate::model::{LinearModel, Model, Pose};
use crate::problem::Observation;

/// Sweeps after which a sequential strategy is given up.
const MAX_SWEEPS: usize = 500;
/// A sequential strategy has settled when a sweep lowers the cost by less than this part.
const SWEEP_SETTLED: f64 = 1e-7;
/// Steps of each stage in a sweep that is repeated: exact answers to a question that the next stage
/// changes are wasted.
const SWEEP_STEPS: u64 = 2;

/// Change of ν ln(squares), by which effects are judged, that a step of a fit in passing must be
/// worth: thousandths of what decides.
const PASSING: f64 = 0.01;
/// Part of the cost that a step must be worth where the σ is judged next, which then is known to
/// half that part.
const JUDGED: f64 = 1e-3;

/// What all fits of an identification share.
pub(in crate::fit) struct Fitting<'a> {
    pub model: &'a Model,
    pub measurements: &'a Measurements,
    pub split: &'a Split,
    pub placement: &'a Placement,
    /// Bases and targets that only held-out rows use.
    pub held_out_only: HeldOutOnly,
    pub strategy: Strategy,
    pub solver: SolverChoice,
    /// How the residual of a pose counts in the strategy's fits.
    pub loss: Loss,
    pub progress: Option<&'a ProgressSink>,
    pub stop: Option<&'a Stop>,
    /// Steps after which a stage of the strategy is stopped.
    pub max_steps: Option<u64>,
    /// Whether another fit follows.
    pub provisional: bool,
    /// Whether the σ is judged before the fit goes on.
    pub to_be_judged: bool,
    /// 1 σ of a coordinate in rows without one of their own, declared or assumed \[m\].
    pub sigma: f64,
    /// 1 σ of an orientation about each axis, where orientations are fitted \[rad\].
    pub turn_sigma: Option<f64>,
    /// What the fit makes of each row's σ.
    pub noise_model: NoiseModel,
    /// What it makes of the σ of orientations.
    pub turn_noise_model: NoiseModel,
    /// Linearisations that its fits share.
    pub memory: &'a Memory,
    /// Derivatives that are known where it may begin.
    pub known: Option<&'a LinearModel>,
}

/// Where a fit ended.
pub(in crate::fit) struct FitEnd {
    /// Full parameter vector.
    pub x: DVector<f64>,
    pub termination: Termination,
    pub iterations: u64,
    pub evaluations: u64,
    /// For each unknown of the fit.
    pub at_bound: Vec<Option<AtBound>>,
    pub gauge: Gauge,
    /// How several stages took turns.
    pub alternation: Option<Alternation>,
}

impl FitEnd {
    /// Of a fit of so many unknowns that has not begun.
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
    /// Parameters of a kind, those of bases and targets of held-out rows alone left out.
    fn choose(&self, choose: impl Fn(&Parameter) -> bool) -> Vec<usize> {
        let all = self.model.parameters.iter().enumerate();
        all.filter(|&(k, parameter)| !self.held_out_only.parameters[k] && choose(parameter))
            .map(|(k, _)| k)
            .collect()
    }

    /// Some rows as poses, with the σ that were declared.
    pub fn poses(&self, rows: &[usize]) -> Vec<Pose<'a>> {
        self.placement.oriented_poses(self.measurements, rows, (self.sigma, self.turn_sigma))
    }

    /// Returns the same fits with the declared σ.
    pub fn with_declared_noise(&self) -> Self {
        Self {
            noise_model: NoiseModel::DECLARED,
            turn_noise_model: NoiseModel::DECLARED,
            held_out_only: self.held_out_only.clone(),
            ..*self
        }
    }

    /// A stage on some rows, with the σ that the fit takes.
    pub fn stage(&self, rows: &[usize], unknowns: Vec<usize>) -> Stage<'a> {
        let mut poses = self.poses(rows);
        let declared = poses.iter().map(|pose| pose.sigma).collect();
        for pose in &mut poses {
            // What a drawing or a calibrated bar says is no worse for what the contacts scatter.
            if pose.observation.is_of_arm() {
                pose.sigma = self.noise_model.of(pose.sigma);
            }
            if let Some(orientation) = &mut pose.orientation {
                orientation.sigma = self.turn_noise_model.of(orientation.sigma);
            }
        }
        Stage {
            model: self.model,
            poses: Arc::new(poses),
            declared,
            declared_turn: self.turn_sigma,
            unknowns,
            solver: self.solver,
            max_steps: Settings::default().max_iterations,
            cost_tolerance: COST_TOLERANCE,
            loss: Loss::Squares,
            counts_fixed: false,
            memory: self.memory,
            known: self.known,
            progress: self.progress,
            stop: self.stop,
        }
    }

    /// A stage that fits bases and targets, by the solver that `auto` takes whichever was asked
    /// for.
    fn placing(&self, rows: &[usize], unknowns: Vec<usize>) -> Stage<'a> {
        let mut stage = self.stage(rows, unknowns);
        stage.solver = SolverChoice::Auto.decide(self.model);
        stage
    }

    /// A stage of the strategy: on the identification rows, with the problem's loss.
    fn strategy_stage(&self, unknowns: Vec<usize>) -> Stage<'a> {
        let stage = self.stage(&self.split.identification, unknowns);
        let max_steps = self.max_steps.unwrap_or(stage.max_steps);
        let passing = if self.provisional {
            PASSING / stage.count().max(1) as f64
        } else {
            stage.cost_tolerance
        };
        let cost_tolerance = if self.to_be_judged { passing.max(JUDGED) } else { passing };
        Stage { loss: self.loss, max_steps, cost_tolerance, ..stage }
    }

    /// Everything that the strategy varies, as one stage on the identification rows.
    pub fn whole(&self) -> Stage<'a> {
        let varied =
            |parameter: &Parameter| self.strategy.stages().iter().any(|chosen| chosen(parameter));
        self.strategy_stage(self.choose(varied))
    }

    /// Bases and targets of held-out sessions, as one stage on their rows.
    pub fn held_out_stage(&self) -> Option<Stage<'a>> {
        let HeldOutOnly { parameters, rows } = &self.held_out_only;
        let unknowns: Vec<usize> = (0..parameters.len()).filter(|&k| parameters[k]).collect();
        (!unknowns.is_empty()).then(|| Stage { counts_fixed: true, ..self.placing(rows, unknowns) })
    }

    /// First row whose pose has no equilibrium on the nominal arm.
    pub fn without_equilibrium(&self) -> Option<usize> {
        let rows: Vec<usize> = (0..self.measurements.len()).collect();
        let errors = self.position_errors(&rows, &DVector::zeros(self.model.parameters.len()));
        errors.iter().position(|error| error.x.is_nan())
    }

    /// The nominal arm with bases and targets fitted where they are free.
    pub fn registered(&self) -> Result<DVector<f64>, StageError> {
        let mut x = DVector::zeros(self.model.parameters.len());
        let mut poses = self.poses(&self.split.identification);
        let mut known = vec![false; self.placement.bases.len()];
        for pose in &poses {
            known[pose.base] = true;
        }
        let held_out = self.poses(&self.held_out_only.rows);
        poses.extend(held_out.into_iter().filter(|pose| !known[pose.base]));
        register(self.model, &poses, &mut x);
        let later = &self.held_out_only;
        locate(
            self.model,
            &self.poses(&self.split.identification),
            |k| !later.parameters[k],
            &mut x,
        );
        locate(self.model, &self.poses(&later.rows), |k| later.parameters[k], &mut x);
        let placements = self.choose(|parameter| parameter.site.is_placement());
        if !placements.is_empty() {
            x = self.placing(&self.split.identification, placements).run(&x)?.x;
        }
        match self.held_out_stage() {
            Some(stage) => Ok(stage.run(&x)?.x),
            None => Ok(x),
        }
    }

    /// Runs the strategy's stages from `start`; several are repeated until the cost settles.
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
            return Self::gauged(&whole, end);
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
        Self::gauged(&whole, end)
    }

    /// Sweeps over the strategy's stages, accelerated, until the cost settles.
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
        // Short stages may all be turned back where a long one gets on: only a sweep of long ones
        // can end it.
        let mut long = false;
        for sweep in 1..=MAX_SWEEPS {
            let begin = whole.reduced(&end.x);
            let termination = self.sweep(whole, &mut end, (!long).then_some(SWEEP_STEPS))?;
            end.alternation = Some(Alternation { sweeps: sweep, contraction: None });
            let next = whole.cost(&end.x);
            let settled = cost - next <= SWEEP_SETTLED * next;
            if !next.is_finite() || (settled && long) {
                end.termination = termination;
                break;
            }
            long = settled;
            cost = next;
            if let Some(tried) = anderson.next(&begin, &whole.reduced(&end.x), &scale) {
                let tried = whole.full(&end.x, &tried);
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

    /// One sweep over the strategy's stages, each of so many steps at most; why it ended.
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

    /// With the combinations that nothing decides.
    fn gauged(whole: &Stage, mut end: FitEnd) -> Result<FitEnd, StageError> {
        let held: Vec<bool> = end.at_bound.iter().map(Option::is_some).collect();
        end.gauge = whole.gauge(&end.x, &held, &whole.held(&end.x)?);
        Ok(end)
    }

    /// Errors on both parts of the data with the full parameter vector `x`, of the kind of rows
    /// that errors are told of.
    pub fn errors(&self, x: &DVector<f64>) -> Errors {
        self.errors_of(self.measurements.leading(), x)
    }

    fn errors_of(&self, kind: Observation, x: &DVector<f64>) -> Errors {
        let of = |rows: &[usize]| {
            of_kind(self.measurements, rows.iter().copied(), &self.position_errors(rows, x), kind)
        };
        Errors {
            identification: of(&self.split.identification),
            held_out: of(&self.split.held_out),
        }
    }

    /// Errors of every kind of rows at the full parameter vectors of the registered nominal arm and
    /// of the fitted one, where there are several kinds.
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

    /// Errors of orientation on both parts of the data at the full parameter vectors of the
    /// registered nominal arm and of the fitted one; `None` where orientation is not fitted.
    pub fn orientation(
        &self,
        registered: &DVector<f64>,
        fitted: &DVector<f64>,
    ) -> Option<OrientationErrors> {
        let sigma_taken = self.turn_noise_model.of(self.turn_sigma?);
        let errors = |x: &DVector<f64>| {
            let of = |rows: &[usize]| {
                ErrorSummary::of(&self.model.orientation_residuals(self.poses(rows), x))
            };
            Errors {
                identification: of(&self.split.identification),
                held_out: of(&self.split.held_out),
            }
        };
        Some(OrientationErrors {
            registered: errors(registered),
            fitted: errors(fitted),
            sigma_taken,
        })
    }

    /// Residuals measured − predicted of some rows, measuring frame \[m\].
    pub fn position_errors(&self, rows: &[usize], x: &DVector<f64>) -> Vec<nalgebra::Vector3<f64>> {
        self.placement.position_errors(self.model, x, self.measurements, rows)
    }
}
