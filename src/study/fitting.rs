//! The fits of an identification: bases and targets first, then the strategy's stages, then held-out sessions.

use nalgebra::DVector;

use super::placement::Late;
use super::registration::register;
use super::stage::{Gauge, Stage, StageEnd, StageError};
use super::{ErrorSummary, Errors, Placement, ProgressSink, SolverChoice, Strategy};
use crate::fit::Loss;
use crate::measurement::{Measurements, Split};
use crate::model::{Model, PoseResiduals};
use crate::parameter::Parameter;
use crate::solver::{AtBound, Termination};

/// Sweeps after which a sequential strategy is given up.
const MAX_SWEEPS: usize = 500;
/// A sequential strategy has settled when a sweep lowers the cost by less than this part.
const SWEEP_SETTLED: f64 = 1e-9;

/// What all fits of an identification share.
pub(super) struct Fitting<'a> {
    pub model: &'a Model,
    pub measurements: &'a Measurements,
    pub split: &'a Split,
    pub placement: &'a Placement,
    /// Bases and targets that only held-out rows use.
    pub late: Late,
    pub strategy: Strategy,
    pub solver: SolverChoice,
    /// How the residual of a pose counts in the strategy's fits.
    pub loss: Loss,
    pub progress: Option<&'a ProgressSink>,
    /// 1 σ of a coordinate in rows without one of their own [m].
    pub sigma: f64,
}

/// Where a fit ended.
pub(super) struct FitEnd {
    /// Full parameter vector.
    pub x: DVector<f64>,
    pub termination: Termination,
    pub iterations: u64,
    /// For each unknown of the fit.
    pub at_bound: Vec<Option<AtBound>>,
    pub gauge: Gauge,
}

impl From<StageEnd> for FitEnd {
    fn from(end: StageEnd) -> Self {
        let StageEnd { x, solution, gauge } = end;
        let (termination, iterations) = (solution.termination, solution.iterations);
        Self { x, termination, iterations, at_bound: solution.at_bound, gauge }
    }
}

impl<'a> Fitting<'a> {
    /// Parameters of a kind, those of late bases and targets left out.
    fn choose(&self, choose: impl Fn(&Parameter) -> bool) -> Vec<usize> {
        let all = self.model.parameters.iter().enumerate();
        all.filter(|&(k, parameter)| !self.late.parameters[k] && choose(parameter)).map(|(k, _)| k).collect()
    }

    fn stage(&self, rows: &[usize], unknowns: Vec<usize>) -> Stage<'a> {
        Stage {
            model: self.model,
            poses: self.placement.poses(self.measurements, rows, self.sigma),
            unknowns,
            solver: self.solver,
            loss: Loss::Squares,
            progress: self.progress,
        }
    }

    /// A stage of the strategy: on the identification rows, with the problem's loss.
    fn strategy_stage(&self, unknowns: Vec<usize>) -> Stage<'a> {
        Stage { loss: self.loss, ..self.stage(&self.split.identification, unknowns) }
    }

    /// Everything that the strategy varies, as one stage on the identification rows.
    pub fn whole(&self) -> Stage<'a> {
        let varied = |parameter: &Parameter| self.strategy.stages().iter().any(|chosen| chosen(parameter));
        self.strategy_stage(self.choose(varied))
    }

    /// Bases and targets of held-out sessions, as one stage on their rows.
    pub fn late_stage(&self) -> Option<Stage<'a>> {
        let unknowns: Vec<usize> =
            self.late.parameters.iter().enumerate().filter(|(_, late)| **late).map(|(k, _)| k).collect();
        (!unknowns.is_empty()).then(|| self.stage(&self.late.rows, unknowns))
    }

    /// First row whose pose has no equilibrium on the nominal arm.
    pub fn without_equilibrium(&self) -> Option<usize> {
        let rows: Vec<usize> = (0..self.measurements.len()).collect();
        let errors = self.position_errors(&rows, &DVector::zeros(self.model.parameters.len()));
        errors.iter().position(|error| !error.norm().is_finite())
    }

    /// The nominal arm with bases and targets fitted where they are free.
    pub fn registered(&self) -> Result<DVector<f64>, StageError> {
        let mut x = DVector::zeros(self.model.parameters.len());
        let rows: Vec<usize> = self.split.identification.iter().chain(&self.late.rows).copied().collect();
        register(self.model, &self.placement.poses(self.measurements, &rows, self.sigma), &mut x);
        let placements = self.choose(|parameter| parameter.slot.is_placement());
        if !placements.is_empty() {
            x = self.stage(&self.split.identification, placements).run(&x)?.x;
        }
        match self.late_stage() {
            Some(stage) => Ok(stage.run(&x)?.x),
            None => Ok(x),
        }
    }

    /// Runs the strategy's stages from `start`; several are repeated until the cost settles.
    pub fn run(&self, start: &DVector<f64>) -> Result<FitEnd, StageError> {
        let whole = self.whole();
        let [first, rest @ ..] = self.strategy.stages() else { return Ok(whole.run(start)?.into()) };
        if rest.is_empty() {
            return Ok(self.strategy_stage(self.choose(first)).run(start)?.into());
        }
        let mut end = FitEnd {
            x: start.clone(),
            termination: Termination::IterationLimit,
            iterations: 0,
            at_bound: vec![None; whole.unknowns.len()],
            gauge: whole.gauge(start),
        };
        let mut cost = f64::INFINITY;
        for _ in 0..MAX_SWEEPS {
            let mut termination = end.termination;
            for chosen in self.strategy.stages() {
                let stage = self.strategy_stage(self.choose(chosen));
                let StageEnd { x, solution, .. } = stage.run(&end.x)?;
                end.x = x;
                end.iterations += solution.iterations;
                termination = solution.termination;
                for (k, at_bound) in stage.unknowns.iter().zip(solution.at_bound) {
                    if let Some(j) = whole.unknowns.iter().position(|unknown| unknown == k) {
                        end.at_bound[j] = at_bound;
                    }
                }
            }
            let next = whole.cost(&end.x);
            if !termination.converged() || cost - next <= SWEEP_SETTLED * next {
                end.termination = termination;
                return Ok(end);
            }
            cost = next;
        }
        Ok(end)
    }

    /// Errors on both parts of the data with the full parameter vector `x`.
    pub fn errors(&self, x: &DVector<f64>) -> Errors {
        let of = |rows: &[usize]| ErrorSummary::of(&self.position_errors(rows, x));
        Errors { identification: of(&self.split.identification), held_out: of(&self.split.held_out) }
    }

    /// Residuals measured − predicted of some rows, measuring frame [m].
    pub fn position_errors(&self, rows: &[usize], x: &DVector<f64>) -> Vec<nalgebra::Vector3<f64>> {
        let poses = self.placement.poses(self.measurements, rows, self.sigma);
        PoseResiduals::new(self.model, poses, Vec::new(), x.clone()).position_errors(&DVector::zeros(0))
    }
}
