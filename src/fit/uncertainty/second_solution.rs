//! Search for a second arm that explains the measurements as well as the fitted one.
//!
//! Where a few rows see a parameter only by its square, as the twist of an axis whose first-order
//! effect the base takes up, two values of it explain them: the optimum in which a fit ends, and
//! its mirror image beyond the fold at which the derivatives vanish. Standard errors describe the
//! surroundings of one optimum and say nothing about the other.
//!
//! Along a direction v the residual is r + t a + ½ t² b, with a = J v and the second derivative b =
//! r″(v, v). The part of b along a [parameter-effects curvature, Bates & Watts 1980] returns to the
//! first residual at t = −2 |a|² / a·b. The part of b that no parameters take up [intrinsic
//! curvature] is what the rows then still tell. A fit is started there if that part is small.

use std::ops::AddAssign as _;

use nalgebra::{DMatrix, DVector};

use crate::fit::stages::fitting::{FitEnd, Fitting};
use crate::fit::stages::noise_model::NoiseModel;
use crate::fit::stages::parameter_size::{largest_deviation, plausible_size};
use crate::fit::stages::stage::{Stage, StageError};
use crate::fit::uncertainty::curvature::refute_errors;
use crate::fit::uncertainty::noise::{Noise, fitted};
use crate::fit::uncertainty::statistics::Statistics;
use crate::fit::uncertainty::surroundings::{Surroundings, rigid_predictions};
use crate::fit::{SolverChoice, Strategy};
use crate::model::parameter::Parameter;
use crate::quantity::Unit;

/// Largest number of predicted rows of a rigid arm in the search for starts, which takes about a
/// hundredth of a second. Problems with more rows or unknowns are not searched.
const MAX_PREDICTIONS: usize = 100_000;
/// Largest increase of χ², foretold by the curvature, at which a fit is started. Far from the
/// optimum the second derivatives are not constant, so that fits that end near it are foretold up
/// to 2000; without a second solution it is 10 000 and more.
const MAX_FORETOLD_EXCESS: f64 = 5000.0;
/// Largest deviation, in σ of its prior, of a parameter at a start. It is four times the largest
/// that is trusted, because a parabola exaggerates the distance by up to that.
const MAX_PRIOR_SIGMAS: f64 = 20.0;
/// Largest change of a parameter without a prior at a start, in plausible deviations.
const MAX_SIZES: f64 = 4.0;
/// Largest cosine of the changes of all rows along two directions that count as different.
const MAX_SAME_DIRECTION: f64 = 0.9;
/// Maximum number of fits from one optimum: one for each of the best starts.
const MAX_FITS: usize = 3;
/// Maximum number of steps of such a fit. From the far side of a fold 4 to 10 are enough.
const MAX_STEPS: u64 = 15;
/// Maximum number of times that a more probable solution replaces the optimum.
const MAX_REPLACEMENTS: usize = 3;
/// Least difference of a parameter, in standard errors, that makes two solutions. Chance alone
/// exceeds it three times in a thousand.
const MIN_DISTANCE: f64 = 3.0;
/// Difference of an angle \[rad\] from which two solutions are two descriptions of one arm: whole
/// turns, and half turns of neighbouring axes.
const MAX_ANGLE: f64 = 3.0;
/// Largest share of χ² by which another solution counts as better if σ is estimated.
const LARGEST_SHARE: f64 = 1.0 - 1e-9;
/// Smallest probability of a second solution that is reported.
const MIN_PROBABILITY: f64 = 1e-3;
/// Logarithm of the odds (19 to 1) from which one of two solutions is decided.
const LN_DECISIVE_ODDS: f64 = 2.944_438_979_166_44;

/// Second optimum of a fit, which the measurements do not exclude.
#[derive(Debug, Clone)]
pub(in crate::fit) struct SecondSolution {
    /// Full parameter vector of the second solution: the deviation of each parameter from nominal.
    pub x: DVector<f64>,
    /// Unknown in which it differs most from the fit, in standard errors.
    pub most: usize,
    /// Excess of χ², with priors, over that of the fit; for an estimated σ that of −2 ln of the
    /// likelihood.
    pub excess: f64,
    /// Logarithm of the ratio of its distance from the nominal arm to that of the fit.
    ln_farther: f64,
}

impl SecondSolution {
    /// Returns the probability that this solution is the true one of the two.
    pub fn probability(&self) -> f64 {
        (1.0 + (-self.ln_odds()).exp()).recip()
    }

    /// Returns true if this solution is improbable because it lies far from the nominal arm.
    pub fn is_too_far(&self) -> bool {
        self.ln_farther > LN_DECISIVE_ODDS && self.ln_odds() < -LN_DECISIVE_ODDS
    }

    /// Returns the logarithm of the odds that this solution is the true one rather than that of the
    /// fit. Before the measurements they are those of a prior without a scale [Jeffreys 1946] for
    /// the distance from the nominal arm: n times as far is 1/n times as probable.
    fn ln_odds(&self) -> f64 {
        -0.5 * self.excess - self.ln_farther
    }
}

