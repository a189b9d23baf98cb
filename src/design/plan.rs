//! The best of several exchanges, beside poses drawn at random.

use rand::Rng;
use rand::seq::SliceRandom as _;
use rayon::prelude::*;

use super::coordinates::{coordinates, first_of_each};
use super::{
    Criterion, DesignError, Exchange, Exchanged, Extremes, Forecast, Sensitivity, Site, Workspace,
};
use crate::measurement::Measurements;
use crate::model::parameter::{Parameter, ParameterSite};
use crate::numeric::median;
use crate::problem::{PoseRanges, Problem};
use crate::random;

/// Candidates drawn from ranges, evenly and with a liking for the ends.
pub(super) const DRAWN: [usize; 2] = [500, 2000];
/// Exchanges, each from poses drawn at random.
const STARTS: usize = 8;
/// The best exchanges that are refined.
const REFINED: usize = 4;
/// Rounds of candidates drawn about the best poses, by how far they lie apart, as a part of the
/// ranges.
const ROUNDS: [f64; 8] = [0.3, 0.2, 0.2, 0.1, 0.1, 0.05, 0.05, 0.02];
/// Candidates of a round.
const ABOUT: usize = 2500;
/// Draws of random poses that a plan is compared with; odd, so that there is a median.
pub(super) const DRAWS: usize = 75;
/// Streams of random numbers of one seed.
pub(super) const EVENLY: u64 = 0;
const AT_ENDS: u64 = 1;
const FIRST_ROUND: u64 = 2;
const FIRST_START: u64 = 100;
pub(super) const FIRST_DRAW: u64 = 200;

/// Where the poses of a plan come from.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Candidates {
    /// Anywhere within ranges.
    Within(PoseRanges),
    /// Rows of a table.
    Rows(Box<Measurements>),
}

/// How to plan.
#[derive(Clone, Copy)]
pub struct PlanOptions<'a> {
    /// Number of poses.
    pub poses: usize,
    /// What to make small.
    pub criterion: &'a Criterion,
    /// Seed of every random number.
    pub seed: u64,
    /// Where the target may go; `None`: anywhere.
    pub workspace: Option<&'a Workspace>,
    /// Told of every sweep; from several threads at once.
    pub progress: Option<&'a (dyn Fn(PlanProgress) + Sync)>,
}

/// How far a plan has come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlanProgress {
    /// Which start, from 1; `None` once the best of them are refined.
    pub start: Option<usize>,
    /// Sweeps of the exchange at hand.
    pub sweep: usize,
    /// ln of the criterion.
    pub value: f64,
}

/// Poses to measure, and what they will tell.
#[derive(Debug, Clone)]
pub struct Plan {
    /// The poses; rows of the table of candidates in its order, if there is one.
    pub poses: Measurements,
    /// Rows that are measured in any case, known distances between points left out.
    pub given: usize,
    /// Number of candidates that were tried.
    pub candidates: usize,
    /// ln of the criterion that each start ended with, before the best of them were refined.
    pub starts: Vec<f64>,
    /// ln of the criterion that was reached.
    pub value: f64,
    /// Of the poses given and the planned ones together.
    pub planned: Forecast,
    /// Combinations of parameters that all candidates together see, priors left out.
    pub attainable_rank: usize,
    /// Planned poses without which they cannot all be seen, whichever poses they are.
    pub least_poses: usize,
    /// Numbers that the poses given and the planned ones measure together.
    pub coordinates: usize,
    /// Of the poses given and as many others, drawn at random again and again.
    pub random: Vec<Forecast>,
    /// Whether the plan decides every parameter as far as all candidates together can, and measures
    /// as many coordinates as parameters have no prior.
    pub suffices: bool,
}

