//! Plan of poses: the best of several exchanges, compared with random poses.

use nalgebra::DMatrix;
use rand::Rng;
use rand::seq::SliceRandom as _;
use rayon::prelude::*;

use super::coordinates::{coordinates, first_rows};
use super::drawn::{Candidates, Drawn};
use super::exchange::Unknowns;
use super::forecast::untouched;
use super::misfit::Misfit;
use super::next::mean_square;
use super::{
    Criterion, DesignError, Exchange, ExchangeResult, Forecast, Sensitivity, Site, Workspace,
};
use crate::error::InputErrorKind;
use crate::measurement::{Measurements, Split};
use crate::model::parameter::Parameter;
use crate::numeric::median;
use crate::numeric::parallel;
use crate::problem::{PoseRanges, Problem};
use crate::random;

/// Number of exchanges by every criterion but I, each started from random poses.
const STARTS: usize = 8;
/// Number of exchanges by the criterion I. Its unknowns include the weights of a misfit, so that an
/// exchange takes an order of magnitude longer; mean variances after different starts differ by a
/// few percent.
const MEAN_STARTS: usize = 2;
/// Maximum number of exchanges whose poses are refined: those with the best criterion.
const REFINED_STARTS: usize = 4;
/// Largest change of a quantity in the variations of each refinement round, as a fraction of its
/// range.
const REFINEMENT_REACHES: [f64; 8] = [0.3, 0.2, 0.2, 0.1, 0.1, 0.05, 0.05, 0.02];
/// Number of candidates in a refinement round.
const ROUND_CANDIDATES: usize = 2500;
/// Number of candidates in a refinement round if cameras measure many points of each candidate.
const CAMERA_ROUND_CANDIDATES: usize = 640;
/// Number of random sets of poses that a plan is compared with; odd, so that one is the median.
pub(super) const RANDOM_SETS: usize = 75;
/// First random stream of the refinement rounds.
const REFINEMENT_STREAM: u64 = 2;
/// Maximum number of poses over which the criterion I averages the variance of predictions.
const MAX_WORKSPACE_POSES: usize = 500;
/// First random stream of the poses from which exchanges start.
const START_STREAM: u64 = 100;
/// First random stream of the random sets of poses that a plan is compared with.
pub(super) const RANDOM_SET_STREAM: u64 = 200;

/// Settings of a plan: number of poses, criterion, seed and limits.
#[derive(Clone, Copy)]
pub struct PlanOptions<'a> {
    /// Number of poses to plan.
    pub poses: usize,
    /// Criterion that the plan minimises.
    pub criterion: &'a Criterion,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Region in which the target must stay; `None` without a limit.
    #[doc(hidden)]
    pub workspace: Option<&'a Workspace>,
    /// Function that is called after every sweep, by several threads.
    #[doc(hidden)]
    pub progress: Option<&'a (dyn Fn(PlanProgress) + Sync)>,
}

/// Progress of a plan.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanProgress {
    /// Number of the exchange from random poses, from 1; `None` during refinement.
    pub start: Option<usize>,
    /// Number of finished sweeps of the present exchange.
    pub sweep: usize,
    /// ln of the value that the design criterion has for these poses; smaller is better.
    pub value: f64,
}

/// Planned poses with their forecast.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Planned poses; in the order of the table if the candidates are its rows.
    pub poses: Measurements,
    /// Number of given rows that are measured in any case and fitted, without known distances
    /// between points.
    pub given: usize,
    /// Number of given rows that are held out, and so do not count.
    #[doc(hidden)]
    pub held_out: usize,
    /// Number of candidates that were tried.
    pub candidates: usize,
    /// Number of poses drawn to find the first candidates; `None` if they are rows of a table, or
    /// if cameras do not measure.
    pub drawn: Option<usize>,
    /// Logarithm of the criterion at the end of each exchange, before refinement.
    pub starts: Vec<f64>,
    /// Logarithm of the criterion of the plan.
    pub value: f64,
    /// Forecast for given and planned poses together.
    pub planned: Forecast,
    /// Number of combinations of parameters that all candidates together determine without priors.
    pub attainable_rank: usize,
    /// Smallest number of planned poses that can determine all attainable combinations.
    pub least_poses: usize,
    /// Number of coordinates that given and planned poses measure together.
    pub coordinates: usize,
    /// Forecast for each random set: the given poses with as many random poses as are planned.
    pub random: Vec<Forecast>,
    /// True if the plan determines all combinations that all candidates can, and measures at least
    /// as many coordinates as there are parameters without a prior.
    pub suffices: bool,
    /// True if cameras measure the poses. Each marker point in view is then one measurement.
    #[doc(hidden)]
    pub is_of_cameras: bool,
}

