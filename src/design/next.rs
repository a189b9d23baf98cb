//! Choice of the next poses to measure, given the poses that have been measured.

use nalgebra::DMatrix;

use super::exchange::Unknowns;
use super::explanations::{Explanations, ExplanationsError};
use super::greedy::Greedy;
use super::misfit::Misfit;
use super::pool::{Pool, pool_and_workspace};
use super::posterior::posterior_rows;
use super::purpose::{Purpose, StopReason, leaves_causes_open, stop_reason};
use super::workspace_error::{MisfitSize, WorkspaceError};
use super::{Candidates, Criterion, DesignError, Exchange, Sensitivity, Site, Workspace, views};
use crate::fit::{self, FindingCode, Identification, IdentifyError, Options};
use crate::measurement::{Dataset, Measurements};
use crate::numeric::range;
use crate::problem::{Effect, Problem};
use crate::remainder::{self, Correction, Fitted, SavedRemainderError};

/// Fraction of the largest gain from which on candidates count as equally good; the least travel of
/// the joints then decides.
const EQUAL_GAIN: f64 = 0.98;
/// Number of multiplications for one unknown of one candidate with three coordinates each time that
/// a pose is chosen.
const MULTIPLICATIONS_PER_UNKNOWN: f64 = 90.0;
/// Maximum number of multiplications of a request; some ten minutes on one core.
const MAX_OPERATIONS: f64 = 2e12;
/// Maximum number of entries of the matrices Jᵀ, V and T of all candidates together; 3 GB.
const MAX_ENTRIES: f64 = 4e8;

/// Settings of the choice of the next poses.
#[derive(Clone)]
pub struct NextOptions<'a> {
    /// Number of poses to choose.
    pub poses: usize,
    /// Aim of the poses.
    pub purpose: Purpose,
    /// Largest acceptable error bound over the workspace \[m\]; `None` without a limit.
    pub tolerance: Option<f64>,
    /// Probability with which an error stays below the bound.
    pub level: f64,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Region in which the target must stay; `None` without a limit.
    pub workspace: Option<&'a Workspace>,
    /// Effects of a loop among which poses for causes are to decide; needed for [`Purpose::Causes`]
    /// and [`Purpose::Both`].
    pub explanations: Option<&'a Explanations>,
    /// True if predictions use a remainder that is fitted to the measured poses.
    pub remainder: bool,
    /// Settings of the fit to the measured poses.
    pub fit: Options,
    /// Update of an earlier estimate by the measured poses, with the uncertainty of its
    /// predictions; `None` to fit these poses alone.
    pub update: Option<(&'a Identification, Option<&'a Fitted>)>,
}

/// Travel to a chosen pose, and the expected benefit of measuring it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NextStep {
    /// Largest move of a joint from the pose before, as a fraction of the joint's range over the
    /// candidates.
    pub travel: f64,
    /// Decrease of the goal tr(C M) by the pose, as a fraction of its value before all chosen
    /// poses.
    pub gain: f64,
    /// Expected error over the workspace after this pose; `None` if [`NextPoses::error`] is `None`.
    pub error: Option<WorkspaceError>,
}

/// Next poses to measure, with the error over the workspace now and after each of them.
#[derive(Debug, Clone)]
pub struct NextPoses {
    /// Chosen poses in the order of measurement.
    pub poses: Measurements,
    /// Travel and expected benefit of each chosen pose.
    pub steps: Vec<NextStep>,
    /// Number of rows that are measured and fitted.
    pub measured: usize,
    /// Number of candidates.
    pub candidates: usize,
    /// Number of poses drawn to find the candidates; `None` if they are rows of a table, or if
    /// cameras do not measure.
    pub drawn: Option<usize>,
    /// Number of poses over which predictions are judged.
    pub workspace_poses: usize,
    /// Assumed root mean square misfit of the position along each axis \[m\]; NaN if cameras
    /// measure.
    pub misfit: f64,
    /// 1 σ of the noise of one coordinate \[m\]; NaN if cameras measure.
    pub noise: f64,
    /// Error over the workspace now; `None` with fewer than ten configurations, or with fewer
    /// measured coordinates than fitted parameters.
    pub error: Option<WorkspaceError>,
    /// Expected error over the workspace that no number of poses lowers further \[m\]; `None` if
    /// `error` is `None`.
    pub attainable: Option<f64>,
    /// Reason for which fewer poses were chosen than requested; `None` if all were.
    pub stop: Option<StopReason>,
    /// Effects among which the poses are to decide; empty for accuracy.
    pub effects: Vec<Effect>,
    /// True if cameras measure the poses: predictions are pixels of the points in view, and their
    /// error is not judged.
    #[doc(hidden)]
    pub is_of_cameras: bool,
    /// Fit to the measured poses.
    pub found: Identification,
}

