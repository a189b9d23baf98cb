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
use crate::fit::stages::parameter_size::plausible_size;
use crate::fit::stages::stage::{Stage, StageError};
use crate::fit::uncertainty::noise::{Noise, fitted};
use crate::fit::uncertainty::statistics::Statistics;
use crate::fit::{SolverChoice, Strategy};
use crate::least_squares::{jacobian_and_residual, residual_vector};
use crate::model::PoseResiduals;
use crate::model::parameter::Parameter;
use crate::quantity::Unit;

/// Largest number of predicted rows of a rigid arm in the search for starts, which takes about a
/// hundredth of a second. Problems with more rows or unknowns are not searched.
const MAX_PREDICTIONS: usize = 100_000;
/// Number of predictions of a rigid arm that take as long as one of an arm that gives way, with its
/// equilibrium.
const RIGID_PREDICTIONS_PER_ELASTIC: usize = 50;
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
/// Maximum number of times that a better solution replaces the optimum.
const MAX_REPLACEMENTS: usize = 3;
/// Least difference of a parameter, in standard errors, that makes two solutions. Chance alone
/// exceeds it three times in a thousand.
const MIN_DISTANCE: f64 = 3.0;
/// Difference of an angle \[rad\] from which two solutions are two descriptions of one arm: whole
/// turns, and half turns of neighbouring axes.
const MAX_ANGLE: f64 = 3.0;
/// Smallest probability of a second solution that is reported: that of a χ² larger by 13.8.
const MIN_PROBABILITY: f64 = 1e-3;

/// Second optimum of a fit, which the measurements do not exclude.
#[derive(Debug, Clone)]
pub(in crate::fit) struct SecondSolution {
    /// Full parameter vector of the second solution: the deviation of each parameter from nominal.
    pub x: DVector<f64>,
    /// Excess of χ², with priors, over that of the fit; for an estimated σ that of −2 ln of the
    /// likelihood.
    pub excess: f64,
}

impl SecondSolution {
    /// Returns the probability that this solution is the true one of two that are equally probable
    /// before the measurements.
    pub fn probability(&self) -> f64 {
        (1.0 + (0.5 * self.excess).exp()).recip()
    }
}

/// Parameter that differs most between two solutions, as an index of an unknown, and the difference
/// in standard errors of the first.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::fit) struct Distance {
    pub unknown: usize,
    pub standard_errors: f64,
}

/// Result of [`fitted`]: the end of a fit with its statistics and the source of its σ.
type Fitted = (FitEnd, Statistics, Noise);

/// Takes the best optimum that is found from `first`, and the second best if the measurements do
/// not exclude it. `flags`: whether a σ is declared, and whether the poses suffice to contradict it.
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
        let whole = fitting.whole();
        let found = neighbours(fitting, &best)?;
        let cost = whole.cost(&best.0.x);
        let better = found.iter().filter(|x| whole.cost(x) < cost);
        let next = better.min_by(|a, b| whole.cost(a).total_cmp(&whole.cost(b))).cloned();
        others.extend(found);
        let Some(next) = next else { break };
        let replacement = fitted(fitting, &next, flags)?;
        others.push(std::mem::replace(&mut best, replacement).0.x);
    }
    let second = rival(&fitting.whole(), &best, fitting.noise_model, others);
    Ok((best, second))
}

/// Returns true if the fit has an optimum and standard errors, and few enough rows and unknowns.
fn is_searched(fitting: &Fitting, (end, _, noise): &Fitted) -> bool {
    let whole = fitting.whole();
    let gives_way = fitting.model.arm(|k| end.x[k]).is_elastic();
    let weight = if gives_way { RIGID_PREDICTIONS_PER_ELASTIC } else { 1 };
    fitting.strategy != Strategy::OneSweep
        && end.termination.converged()
        && *noise != Noise::Unknown
        && 4 * weight * whole.unknowns.len() * whole.poses.len() <= MAX_PREDICTIONS
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

/// Returns the best of `others` that is another solution than `best` and not excluded.
fn rival(
    whole: &Stage,
    (end, statistics, noise): &Fitted,
    noise_model: NoiseModel,
    others: Vec<DVector<f64>>,
) -> Option<SecondSolution> {
    let cost = whole.cost(&end.x);
    let is_estimated = *noise != Noise::Declared || noise_model != NoiseModel::DECLARED;
    let freedom = whole.count().saturating_sub(whole.unknowns.len()).max(1) as f64;
    let excess = |x: &DVector<f64>| {
        let excess = 2.0 * (whole.cost(x) - cost);
        if is_estimated { freedom * (excess / freedom).ln_1p() } else { excess }
    };
    let solutions = others
        .into_iter()
        .filter(|x| distance(whole, statistics, &end.x, x).is_some())
        .map(|x| SecondSolution { excess: excess(&x), x })
        .filter(|solution| solution.probability() > MIN_PROBABILITY);
    solutions.min_by(|a, b| a.excess.total_cmp(&b.excess))
}

/// Returns the parameter that differs most between the optimum `x` and `other`; `None` unless it
/// differs by [`MIN_DISTANCE`] standard errors, or if both describe the same arm.
pub(in crate::fit) fn distance(
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
        let Some(along) = surroundings.mirror(&(column / error)).filter(|_| error > 0.0) else {
            continue;
        };
        // What adjusts the unknowns to b points along the fold, even where other directions
        // contribute to v.
        found.extend(surroundings.mirror(&along.adjusted));
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

/// Residuals and their derivatives at an optimum.
struct Surroundings<'a> {
    stage: &'a Stage<'a>,
    covariance: &'a DMatrix<f64>,
    residuals: PoseResiduals<'a>,
    x: DVector<f64>,
    r: DVector<f64>,
    derivatives: DMatrix<f64>,
    /// Rows of the priors and of earlier data, which are linear in the unknowns.
    linear: DMatrix<f64>,
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

impl<'a> Surroundings<'a> {
    fn new(stage: &'a Stage<'a>, at: &DVector<f64>, covariance: &'a DMatrix<f64>) -> Self {
        let residuals = stage.residuals(at);
        let x = residuals.unknowns_in(at);
        let (derivatives, r) = jacobian_and_residual(&residuals, &x);
        let (priors, earlier) = (stage.priors(), stage.earlier_rows(at).matrix);
        let mut linear = priors.clone().resize_vertically(priors.nrows() + earlier.nrows(), 0.0);
        linear.view_mut((priors.nrows(), 0), earlier.shape()).copy_from(&earlier);
        Self { stage, covariance, residuals, x, r, derivatives, linear }
    }

    /// Returns the change of all rows along a direction: of the data, then of the linear rows.
    fn change(&self, v: &DVector<f64>) -> DVector<f64> {
        let (data, linear) = (&self.derivatives * v, &self.linear * v);
        DVector::from_iterator(data.len() + linear.len(), data.iter().chain(&linear).copied())
    }

    /// Returns the place beyond the fold along the direction v; `None` if the rows do not change
    /// along it, or if it leaves the domain of the model.
    fn mirror(&self, v: &DVector<f64>) -> Option<Mirror> {
        let Self { stage, covariance, residuals, x, r, derivatives, .. } = self;
        let slope = self.change(v);
        let length = slope.norm();
        let (v, slope) = (v / length, slope / length);
        let [after, before] = [x + &v, x - &v].map(|x| residual_vector(residuals, &x));
        let bend = after + before - r * 2.0;
        let along = slope.rows(0, bend.len()).dot(&bend);
        let t = -2.0 / along;
        let adjusted = *covariance * derivatives.tr_mul(&bend);
        let taken_up = self.change(&adjusted);
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