/// Chooses poses by exchange from several starts. The result depends on the seed, not on the number
/// of threads.
///
/// With ranges, candidates are drawn first and then varied around the best poses, ever closer to
/// them. Poses in `given` are measured in any case, and count if they are not held out.
///
/// # Errors
/// Returns an error if there are fewer candidates than poses, or if the problem lacks a
/// declaration.
pub fn plan(
    problem: &Problem,
    candidates: &Candidates,
    given: Option<&Measurements>,
    options: &PlanOptions,
) -> Result<Plan, DesignError> {
    plan_beside(problem, candidates, fitted_rows(problem, given).as_ref(), options)
}

/// Returns the given rows that a fit does not hold out, and the number of the others. Without a
/// split, all rows are fitted.
pub(super) fn fitted_rows(
    problem: &Problem,
    given: Option<&Measurements>,
) -> Option<(Measurements, usize)> {
    let given = given?;
    match Split::new(problem, given) {
        Ok(split) => Some((given.select(&split.identification), split.held_out.len())),
        Err(error) if matches!(*error.kind, InputErrorKind::NoIdentificationRows { .. }) => None,
        Err(_) => Some((given.clone(), 0)),
    }
}

/// Chooses poses as [`plan()`] does, besides `given` rows that are all fitted. The second part of
/// `given` is the number of rows that are held out.
///
/// # Errors
/// Returns the errors of [`plan()`].
#[expect(clippy::too_many_lines, reason = "one result, listed field by field")]
pub(super) fn plan_beside(
    problem: &Problem,
    candidates: &Candidates,
    given: Option<&(Measurements, usize)>,
    options: &PlanOptions,
) -> Result<Plan, DesignError> {
    let held_out = given.map_or(0, |given| given.1);
    let given = given.map(|given| &given.0);
    let PlanOptions { poses, criterion, seed, .. } = *options;
    if poses == 0 {
        return Err(DesignError::NoPoses);
    }
    let with_distances = with_known_distances(given, candidates);
    let given = with_distances.as_ref();
    let Drawn { site, uniform, extremes, count: drawn } =
        Drawn::new(problem, candidates, given, (poses, seed))?;
    let nothing = if site.is_of_cameras(&uniform) && *criterion == Criterion::I {
        return Err(DesignError::NoPositions);
    } else if site.is_of_cameras(&uniform) {
        DesignError::NothingInView
    } else {
        DesignError::NoEquilibrium
    };
    let admitted = |(table, sensitivity): (Measurements, Sensitivity)| match options.workspace {
        Some(workspace) => {
            let rows = site.inside(&table, workspace);
            (table.select(&rows), sensitivity.select(&rows))
        }
        None => (table, sensitivity),
    };
    let parameters = &site.model.parameters;
    let given_arm_rows = given.map(|given| given.clone().arm_rows());
    let (given_table, given): (Option<Measurements>, Option<Sensitivity>) =
        given.map(|given| site.in_equilibrium(given)).unzip();
    let (table, uniform) = site.in_equilibrium(&uniform);
    let region = options.workspace.filter(|_| !table.is_empty());
    let (mut table, uniform) = admitted((table, uniform));
    let mut sensitivity = uniform.clone();
    if let Some(extremes) = extremes {
        let (extremes, extreme_sensitivity) = admitted(site.in_equilibrium(&extremes));
        table = table.concatenate(&extremes);
        sensitivity = sensitivity.and(&extreme_sensitivity);
    }
    let tried = sensitivity.len();
    if sensitivity.is_empty() {
        return Err(region.map_or(nothing, DesignError::nothing_in));
    }
    if tried < poses {
        return Err(DesignError::TooFewCandidates { poses, candidates: tried });
    }
    let Forecast { undetermined, identifiability, .. } = Forecast::new(parameters, &sensitivity);
    if identifiability.rank == 0 {
        return Err(DesignError::NothingSeen);
    }
    let unavoidable = undetermined.saturating_sub(untouched(parameters, &[Some(&sensitivity)]));
    let (attainable_rank, least_poses) = rank_and_poses(parameters, given.as_ref(), &sensitivity);
    let goal = (*criterion == Criterion::I)
        .then(|| WorkspaceGoal::new(&site, &table, uniform.len(), seed));
    let exchange = match &goal {
        Some(goal) => {
            let given = given_table.as_ref().zip(given.as_ref());
            goal.exchange(&site, (&table, &sensitivity), given, poses)
        }
        None => Exchange::new(parameters, &sensitivity, given.as_ref(), poses, criterion),
    };
    let exchange = exchange.ok_or(DesignError::NoEquilibrium)?;
    let (results, starts) = starts(&exchange, options);
    let selection = |result: &ExchangeResult| Selection {
        poses: table.select(&result.chosen),
        sensitivity: sensitivity.select(&result.chosen),
        value: result.value(),
        tried: 0,
    };
    let selections: Vec<Selection> = match candidates {
        Candidates::Within(ranges) => results[..REFINED_STARTS.min(results.len())]
            .par_iter()
            .enumerate()
            .map(|(number, result)| {
                let options = (options, number as u64);
                selection(result).refined(&site, (ranges, goal.as_ref()), &exchange, options)
            })
            .collect(),
        Candidates::Rows(_) => results.iter().take(1).map(selection).collect(),
    };
    let tried = tried + selections.iter().map(|selection| selection.tried).sum::<usize>();
    let Selection { poses: chosen, sensitivity: planned, value, .. } =
        Selection::best(selections).ok_or(DesignError::NoEquilibrium)?;
    let forecast = |added: &Sensitivity| match &given {
        Some(given) => Forecast::new(parameters, &given.and(added)),
        None => Forecast::new(parameters, added),
    };
    let of_position = sensitivity.coordinates;
    let random_set = |set: usize| {
        let stream = RANDOM_SET_STREAM + set as u64;
        let rows = choose(uniform.len(), poses, seed, stream);
        let of_points = site.all_points(&table.select(&rows));
        forecast(&of_points.unwrap_or_else(|| uniform.select(&rows)))
    };
    let random = parallel::map(RANDOM_SETS, random_set);
    let undetermined_now = |forecast: &Forecast| {
        forecast
            .undetermined
            .saturating_sub(untouched(parameters, &[Some(&planned), given.as_ref()]))
    };
    let all_points = site.all_points(&chosen);
    let planned_forecast = forecast(all_points.as_ref().unwrap_or(&planned));
    let distinct = |table: &Measurements| {
        coordinates(table, of_position, first_rows(&table.pose_numbers(problem)))
    };
    let distinct_coordinates = given_arm_rows.as_ref().map_or(0, distinct) + distinct(&chosen);
    let all_rows = |table: &Measurements| coordinates(table, of_position, 0..table.len());
    let of_chosen = all_points.as_ref().map_or(all_rows(&chosen), |points| 2 * points.len());
    let coordinates = given_table.as_ref().map_or(0, all_rows) + of_chosen;
    let without_prior = parameters.iter().filter(|parameter| parameter.sigma.is_none()).count();
    Ok(Plan {
        poses: chosen,
        given: given_arm_rows.map_or(0, |rows| rows.len()),
        held_out,
        candidates: tried,
        drawn,
        starts,
        value,
        suffices: undetermined_now(&planned_forecast) <= unavoidable
            && distinct_coordinates >= without_prior,
        planned: planned_forecast,
        attainable_rank,
        least_poses,
        coordinates,
        random,
        is_of_cameras: all_points.is_some(),
    })
}

