//! From measurements to estimates with their errors.

use std::time::Instant;

use nalgebra::DVector;

use super::active::ActiveConstraint;
use super::fitting::{FitEnd, Fitting};
use super::outliers::Outlier;
use super::stage::{Stage, StageError};
use super::statistics::Statistics;
use super::trust::{Distrust, misses, underdetermined};
use super::{ErrorSummary, Placement, ProgressSink, SolverChoice, Strategy};
use crate::error::{InputError, InputErrorKind};
use crate::fit::{Identifiability, Loss};
use crate::measurement::{Measurements, Split};
use crate::model::Model;
use crate::parameter::{Parameter, Unit};
use crate::problem::{Problem, Robust, RobustLoss};
use crate::solver::{AtBound, Termination};

/// An undeclared σ has settled when it changes by less than this part.
const NOISE_SETTLED: f64 = 1e-3;
/// Fits after which the search for an undeclared σ stops.
const MAX_NOISE_FITS: usize = 20;
/// Least σ that an undeclared one is taken to be: positions are not predicted more exactly than to rounding [m].
const LEAST_NOISE: f64 = 1e-9;
/// A parameter of which the data gave no more than this part has no standard error.
const NOTHING_LEARNED: f64 = 1e-6;

/// How to identify.
#[derive(Clone, Default)]
pub struct Options {
    /// Which parameters are fitted together.
    pub strategy: Strategy,
    /// By which solver.
    pub solver: SolverChoice,
    /// Told of every step.
    pub progress: Option<ProgressSink>,
}

/// Why an identification could not be made.
#[derive(Debug, thiserror::Error)]
pub enum IdentifyError {
    /// Problem and data do not fit each other.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A fit could not be set up.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// Bounds or constraints were declared for a solver that cannot keep them.
    #[error(
        "{solver} does not keep the bounds of [parameters] and constraints: take the solver bounded or auto, or leave out \
         min, max and [[constraint]]"
    )]
    BoundsIgnored {
        /// The solver that was asked for.
        solver: &'static str,
    },
    /// A strategy has nothing to vary.
    #[error("strategy {strategy} has nothing to fit: no parameter of its kind is free in [parameters]")]
    NothingToFit {
        /// The strategy that was asked for.
        strategy: &'static str,
    },
}

/// Errors on both parts of the data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Errors {
    /// On the poses that are fitted.
    pub identification: ErrorSummary,
    /// On the poses that decide nothing.
    pub held_out: ErrorSummary,
}

/// Where the assumed noise comes from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Noise {
    /// From `position_sigma` or the column `sigma`.
    Declared,
    /// From the scatter about the fit, 1 σ per coordinate [m].
    Estimated(f64),
    /// Neither declared nor to be seen: the fit has no degrees of freedom.
    Unknown,
}

/// A parameter after the fit; SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Name as in the problem file.
    pub name: String,
    /// Kind of quantity.
    pub unit: Unit,
    /// Nominal value.
    pub nominal: f64,
    /// Estimated value.
    pub estimate: f64,
    /// 1 σ; `None` where nothing was learned, where the value rests on a bound or is part of a combination that neither
    /// data nor priors see, or where it was not fitted.
    pub std_error: Option<f64>,
    /// The bound on which the value rests.
    pub at_bound: Option<AtBound>,
    /// Part of the value that the data gave, 0…1; the rest is prior, bound, or choice among blind combinations.
    pub identified: f64,
    /// Whether the strategy varied it.
    pub fitted: bool,
}