/// Parameter that differs most between two solutions, as an index of an unknown, and the difference
/// in standard errors of the first.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Distance {
    unknown: usize,
    standard_errors: f64,
}

/// Result of [`fitted`]: the end of a fit with its statistics and the source of its σ.
type Fitted = (FitEnd, Statistics, Noise);

/// Takes the most probable optimum that is found from `first`, and the second one if the
/// measurements do not exclude it. Standard errors that the curvature of the model refutes are
/// marked. `flags`: whether a σ is declared, and whether the poses suffice to contradict it.
pub(in crate::fit) fn best_of_two(
    fitting: &mut Fitting,
    first: Fitted,
    flags: (bool, bool),
) -> Result<(Fitted, Option<SecondSolution>), StageError> {
    let mut best = first;
    let mut others: Vec<DVector<f64>> = Vec::new();
    for _ in 0..MAX_REPLACEMENTS {
        if !is_searched(fitting, &best) {
            break;
        }
        let found = neighbours(fitting, &best)?;
        let whole = fitting.whole();
        let compared = |x: &DVector<f64>| compared(&whole, &best, fitting.noise_model, x.clone());
        let better = found.iter().map(compared).filter(|solution| solution.ln_odds() > 0.0);
        let next = better.max_by(|a, b| a.ln_odds().total_cmp(&b.ln_odds()));
        others.extend(found);
        let Some(next) = next else { break };
        let replacement = fitted(fitting, &next.x, flags)?;
        others.push(std::mem::replace(&mut best, replacement).0.x);
    }
    let second = rival(&fitting.whole(), &best, fitting.noise_model, others);
    refute_errors(fitting, &best.0, &mut best.1);
    Ok((best, second))
}

/// Returns true if the fit has an optimum and standard errors, and few enough rows and unknowns.
fn is_searched(fitting: &Fitting, (end, _, noise): &Fitted) -> bool {
    fitting.strategy != Strategy::OneSweep
        && end.termination.converged()
        && *noise != Noise::Unknown
        && 4 * fitting.whole().unknowns.len() * rigid_predictions(fitting, end) <= MAX_PREDICTIONS
}

/// Returns the other optima to which the curvature at an optimum leads.
fn neighbours(fitting: &Fitting, best: &Fitted) -> Result<Vec<DVector<f64>>, StageError> {
    let (end, statistics, _) = best;
    let solver = SolverChoice::Auto.decide(fitting.model);
    let stage = Stage { solver, max_steps: MAX_STEPS, progress: None, ..fitting.whole() };
    let mut found: Vec<DVector<f64>> = Vec::new();
    for start in starts(&stage, &end.x, &statistics.covariance).into_iter().take(MAX_FITS) {
        let other = stage.run(&start)?;
        let is_other = other.solution.termination.converged()
            && distance(&stage, statistics, &end.x, &other.x).is_some();
        if is_other {
            found.push(other.x);
        }
    }
    Ok(found)
}

/// Returns the most probable of `others` that is another solution than `best` and that the
/// measurements do not exclude.
fn rival(
    whole: &Stage,
    best: &Fitted,
    noise_model: NoiseModel,
    others: Vec<DVector<f64>>,
) -> Option<SecondSolution> {
    let solutions = others
        .into_iter()
        .filter_map(|x| {
            let most = distance(whole, &best.1, &best.0.x, &x)?.unknown;
            Some(SecondSolution { most, ..compared(whole, best, noise_model, x) })
        })
        .filter(|solution| solution.probability() > MIN_PROBABILITY);
    solutions.max_by(|a, b| a.ln_odds().total_cmp(&b.ln_odds()))
}

/// Compares the solution `x` with `best`. The distance from the nominal arm is the largest
/// deviation of a parameter without a prior.
fn compared(
    whole: &Stage,
    (end, statistics, noise): &Fitted,
    noise_model: NoiseModel,
    x: DVector<f64>,
) -> SecondSolution {
    let is_estimated = *noise != Noise::Declared || noise_model != NoiseModel::DECLARED;
    let freedom = whole.count().saturating_sub(whole.unknowns.len()).max(1) as f64;
    let excess = 2.0 * (whole.cost(&x) - whole.cost(&end.x));
    let excess = if is_estimated {
        freedom * (excess / freedom).max(-LARGEST_SHARE).ln_1p()
    } else {
        excess
    };
    let [near, other] = [&end.x, &x].map(|x| largest_departure(whole, statistics, x));
    let ln_farther = if near > 0.0 { (other / near).ln() } else { 0.0 };
    SecondSolution { x, most: 0, excess, ln_farther }
}

/// Returns the largest deviation from nominal, as a share of the largest possible one, of the
/// determined parameters without a prior. A deviation counts as at least its standard error.
/// Returns 0 if there is no such parameter.
fn largest_departure(stage: &Stage, statistics: &Statistics, x: &DVector<f64>) -> f64 {
    let departure = |(unknown, (&k, parameter)): (usize, (&usize, &Parameter))| {
        let is_judged = parameter.sigma.is_none() && statistics.determined[unknown];
        let largest = largest_deviation(stage.model, parameter).filter(|_| is_judged)?;
        Some(x[k].abs().max(statistics.errors[unknown]) / largest)
    };
    let unknowns = stage.unknowns.iter().zip(stage.parameters()).enumerate();
    unknowns.filter_map(departure).fold(0.0, f64::max)
}