/// Returns the number of combinations that given poses and all candidates determine together, and
/// the smallest number of planned poses that can determine them.
fn rank_and_poses(
    parameters: &[Parameter],
    given: Option<&Sensitivity>,
    candidates: &Sensitivity,
) -> (usize, usize) {
    let rank = |rows: &Sensitivity| Forecast::new(parameters, rows).identifiability.rank;
    let (total, before) = given
        .map_or_else(|| (rank(candidates), 0), |given| (rank(&given.and(candidates)), rank(given)));
    (total, total.saturating_sub(before).div_ceil(candidates.coordinates))
}

/// Returns the given rows with those rows of the candidates added that measure a distance between
/// fixtures and are not given yet. Returns `None` if there are neither.
fn with_known_distances(
    given: Option<&Measurements>,
    candidates: &Candidates,
) -> Option<Measurements> {
    let Candidates::Rows(rows) = candidates else { return given.cloned() };
    let is_given = |observation| {
        given.is_some_and(|given| (0..given.len()).any(|row| given.observation(row) == observation))
    };
    let distances: Vec<usize> = (0..rows.len())
        .filter(|&row| !rows.observation(row).is_of_arm() && !is_given(rows.observation(row)))
        .collect();
    match given {
        _ if distances.is_empty() => given.cloned(),
        Some(given) => Some(given.concatenate(&rows.select(&distances))),
        None => Some(rows.select(&distances)),
    }
}