/// Chooses poses by exchange from several starts; the same for the same seed, however many threads
/// there are.
///
/// Within ranges, candidates are drawn, and then drawn again ever closer about the best poses.
/// Poses in `given` are measured in any case.
///
/// # Errors
/// There are fewer candidates than poses, or the problem does not say enough.
pub fn plan(
    problem: &Problem,
    candidates: &Candidates,
    given: Option<&Measurements>,
    options: &PlanOptions,
) -> Result<Plan, DesignError> {
    let PlanOptions { poses, criterion, seed, .. } = *options;
    if poses == 0 {
        return Err(DesignError::NoPoses);
    }
    let draw = |ranges: &PoseRanges, count, extremes, stream| {
        ranges.draw(problem, count, extremes, seed, stream)
    };
    let given = with_known_distances(given, candidates);
    let given = given.as_ref();
    let (usual, ends) = match candidates {
        Candidates::Within(ranges) => {
            let ends = draw(ranges, DRAWN[1].max(2 * poses), Extremes::Often, AT_ENDS);
            (draw(ranges, DRAWN[0].max(2 * poses), Extremes::No, EVENLY), Some(ends))
        }
        Candidates::Rows(rows) => (rows.as_ref().clone().arm_rows(), None),
    };
    let mut tables = vec![&usual];
    tables.extend(given);
    let site = Site::new(problem, &tables)?;
    let admitted = |(table, told): (Measurements, Sensitivity)| match options.workspace {
        Some(workspace) => {
            let rows = site.inside(&table, workspace);
            (table.select(&rows), told.select(&rows))
        }
        None => (table, told),
    };
    let parameters = &site.model.parameters;
    let of_arm = given.map(|given| given.clone().arm_rows());
    let given = given.map(|given| site.at_rest(given));
    let (measured, given): (Option<Measurements>, Option<Sensitivity>) = given.unzip();
    let (mut table, usual) = admitted(site.at_rest(&usual));
    let mut all = usual.clone();
    if let Some(ends) = ends {
        let (ends, sensitivity) = admitted(site.at_rest(&ends));
        table = table.concatenate(&ends);
        all = all.and(&sensitivity);
    }
    let tried = all.len();
    if all.is_empty() {
        return Err(DesignError::NoEquilibrium);
    }
    if tried < poses {
        return Err(DesignError::TooFewCandidates { poses, candidates: tried });
    }
    let Forecast { open: attainable, identifiability, .. } = Forecast::new(parameters, &all);
    if identifiability.rank == 0 {
        return Err(DesignError::NothingSeen);
    }
    let attainable = attainable.saturating_sub(untouched(parameters, &[Some(&all)]));
    let (attainable_rank, least_poses) = attainable_rank(parameters, given.as_ref(), &all);
    let exchange = Exchange::new(parameters, &all, given.as_ref(), poses, criterion)
        .ok_or(DesignError::NoEquilibrium)?;
    let (ends, starts) = starts(&exchange, options);
    let begun = |end: &Exchanged| Found {
        poses: table.select(&end.chosen),
        told: all.select(&end.chosen),
        value: end.value(),
        tried: 0,
    };
    let found: Vec<Found> = match candidates {
        Candidates::Within(ranges) => ends[..REFINED.min(ends.len())]
            .par_iter()
            .enumerate()
            .map(|(number, end)| {
                begun(end).refined(problem, &site, ranges, &exchange, (options, number as u64))
            })
            .collect(),
        Candidates::Rows(_) => ends.iter().take(1).map(begun).collect(),
    };
    let tried = tried + found.iter().map(|found| found.tried).sum::<usize>();
    // Of equals the first.
    let best =
        found.into_iter().reduce(|best, next| if next.value < best.value { next } else { best });
    let Found { poses: chosen, told, value, .. } = best.ok_or(DesignError::NoEquilibrium)?;
    let forecast = |own: &Sensitivity| match &given {
        Some(given) => Forecast::new(parameters, &given.and(own)),
        None => Forecast::new(parameters, own),
    };
    let random = (0..DRAWS)
        .into_par_iter()
        .map(|draw| {
            forecast(&usual.select(&choose(usual.len(), poses, seed, FIRST_DRAW + draw as u64)))
        })
        .collect();
    let planned = forecast(&told);
    let of_position = all.coordinates;
    let distinct = |own: &Measurements| {
        coordinates(own, of_position, first_of_each(&own.pose_numbers(problem)))
    };
    let apart = of_arm.as_ref().map_or(0, distinct) + distinct(&chosen);
    let every = |own: &Measurements| coordinates(own, of_position, 0..own.len());
    let coordinates = measured.as_ref().map_or(0, every) + every(&chosen);
    let without_prior = parameters.iter().filter(|parameter| parameter.sigma.is_none()).count();
    let open = planned.open.saturating_sub(untouched(parameters, &[Some(&told), given.as_ref()]));
    let suffices = open <= attainable && apart >= without_prior;
    let given = of_arm.map_or(0, |own| own.len());
    Ok(Plan {
        poses: chosen,
        given,
        candidates: tried,
        starts,
        value,
        planned,
        attainable_rank,
        least_poses,
        coordinates,
        random,
        suffices,
    })
}

/// Combinations that the poses given and all candidates see together, and poses without which they
/// cannot be seen.
fn attainable_rank(
    parameters: &[Parameter],
    given: Option<&Sensitivity>,
    all: &Sensitivity,
) -> (usize, usize) {
    let rank = |own: &Sensitivity| Forecast::new(parameters, own).identifiability.rank;
    let (most, before) =
        given.map_or_else(|| (rank(all), 0), |given| (rank(&given.and(all)), rank(given)));
    (most, most.saturating_sub(before).div_ceil(all.coordinates))
}

/// What is measured in any case, with the known distances between points that only the candidates
/// touch.
fn with_known_distances(
    given: Option<&Measurements>,
    candidates: &Candidates,
) -> Option<Measurements> {
    let Candidates::Rows(rows) = candidates else { return given.cloned() };
    let is_told = |observation| {
        given.is_some_and(|given| (0..given.len()).any(|row| given.observation(row) == observation))
    };
    let known: Vec<usize> = (0..rows.len())
        .filter(|&row| !rows.observation(row).is_of_arm() && !is_told(rows.observation(row)))
        .collect();
    match given {
        _ if known.is_empty() => given.cloned(),
        Some(given) => Some(given.concatenate(&rows.select(&known))),
        None => Some(rows.select(&known)),
    }
}