/// Returns the parameter that differs most between the optimum `x` and `other`; `None` unless it
/// differs by [`MIN_DISTANCE`] standard errors, or if both describe the same arm.
fn distance(
    stage: &Stage,
    statistics: &Statistics,
    x: &DVector<f64>,
    other: &DVector<f64>,
) -> Option<Distance> {
    let mut most: Option<Distance> = None;
    for (unknown, (&k, parameter)) in stage.unknowns.iter().zip(stage.parameters()).enumerate() {
        let moved = (other[k] - x[k]).abs();
        if parameter.unit() == Unit::Angle && moved > MAX_ANGLE {
            return None;
        }
        let error = statistics.errors[unknown];
        if !statistics.determined[unknown] || error <= 0.0 {
            continue;
        }
        let standard_errors = moved / error;
        if most.is_none_or(|most| standard_errors > most.standard_errors) {
            most = Some(Distance { unknown, standard_errors });
        }
    }
    most.filter(|most| most.standard_errors > MIN_DISTANCE)
}

/// Returns full parameter vectors from which a fit may end in another optimum than `at`, the most
/// promising first.
fn starts(stage: &Stage, at: &DVector<f64>, covariance: &DMatrix<f64>) -> Vec<DVector<f64>> {
    let surroundings = Surroundings::new(stage, at, covariance);
    let mut found: Vec<Mirror> = Vec::new();
    for (j, column) in covariance.column_iter().enumerate() {
        let error = covariance[(j, j)].max(0.0).sqrt();
        let Some(along) = mirror(&surroundings, &(column / error)).filter(|_| error > 0.0) else {
            continue;
        };
        // What adjusts the unknowns to b points along the fold, even where other directions
        // contribute to v.
        found.extend(mirror(&surroundings, &along.adjusted));
        found.push(along);
    }
    found.retain(|mirror| mirror.is_plausible && mirror.foretold < MAX_FORETOLD_EXCESS);
    found.sort_by(|a, b| a.foretold.total_cmp(&b.foretold));
    let mut chosen: Vec<Mirror> = Vec::new();
    for mirror in found {
        if chosen.iter().all(|other| other.slope.dot(&mirror.slope).abs() < MAX_SAME_DIRECTION) {
            chosen.push(mirror);
        }
    }
    chosen.into_iter().map(|mirror| stage.full_vector(at, &mirror.start)).collect()
}

/// Place beyond a fold, along one direction from an optimum.
struct Mirror {
    /// Unknowns at the mirrored solution, as far as second derivatives tell.
    start: DVector<f64>,
    /// True if a built arm may have the unknowns of the mirrored solution.
    is_plausible: bool,
    /// Increase of χ² there, as far as second derivatives tell.
    foretold: f64,
    /// Change of all whitened residuals along the mirrored direction, a vector of unit length.
    slope: DVector<f64>,
    /// Least-squares adjustment of the unknowns to b, scaled to a change of all rows by 1.
    adjusted: DVector<f64>,
}

/// Returns the place beyond the fold along the direction v; `None` if the rows do not change
/// along it, or if it leaves the domain of the model.
fn mirror(surroundings: &Surroundings, v: &DVector<f64>) -> Option<Mirror> {
    let Surroundings { stage, x, r, .. } = surroundings;
    let slope = surroundings.change(v);
    let length = slope.norm();
    let (v, slope) = (v / length, slope / length);
    let bend = surroundings.bend(&v);
    let along = slope.rows(0, bend.len()).dot(&bend);
    let t = -2.0 / along;
    let adjusted = surroundings.adjusted(&bend);
    let taken_up = surroundings.change(&adjusted);
    let mut left = -&taken_up;
    left.rows_mut(0, bend.len()).add_assign(&bend);
    let foretold = 0.25 * t.powi(4) * left.norm_squared() + t * t * r.dot(&bend);
    let start = x + &v * t - (&adjusted - &v * along) * (0.5 * t * t);
    let adjusted = adjusted / taken_up.norm();
    let is_finite = foretold.is_finite()
        && start.iter().chain(&adjusted).chain(&slope).all(|value| value.is_finite());
    let is_plausible = is_plausible(stage, x, &(v * t));
    is_finite.then_some(Mirror { start, is_plausible, foretold, slope, adjusted })
}

/// Returns true if the unknowns `x`, moved by `step`, may be those of a built arm.
fn is_plausible(stage: &Stage, x: &DVector<f64>, step: &DVector<f64>) -> bool {
    let is_near = |(parameter, (x, step)): (&Parameter, (&f64, &f64))| match parameter.sigma {
        Some(sigma) => (x + step).abs() <= MAX_PRIOR_SIGMAS * sigma,
        None => {
            plausible_size(stage.model, parameter).is_none_or(|size| step.abs() <= MAX_SIZES * size)
        }
    };
    stage.parameters().zip(x.iter().zip(step)).all(is_near)
}