/// Goal of the criterion I: the mean variance of predictions over the workspace.
struct WorkspaceGoal {
    /// Assumed misfit, as large as the noise; its real size is not known before the measurement.
    misfit: Misfit,
    /// Matrix M with which tr(C M) is the mean variance of predictions, for the covariance C of the
    /// unknowns, shape = (unknowns, unknowns).
    mean_square: DMatrix<f64>,
}

impl WorkspaceGoal {
    /// Takes up to [`MAX_WORKSPACE_POSES`] of the first `count` poses of a table as workspace.
    fn new(site: &Site, table: &Measurements, count: usize, seed: u64) -> Self {
        let step = count.div_ceil(MAX_WORKSPACE_POSES).max(1);
        let workspace = table.select(&(0..count).step_by(step).collect::<Vec<_>>());
        let noise = median(site.sigmas(&workspace, None)).unwrap_or(0.0);
        let misfit = Misfit::new(site, &workspace, noise, seed);
        let sensitivity = site.sensitivity(&workspace, Some(1.0));
        let sensitivity = misfit.with_misfit_rows(site, &workspace, &sensitivity, Some(1.0));
        Self { misfit, mean_square: mean_square(&sensitivity) }
    }

    /// Creates the exchange of `poses` candidates, with the misfit among the unknowns. Candidates
    /// and given poses come with their sensitivities.
    fn exchange(
        &self,
        site: &Site,
        (table, sensitivity): (&Measurements, &Sensitivity),
        given: Option<(&Measurements, &Sensitivity)>,
        poses: usize,
    ) -> Option<Exchange> {
        let given =
            given.map(|(table, given)| self.misfit.with_misfit_rows(site, table, given, None));
        Exchange::of(
            &Unknowns::of(&site.model.parameters).and_standard(self.misfit.weights()),
            &self.misfit.with_misfit_rows(site, table, sensitivity, None),
            given.as_ref(),
            poses,
            (&Criterion::I, Some(&self.mean_square)),
        )
    }
}

impl PlanOptions<'_> {
    /// Calls the progress function, if there is one.
    fn report(&self, start: Option<usize>, sweep: usize, value: f64) {
        if let Some(progress) = self.progress {
            progress(PlanProgress { start, sweep, value });
        }
    }
}

/// Runs an exchange from each start. Returns the results, the best first, and the logarithms of the
/// criterion in the order of the starts.
fn starts(exchange: &Exchange, options: &PlanOptions) -> (Vec<ExchangeResult>, Vec<f64>) {
    let count = if *options.criterion == Criterion::I { MEAN_STARTS } else { STARTS };
    let mut results: Vec<ExchangeResult> = (0..count)
        .into_par_iter()
        .map(|start| {
            let chosen = choose(
                exchange.candidates(),
                options.poses,
                options.seed,
                START_STREAM + start as u64,
            );
            exchange.improve(chosen, |sweep, value| options.report(Some(start + 1), sweep, value))
        })
        .collect();
    let values = results.iter().map(ExchangeResult::value).collect();
    results.sort_by(|a, b| a.value().total_cmp(&b.value()));
    (results, values)
}

/// Poses selected by an exchange.
struct Selection {
    poses: Measurements,
    sensitivity: Sensitivity,
    /// Logarithm of the criterion.
    value: f64,
    /// Number of candidates tried in refinement.
    tried: usize,
}

impl Selection {
    /// Returns the selection with the smallest value, the first of equal ones.
    fn best(selections: Vec<Self>) -> Option<Self> {
        selections
            .into_iter()
            .reduce(|best, next| if next.value < best.value { next } else { best })
    }