/// Numbers without a prior of points, anchors and surfaces that none of these rows touches: what is
/// left out need not be found.
fn untouched(parameters: &[Parameter], rows: &[Option<&Sensitivity>]) -> usize {
    let is_seen = |k: usize| {
        rows.iter().flatten().any(|own| own.rows.row(k).iter().any(|slope| *slope != 0.0))
    };
    let is_free =
        |own: &Parameter| matches!(own.site, ParameterSite::Fixture { .. }) && own.sigma.is_none();
    (0..parameters.len()).filter(|&k| is_free(&parameters[k]) && !is_seen(k)).count()
}

impl PlanOptions<'_> {
    fn tell(&self, start: Option<usize>, sweep: usize, value: f64) {
        if let Some(progress) = self.progress {
            progress(PlanProgress { start, sweep, value });
        }
    }
}

/// Every exchange, the best first, and the values in the order of the starts.
fn starts(exchange: &Exchange, options: &PlanOptions) -> (Vec<Exchanged>, Vec<f64>) {
    let mut ends: Vec<Exchanged> = (0..STARTS)
        .into_par_iter()
        .map(|start| {
            let chosen = choose(
                exchange.candidates(),
                options.poses,
                options.seed,
                FIRST_START + start as u64,
            );
            exchange.improve(chosen, |sweep, value| options.tell(Some(start + 1), sweep, value))
        })
        .collect();
    let values = ends.iter().map(Exchanged::value).collect();
    ends.sort_by(|a, b| a.value().total_cmp(&b.value()));
    (ends, values)
}

/// Poses that an exchange has found.
struct Found {
    poses: Measurements,
    told: Sensitivity,
    /// ln of the criterion.
    value: f64,
    /// Candidates tried beyond those of the exchange.
    tried: usize,
}

impl Found {
    /// The same, exchanged for candidates drawn ever closer about them.
    fn refined(
        mut self,
        problem: &Problem,
        site: &Site,
        ranges: &PoseRanges,
        exchange: &Exchange,
        (options, number): (&PlanOptions, u64),
    ) -> Self {
        let each = (ABOUT / options.poses).max(1);
        for (round, reach) in (0..).zip(ROUNDS) {
            let stream = FIRST_ROUND + number * ROUNDS.len() as u64 + round;
            let about = ranges.vary(problem, &self.poses, each, reach, (options.seed, stream));
            let told = site.sensitivity(&about, None);
            let inside: Vec<usize> = match options.workspace {
                Some(workspace) => site.inside(&about, workspace),
                None => (0..about.len()).collect(),
            };
            // The poses themselves come first, each before those about it.
            let is_own = |k: usize| k.is_multiple_of(each + 1);
            let kept: Vec<usize> = (0..about.len())
                .filter(|&k| is_own(k) || (told.is_finite(k) && inside.binary_search(&k).is_ok()))
                .collect();
            let own = (0..kept.len()).filter(|&k| is_own(kept[k])).collect();
            let told = told.select(&kept);
            let end = exchange
                .with_candidates(&told)
                .improve(own, |sweep, value| options.tell(None, sweep, value));
            self.tried += kept.len() - options.poses;
            self.value = end.value();
            self.poses = about.select(&end.chosen.iter().map(|&k| kept[k]).collect::<Vec<_>>());
            self.told = told.select(&end.chosen);
        }
        self
    }
}

impl Plan {
    /// 1 σ of parameter k after random poses, the median of the draws, SI; `None` where most of
    /// them say nothing.
    pub fn random_error(&self, k: usize) -> Option<f64> {
        let errors = self.random.iter().map(|forecast| forecast.expected[k].std_error);
        median(errors.map(|error| error.unwrap_or(f64::INFINITY))).filter(|error| error.is_finite())
    }

    /// The arm's parameters that random poses identify to 90 % or more (median of the draws), by
    /// their numbers.
    pub fn meaningful(&self) -> Vec<usize> {
        let share =
            |k: usize| median(self.random.iter().map(|forecast| forecast.expected[k].identified));
        let arm = |k: &usize| !self.planned.expected[*k].is_placement;
        (0..self.planned.expected.len())
            .filter(arm)
            .filter(|&k| share(k).is_some_and(|share| share >= Forecast::WELL))
            .collect()
    }

    /// By what factor the plan's standard errors are smaller than those of random poses: the
    /// geometric mean over these parameters; `None` without any that both give.
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

/// `count` of `all` numbers (all of them, if there are fewer), in random order.
pub(super) fn choose(all: usize, count: usize, seed: u64, stream: u64) -> Vec<usize> {
    shuffled(all, count, &mut random::stream(seed, stream))
}

fn shuffled(all: usize, count: usize, random: &mut impl Rng) -> Vec<usize> {
    let mut numbers: Vec<usize> = (0..all).collect();
    numbers.partial_shuffle(random, count.min(all)).0.to_vec()
}