/// Error that prevents the choice of the next poses.
#[derive(Debug, thiserror::Error)]
pub enum NextError {
    /// Problem, poses or ranges do not suffice for a design.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// The measured poses cannot be fitted.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The loop.json cannot be used.
    #[error(transparent)]
    Explanations(#[from] ExplanationsError),
    /// The declared remainder cannot be read.
    #[error(transparent)]
    Remainder(#[from] SavedRemainderError),
    /// The loop.json has no effects among which poses could decide.
    #[error("{}; use --for accuracy", nothing_to_separate(follow_time))]
    NothingToSeparate {
        /// Uncertain effects that follow the time of measurement, which poses do not choose.
        follow_time: Vec<String>,
    },
    /// The request would take too long, or too much memory.
    #[error(
        "{poses} poses out of {candidates} candidates with {unknowns} unknowns are too many: ask for fewer poses at a time, or thin out \
         the pool"
    )]
    TooLarge {
        /// Number of poses requested.
        poses: usize,
        /// Number of candidates.
        candidates: usize,
        /// Number of unknowns.
        unknowns: usize,
    },
}

/// States why poses cannot decide among the effects of a loop.json.
fn nothing_to_separate(follow_time: &[String]) -> String {
    if follow_time.is_empty() {
        return "there is nothing to tell apart: loop.json has no effect that is uncertain or has \
                an alternative"
            .to_owned();
    }
    format!(
        "poses cannot tell the uncertain effects of loop.json apart, because they follow the \
         time of measurement ({})",
        follow_time.join("; ")
    )
}

impl NextError {
    /// Returns true if the choice was stopped on request.
    #[doc(hidden)]
    pub fn is_interrupted(&self) -> bool {
        matches!(self, Self::Identify(error) if error.is_interrupted())
    }
}