    /// Refines the poses in rounds of exchanges. The candidates of a round are variations of the
    /// present poses, ever closer to them. `number` selects the random streams.
    fn refined(
        mut self,
        site: &Site,
        (ranges, goal): (&PoseRanges, Option<&WorkspaceGoal>),
        exchange: &Exchange,
        (options, number): (&PlanOptions, u64),
    ) -> Self {
        let is_of_cameras = site.is_of_cameras(&self.poses);
        let count = if is_of_cameras { CAMERA_ROUND_CANDIDATES } else { ROUND_CANDIDATES };
        let variations = (count / options.poses).max(1);
        for (round, reach) in (0..).zip(REFINEMENT_REACHES) {
            let stream = REFINEMENT_STREAM + number * REFINEMENT_REACHES.len() as u64 + round;
            let streams = (options.seed, stream);
            let varied = ranges.vary(site.problem(), &self.poses, variations, reach, streams);
            let sensitivity = site.sensitivity(&varied, None);
            let inside: Vec<usize> = match options.workspace {
                Some(workspace) => site.inside(&varied, workspace),
                None => (0..varied.len()).collect(),
            };
            // Each present pose precedes its variations.
            let is_present = |k: usize| k.is_multiple_of(variations + 1);
            let is_usable = |k: usize| sensitivity.is_finite(k) && inside.binary_search(&k).is_ok();
            let kept: Vec<usize> =
                (0..varied.len()).filter(|&k| is_present(k) || is_usable(k)).collect();
            let present = (0..kept.len()).filter(|&k| is_present(kept[k])).collect();
            let sensitivity = sensitivity.select(&kept);
            let extended = goal.map(|goal| {
                goal.misfit.with_misfit_rows(site, &varied.select(&kept), &sensitivity, None)
            });
            let result = exchange
                .with_candidates(extended.as_ref().unwrap_or(&sensitivity))
                .improve(present, |sweep, value| options.report(None, sweep, value));
            self.tried += kept.len() - options.poses;
            self.value = result.value();
            self.poses = varied.select(&result.chosen.iter().map(|&k| kept[k]).collect::<Vec<_>>());
            self.sensitivity = sensitivity.select(&result.chosen);
        }
        self
    }
}

impl Plan {
    /// Returns the median standard error of parameter k over the random sets, SI; `None` if more
    /// than half of the sets do not inform on it.
    pub(crate) fn random_error(&self, k: usize) -> Option<f64> {
        let errors = self.random.iter().map(|forecast| forecast.expected[k].std_error);
        median(errors.map(|error| error.unwrap_or(f64::INFINITY))).filter(|error| error.is_finite())
    }

    /// Returns the indices of the arm parameters that random poses identify to 90 % or more (median
    /// over the sets).
    #[doc(hidden)]
    pub fn meaningful(&self) -> Vec<usize> {
        let share =
            |k: usize| median(self.random.iter().map(|forecast| forecast.expected[k].identified));
        let arm = |k: &usize| !self.planned.expected[*k].is_placement;
        (0..self.planned.expected.len())
            .filter(arm)
            .filter(|&k| share(k).is_some_and(|share| share >= Forecast::WELL_IDENTIFIED))
            .collect()
    }

    /// Returns the ratio of the standard errors of random poses to those of the plan, above 1 if
    /// the plan is better. It is the geometric mean over these parameters; `None` if no parameter
    /// has both errors.
    #[doc(hidden)]
    pub fn gain(&self, parameters: &[usize]) -> Option<f64> {
        let ratios: Vec<f64> = parameters
            .iter()
            .filter_map(|&k| {
                Some((self.random_error(k)? / self.planned.expected[k].std_error?).ln())
            })
            .collect();
        (!ratios.is_empty()).then(|| (ratios.iter().sum::<f64>() / ratios.len() as f64).exp())
    }
}

/// Returns `count` distinct random numbers from 0..`available` (all of them if there are fewer), in
/// random order.
pub(super) fn choose(available: usize, count: usize, seed: u64, stream: u64) -> Vec<usize> {
    shuffled(available, count, &mut random::stream(seed, stream))
}

fn shuffled(available: usize, count: usize, random: &mut impl Rng) -> Vec<usize> {
    let mut numbers: Vec<usize> = (0..available).collect();
    numbers.partial_shuffle(random, count.min(available)).0.to_vec()
}