/// An identified arm.
#[derive(Debug, Clone)]
pub struct Identification {
    /// Which parameters were fitted together.
    pub strategy: Strategy,
    /// The solver that was used.
    pub solver: SolverChoice,
    /// Why it stopped.
    pub termination: Termination,
    /// Why the fit is not to be trusted, if it is not.
    pub distrust: Option<Distrust>,
    /// Steps tried, over all stages.
    pub iterations: u64,
    /// Evaluations of the residual, with derivatives or without, over all stages.
    pub evaluations: u64,
    /// Time taken [s].
    pub seconds: f64,
    /// Where the noise comes from.
    pub noise: Noise,
    /// Of the nominal arm, with base and target fitted where they are free.
    pub registered: Errors,
    /// Of the identified arm.
    pub fitted: Errors,
    /// χ² of the identification data over its degrees of freedom; `None` without any, or with the noise estimated.
    /// Where the loss is robust, outliers are left out of it.
    pub reduced_chi2: Option<f64>,
    /// By how much the declared variance was raised for the standard errors, ≥ 1.
    pub noise_factor: f64,
    /// Measured coordinates that were fitted.
    pub coordinates: usize,
    /// Names of the fitted parameters, in the order of `identifiability`.
    pub unknowns: Vec<String>,
    /// What the identification data can tell about them, at the registered nominal arm.
    pub identifiability: Identifiability,
    /// Every free parameter.
    pub estimates: Vec<Estimate>,
    /// Pairs of parameters correlated by more than 0.9, strongest first.
    pub correlations: Vec<(String, String, f64)>,
    /// Constraints that hold the fitted parameters back, in the order of the file.
    pub active_constraints: Vec<ActiveConstraint>,
    /// Identification rows whose residual is too long to be noise, in the order of the rows.
    pub outliers: Vec<Outlier>,
    /// Full parameter vector of the model.
    pub x: DVector<f64>,
}

impl Identification {
    /// Whether the fit is to be trusted.
    pub fn is_trusted(&self) -> bool {
        self.distrust.is_none()
    }
}

/// Identifies the free parameters of `problem` from the identification rows; held-out rows decide nothing.
///
/// # Errors
/// Problem, data, strategy and solver do not fit each other.
pub fn identify(
    problem: &Problem,
    measurements: &Measurements,
    split: &Split,
    options: &Options,
) -> Result<Identification, IdentifyError> {
    let placement = Placement::of(measurements);
    let model = Model::new(problem, &placement.bases, &placement.targets)?;
    identify_model(&model, problem, measurements, split, options)
}