/// Chooses the next poses to measure, after a fit to the identification rows of `data`.
///
/// The goal is tr(C M), with C the covariance of parameters and misfit after all measured and
/// chosen poses. For accuracy it is the mean variance of predictions over the workspace. This is
/// the table of candidates, or poses drawn from the ranges. If cameras measure, predictions are
/// pixels of the points in view, and no misfit is assumed. The result depends on the seed, not on
/// the number of threads.
///
/// # Errors
/// Returns an error if the measured poses cannot be fitted, no candidate remains, poses for causes
/// have no effects to decide among, or the request is too large.
#[expect(clippy::too_many_lines, reason = "one result, listed field by field")]
pub fn next(
    problem: &Problem,
    data: &Dataset,
    candidates: &Candidates,
    options: &NextOptions,
) -> Result<NextPoses, NextError> {
    let NextOptions { seed, poses, .. } = *options;
    if poses == 0 {
        return Err(DesignError::NoPoses.into());
    }
    if options.update.is_some() && options.purpose != Purpose::Accuracy {
        return Err(ExplanationsError::WithPrior.into());
    }
    options.explanations.map_or(Ok(()), |of| of.check_rows(&data.measurements))?;
    let found = match options.update {
        Some((found, _)) => found.clone(),
        None => fitted(problem, data, options)?,
    };
    let explanations = options.explanations.filter(|_| options.purpose != Purpose::Accuracy);
    if options.purpose != Purpose::Accuracy
        && explanations.is_none_or(|of| of.open().next().is_none())
    {
        let follow_time = explanations.map_or_else(Vec::new, |of| of.follow_time.clone());
        return Err(NextError::NothingToSeparate { follow_time });
    }
    let mut plain = problem.clone();
    let has_declared_noise = data.measurements.has_declared_noise(problem);
    let pairs = views::pairs(
        problem,
        &match candidates {
            Candidates::Rows(rows) => rows.as_ref().clone().arm_rows(),
            Candidates::Within(_) => data.measurements.select(&[]),
        },
    );
    let is_of_cameras = !pairs.is_empty();
    if !is_of_cameras {
        plain.data.position_sigma = plain.data.position_sigma.or(Some(found.sigma));
    }
    let designed = explanations.map_or_else(|| plain.clone(), |of| of.declared(&plain));
    let rows: Vec<usize> = data.split.identification.clone();
    let measured = data.measurements.select(&rows);
    let mut site = Site::with_cameras(&designed, &[&measured], pairs)?;
    site.linearise_at(&found, &measured);
    let Pool { candidates: pool, workspace: reference, drawn } =
        pool_and_workspace(candidates, &site, &measured, (options.workspace, poses, seed))?;
    if let Some(region) = options.workspace.filter(|_| pool.is_empty()) {
        return Err(DesignError::nothing_in(region).into());
    }
    let (pool, sensitivity) = site.in_equilibrium(&pool);
    let reference = if is_of_cameras { site.in_equilibrium(&reference).0 } else { reference };
    if pool.is_empty() || reference.is_empty() {
        let nothing =
            if is_of_cameras { DesignError::NothingInView } else { DesignError::NoEquilibrium };
        return Err(nothing.into());
    }
    let size = MisfitSize::of(&found, (has_declared_noise, problem.data.position_sigma));
    let misfit = (!is_of_cameras).then(|| Misfit::new(&site, &reference, size.misfit, seed));
    let mut unknowns = Unknowns::of(&site.model.parameters);
    let coordinates = sensitivity.coordinates;
    let posterior =
        options.update.map(|_| posterior_rows(&site, &found, coordinates, &mut unknowns));
    let unknowns = match &misfit {
        Some(misfit) => unknowns.and_standard(misfit.weights()),
        None => unknowns,
    };
    check_size(poses, (pool.len(), sensitivity.coordinates), unknowns.sigmas.len())?;
    let extended = |rows: &Measurements, of: Sensitivity, unit| match &misfit {
        Some(misfit) => misfit.with_misfit_rows(&site, rows, &of, unit),
        None => of,
    };
    let (given_rows, given) = site.in_equilibrium(&measured);
    let given = match posterior {
        Some(Sensitivity { rows, coordinates }) => {
            Sensitivity { rows: rows.resize_vertically(unknowns.sigmas.len(), 0.0), coordinates }
        }
        None => extended(&given_rows, given, None),
    };
    let sensitivity = extended(&pool, sensitivity, None);
    let unit = (!is_of_cameras).then_some(1.0);
    let predicted = extended(&reference, site.sensitivity(&reference, unit), unit);
    let prediction = mean_square(&predicted);
    let cause = explanations.map(|of| cause_goal(&site, &of.parameters(&designed), &prediction));
    // Errors of left-out configurations give no bounds if the priors determine the parameters.
    let correction = match options.update {
        _ if is_of_cameras => None,
        Some((_, fitted)) => fitted.map(|fitted| fitted.correction().clone()),
        None if found.has(FindingCode::PriorsDecide) => None,
        None => correction(problem, data, &found, options)?,
    };
    let error = match &correction {
        Some(correction) => {
            let mut site = Site::new(&plain, &[&measured])?;
            site.linearise_at(&found, &measured);
            WorkspaceError::of(correction, &site, &reference, (options.level, size.freedom))
        }
        None => None,
    };
    let exchange = |goal: &DMatrix<f64>| {
        Exchange::of(&unknowns, &sensitivity, Some(&given), poses, (&Criterion::I, Some(goal)))
            .ok_or(NextError::Design(DesignError::NoEquilibrium))
    };
    // For equal weights, each goal is divided by its value before any new pose.
    let goal = match (&cause, options.purpose) {
        (Some(cause), Purpose::Causes) => cause.clone(),
        (Some(cause), Purpose::Both) => {
            let value = |goal: &DMatrix<f64>| -> Result<f64, NextError> {
                Ok(exchange(goal)?.greedy().map_or(1.0, |greedy| greedy.value()))
            };
            &prediction / value(&prediction)? + cause / value(cause)?
        }
        _ => prediction.clone(),
    };
    let exchange = exchange(&goal)?;
    let mut greedy = exchange.greedy().ok_or(DesignError::NoEquilibrium)?;
    let scaled = exchange.scaled(&prediction);
    let parameters = site.model.parameters.len();
    let remaining_error = |greedy: &Greedy| {
        let view = |of: &DMatrix<f64>| of.view((0, 0), (parameters, parameters)).into_owned();
        view(&greedy.covariance).dot(&view(&scaled)).max(0.0)
    };
    let before = remaining_error(&greedy);
    let stop = error
        .filter(|_| found.is_trusted())
        .and_then(|error| stop_reason(&error, options.purpose, options.tolerance));
    let mut result = NextPoses {
        poses: pool.select(&[]),
        steps: Vec::new(),
        measured: measured.len(),
        candidates: pool.len(),
        drawn,
        workspace_poses: reference.len(),
        misfit: if is_of_cameras { f64::NAN } else { size.misfit },
        noise: if is_of_cameras { f64::NAN } else { size.noise },
        error,
        attainable: error.map(|error| error.least),
        stop,
        effects: explanations.map_or_else(Vec::new, |of| of.open().cloned().collect()),
        is_of_cameras,
        found,
    };
    if stop.is_some() {
        return Ok(result);
    }
    let last = measured.configuration(measured.len() - 1);
    let share = |greedy: &Greedy| if before > 0.0 { remaining_error(greedy) / before } else { 1.0 };
    let chosen = take_poses((&mut result, &mut greedy), (&pool, last), options, share)?;
    let gain: f64 = result.steps.iter().map(|step| step.gain).sum();
    let is_judged = result.found.is_trusted() && !chosen.is_empty();
    if is_judged && leaves_causes_open(options.purpose, gain) {
        result.stop = Some(StopReason::CausesAlike);
        result.steps.clear();
        return Ok(result);
    }
    result.poses = pool.select(&chosen);
    Ok(result)
}

/// Fits the measured poses. Returns an error also if the caller requested to stop after the last
/// step of the fit.
fn fitted(
    problem: &Problem,
    data: &Dataset,
    options: &NextOptions,
) -> Result<Identification, NextError> {
    let found = fit::identify(problem, data, &options.fit)?;
    check_interrupt(options)?;
    Ok(found)
}

/// Returns an error if the caller has requested to stop.
fn check_interrupt(options: &NextOptions) -> Result<(), NextError> {
    match &options.fit.stop {
        Some(stop) if stop.is_requested() => Err(IdentifyError::interrupted().into()),
        _ => Ok(()),
    }
}

/// Takes up to `options.poses` poses of the `pool` one after the other, each with the largest gain;
/// of equal ones the nearest to the configuration before, which is `last` at first. Enters them as
/// steps of `result`, and returns their rows. `share` returns the fraction of the mean square error
/// by the parameters that remains.
fn take_poses(
    (result, greedy): (&mut NextPoses, &mut Greedy),
    (pool, last): (&Measurements, &[f64]),
    options: &NextOptions,
    share: impl Fn(&Greedy) -> f64,
) -> Result<Vec<usize>, NextError> {
    let travel = Travel::of(pool);
    let mut last = last.to_vec();
    let (mut chosen, mut is_chosen) = (Vec::new(), vec![false; pool.len()]);
    let first = greedy.value();
    while chosen.len() < options.poses {
        check_interrupt(options)?;
        let gains = greedy.gains();
        let free = || (0..pool.len()).filter(|&k| !is_chosen[k]);
        let largest = free().map(|k| gains[k]).fold(0.0, f64::max);
        let move_to = |k: usize| travel.between(&last, pool.configuration(k));
        let equal = free().filter(|&k| gains[k] >= EQUAL_GAIN * largest);
        let nearest = equal.min_by(|&a, &b| move_to(a).total_cmp(&move_to(b)));
        let Some(pose) = nearest else {
            result.stop = Some(StopReason::NoCandidates);
            break;
        };
        let moved = move_to(pose);
        greedy.take(pose);
        let share = share(greedy);
        result.steps.push(NextStep {
            travel: moved,
            gain: gains[pose] / first,
            error: result.error.map(|error| error.with_parameters(share)),
        });
        is_chosen[pose] = true;
        chosen.push(pose);
        last = pool.configuration(pose).to_vec();
    }
    Ok(chosen)
}