/// As [`identify`], with a model of the problem that the caller has changed.
pub(super) fn identify_model(
    model: &Model,
    problem: &Problem,
    measurements: &Measurements,
    split: &Split,
    options: &Options,
) -> Result<Identification, IdentifyError> {
    let clock = Instant::now();
    let placement = Placement::of(measurements);
    let (strategy, solver) = (options.strategy, options.solver.decide(model));
    if solver != SolverChoice::Bounded && model.is_bounded() {
        return Err(IdentifyError::BoundsIgnored { solver: solver.as_str() });
    }
    let declared = problem.data.position_sigma;
    let noise_is_declared = declared.is_some() || measurements.sigma.is_some();
    let mut fitting = Fitting {
        model,
        measurements,
        split,
        placement: &placement,
        late: placement.late(model, split),
        strategy,
        solver,
        loss: problem.robust.map_or(Loss::Squares, loss),
        progress: options.progress.as_ref(),
        sigma: declared.unwrap_or(1e-3),
    };
    if let Some(row) = fitting.without_equilibrium() {
        return Err(measurements.location(row).error(InputErrorKind::NoEquilibrium).into());
    }
    let unknowns: Vec<&Parameter> = fitting.whole().parameters().collect();
    if strategy != Strategy::Joint && unknowns.iter().all(|parameter| parameter.slot.is_placement()) {
        return Err(IdentifyError::NothingToFit { strategy: strategy.as_str() });
    }

    let start = fitting.registered()?;
    let registered = fitting.errors(&start);
    if !noise_is_declared {
        fitting.sigma = (registered.identification.rms.norm / 3.0_f64.sqrt()).max(LEAST_NOISE);
    }
    let mut fits = 0;
    let (mut end, statistics) = loop {
        let end = fitting.run(&start)?;
        let statistics = Statistics::of(&fitting.whole(), &end, noise_is_declared)?;
        fits += 1;
        let next = fitting.sigma * statistics.reduced_chi2.map_or(1.0, f64::sqrt);
        let next = next.max(LEAST_NOISE);
        let settled = (next - fitting.sigma).abs() < NOISE_SETTLED * fitting.sigma;
        if noise_is_declared || settled || fits == MAX_NOISE_FITS {
            break (end, statistics);
        }
        fitting.sigma = next;
    };
    let noise = match statistics.reduced_chi2 {
        _ if noise_is_declared => Noise::Declared,
        Some(_) => Noise::Estimated(fitting.sigma),
        None => Noise::Unknown,
    };
    let errors = fitting.position_errors(&split.identification, &end.x);
    let outliers = statistics.lengths.list(&split.identification, &errors, measurements);
    let mut estimates: Vec<Estimate> = model.parameters.iter().map(Estimate::unfitted).collect();
    report(&mut estimates, &fitting.whole(), &end, &statistics);
    let without_prior = unknowns.iter().filter(|parameter| parameter.sigma.is_none()).count();
    let coordinates = 3 * split.identification.len();
    let of = "the fit".to_owned();
    let mut distrust = (coordinates < without_prior)
        .then_some(Distrust::TooFewEquations { of, coordinates, unknowns: without_prior })
        .or_else(|| underdetermined(model, &placement, &split.identification))
        .or_else(|| (!end.termination.converged()).then_some(Distrust::NotConverged(end.termination)));
    if let Some(stage) = fitting.late_stage() {
        let late: FitEnd = stage.run(&end.x)?.into();
        end.iterations += late.iterations;
        end.evaluations += late.evaluations;
        distrust = distrust
            .or_else(|| underdetermined(model, &placement, &fitting.late.rows))
            .or_else(|| (!late.termination.converged()).then_some(Distrust::HeldOutNotConverged(late.termination)));
        report(&mut estimates, &stage, &late, &Statistics::of(&stage, &late, noise_is_declared)?);
        end.x = late.x;
    }
    if noise == Noise::Unknown {
        estimates.iter_mut().for_each(|estimate| estimate.std_error = None);
    }
    let fitted = fitting.errors(&end.x);
    let distrust = distrust
        .or_else(|| misses(measurements, &placement, &split.identification, &fitted.identification, fitting.sigma));
    let name = |j: usize| unknowns[j].name.clone();
    Ok(Identification {
        distrust,
        strategy,
        solver,
        termination: end.termination,
        iterations: end.iterations,
        evaluations: end.evaluations,
        noise,
        registered,
        fitted,
        reduced_chi2: statistics.reduced_chi2.filter(|_| noise_is_declared),
        noise_factor: statistics.noise_factor,
        coordinates,
        identifiability: Identifiability::of(&fitting.whole().data_triangle(&start)),
        estimates,
        correlations: statistics.correlations.iter().map(|&(i, j, rho)| (name(i), name(j), rho)).collect(),
        unknowns: unknowns.iter().map(|parameter| parameter.name.clone()).collect(),
        active_constraints: ActiveConstraint::all(&statistics.constraints, model),
        outliers,
        x: end.x,
        seconds: clock.elapsed().as_secs_f64(),
    })
}

/// The loss that `[robust]` stands for, on the three coordinates of a position.
fn loss(robust: Robust) -> Loss {
    match robust.loss {
        RobustLoss::Huber => Loss::Huber { threshold: robust.threshold.unwrap_or(Loss::HUBER_POSITION) },
        RobustLoss::L1 => {
            Loss::L1 { slope: Loss::L1_POSITION, smoothing: robust.threshold.unwrap_or(Loss::L1_SMOOTHING) }
        }
    }
}

impl Estimate {
    fn unfitted(parameter: &Parameter) -> Self {
        Self {
            name: parameter.name.clone(),
            unit: parameter.unit(),
            nominal: parameter.nominal,
            estimate: parameter.nominal,
            std_error: None,
            at_bound: None,
            identified: 0.0,
            fitted: false,
        }
    }
}

/// Enters what a stage found into the estimates of its unknowns.
fn report(estimates: &mut [Estimate], stage: &Stage, end: &FitEnd, statistics: &Statistics) {
    for (j, (&k, parameter)) in stage.unknowns.iter().zip(stage.parameters()).enumerate() {
        let x = end.x[k];
        let learned = statistics.known[j] && statistics.identified[j] > NOTHING_LEARNED;
        let estimate = &mut estimates[k];
        estimate.estimate = parameter.value(x);
        estimate.std_error = learned.then(|| parameter.value_error(x, statistics.errors[j]));
        estimate.at_bound = end.at_bound[j];
        estimate.identified = statistics.identified[j];
        estimate.fitted = true;
    }
}