/// Returns the uncertainty of predictions by the fit `found`. A remainder is fitted to the same
/// rows if the problem declares one or the options ask for it. `None` if the data are too few.
fn correction(
    problem: &Problem,
    data: &Dataset,
    found: &Identification,
    options: &NextOptions,
) -> Result<Option<Correction>, NextError> {
    check_interrupt(options)?;
    let is_corrected = options.remainder || remainder::declared(problem)?.is_some();
    Ok(if is_corrected {
        remainder::fit(found, problem, data)?.map(|fitted| fitted.correction().clone())
    } else {
        remainder::uncertainty(found, problem, data)?.map(|fitted| fitted.alone)
    })
}

/// Returns M with tr(C M) = mean over the poses of tr(J C Jᵀ), without poses that have no
/// equilibrium.
pub(super) fn mean_square(sensitivity: &Sensitivity) -> DMatrix<f64> {
    let finite: Vec<usize> =
        (0..sensitivity.len()).filter(|&pose| sensitivity.is_finite(pose)).collect();
    sensitivity.select(&finite).information() / finite.len().max(1) as f64
}

/// Returns M with tr(C M) = Σ C_kk / σ_k² over the parameters `names`. σ_k is that of the
/// parameter's prior, 1 without a prior. M has the shape of `like`.
fn cause_goal(site: &Site, names: &[String], like: &DMatrix<f64>) -> DMatrix<f64> {
    let mut goal = DMatrix::zeros(like.nrows(), like.ncols());
    for (k, parameter) in site.model.parameters.iter().enumerate() {
        if names.contains(&parameter.name) {
            goal[(k, k)] = parameter.sigma.map_or(1.0, |sigma| sigma.powi(-2));
        }
    }
    goal
}

/// Checks that the request takes neither too long nor too much memory.
fn check_size(
    poses: usize,
    (candidates, coordinates): (usize, usize),
    unknowns: usize,
) -> Result<(), NextError> {
    let entries = 3.0 * (candidates * coordinates) as f64 * unknowns as f64;
    let operations =
        MULTIPLICATIONS_PER_UNKNOWN / 9.0 * entries * poses as f64 + entries * unknowns as f64;
    if entries > MAX_ENTRIES || operations > MAX_OPERATIONS {
        return Err(NextError::TooLarge { poses, candidates, unknowns });
    }
    Ok(())
}

/// Measure of the travel between configurations, relative to the joints' ranges over some poses.
#[derive(Debug, Clone)]
struct Travel {
    /// Inverse width of each joint's range [1/rad] or [1/m]; 0 for a joint that does not move.
    scales: Vec<f64>,
}

impl Travel {
    /// Takes the ranges of the joints from the poses of a table.
    pub fn of(table: &Measurements) -> Self {
        let scale = |joint: usize| {
            let (low, high) = range((0..table.len()).map(|row| table.configuration(row)[joint]));
            if high > low { (high - low).recip() } else { 0.0 }
        };
        Self { scales: (0..table.joints).map(scale).collect() }
    }

    /// Returns the largest move of a joint between two configurations, as a fraction of its range.
    pub fn between(&self, from: &[f64], to: &[f64]) -> f64 {
        let moves = from.iter().zip(to).zip(&self.scales);
        moves.map(|((from, to), scale)| (to - from).abs() * scale).fold(0.0, f64::max)
    }
}
