//! Search for the noise σ of a fit: the declared one, or its restricted maximum likelihood (REML)
//! estimate if residuals and priors contradict the declared one.

use nalgebra::DVector;

use crate::fit::stages::active_limits::confine;
use crate::fit::stages::fitting::{FitEnd, Fitting};
use crate::fit::stages::noise_model::{MIN_SIGMA, NoiseModel, by_chance};
use crate::fit::stages::stage::{Stage, StageError};
use crate::fit::uncertainty::statistics::Statistics;
use crate::least_squares::solver::Termination;
use crate::least_squares::{
    Fit, Loss, MANY_UNKNOWNS, Objective as _, VarianceLikelihood, residual_vector,
};
use crate::model::Pose;
use crate::problem::Observation;

/// Relative change of an estimated σ at which its search has converged, if none is declared.
const NOISE_TOLERANCE: f64 = 1e-3;
/// Relative change of an estimated σ at which its search has converged, if the declared one is
/// contradicted. Standard errors need no more accuracy.
const SCALE_TOLERANCE: f64 = 0.01;
/// Number of steps after which a joint fit tests its declared σ for the first time. If the σ is
/// contradicted, the optimum with that σ is not needed.
const STEPS_BEFORE_NOISE_TEST: u64 = 30;
/// Maximum number of fits in the search for σ.
const MAX_NOISE_FITS: usize = 20;
/// Minimum number of degrees of freedom with which a declared σ is lowered at the usual critical
/// value. With fewer, a residual that is small by chance (probability near 0.001) would make
/// standard errors more than 2.5 times too small.
const MIN_FREEDOM_TO_LOWER: f64 = 12.0;
/// Multiple of the critical value above which a declared σ is lowered with fewer degrees of
/// freedom. Noise exceeds it with a probability below 1e-10; computed positions, which have all
/// digits, do.
const LOWERING_FACTOR: f64 = 5.0;
/// Noise models of positions and of orientations with which a fit assumes the declared σ.
const DECLARED_NOISE: (NoiseModel, NoiseModel) = (NoiseModel::DECLARED, NoiseModel::DECLARED);
/// Multiple of the critical value [`by_chance`] of the likelihood-ratio statistic, above which a
/// declared σ is certainly wrong.
const REJECTION_FACTOR: f64 = 10.0;

/// Source of the σ of the measurements.
#[doc(hidden)]
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Noise {
    /// Declared by `position_sigma` or the column `sigma`.
    Declared,
    /// Not declared, but estimated from the scatter of the residuals: 1 σ of a coordinate \[m\].
    Estimated(f64),
    /// Neither declared nor estimated, because the fit has no degrees of freedom.
    Unknown,
}

/// Runs the strategy until the noise σ has converged. The σ is the declared one, or its restricted
/// maximum likelihood estimate if residuals and priors contradict it. If none is declared, σ is
/// estimated from the scatter of the residuals. `judged` is true if the poses suffice to contradict
/// a declared σ.
///
/// A fit may start with the noise models that an earlier fit assumed. It keeps them as long as the
/// declared σ is certainly contradicted.
pub(in crate::fit) fn fitted(
    fitting: &mut Fitting,
    start: &DVector<f64>,
    (has_declared_noise, judged): (bool, bool),
) -> Result<(FitEnd, Statistics, Noise), StageError> {
    let mut fits = 0;
    let mut begin = start.clone();
    let mut early = fitting.whole().unknowns.len() >= MANY_UNKNOWNS;
    let mut taken_over = (fitting.noise_model, fitting.turn_noise_model) != DECLARED_NOISE;
    loop {
        fits += 1;
        let limit = fitting.max_steps;
        let assumed = (fitting.noise_model, fitting.turn_noise_model);
        let single = fitting.strategy.stages().len() == 1;
        let first =
            fits == 1 && has_declared_noise && judged && single && assumed == DECLARED_NOISE;
        if first {
            fitting.max_steps = Some(
                limit.map_or(STEPS_BEFORE_NOISE_TEST, |limit| limit.min(STEPS_BEFORE_NOISE_TEST)),
            );
            fitting.to_be_judged = std::mem::take(&mut early);
        }
        let end = fitting.run(&begin)?;
        let judged_early = std::mem::take(&mut fitting.to_be_judged);
        fitting.max_steps = limit;
        let whole = fitting.whole();
        if has_declared_noise {
            if taken_over && !(judged && is_beyond_doubt(&whole)) {
                (fitting.noise_model, fitting.turn_noise_model) = DECLARED_NOISE;
                (taken_over, fits, begin) = (false, 0, end.x);
                continue;
            }
            let next = if judged { next_noise_models(&whole, &end, assumed)? } else { None };
            match next.filter(|_| fits < MAX_NOISE_FITS) {
                Some(next) => {
                    (fitting.noise_model, fitting.turn_noise_model) = next;
                    if judged_early {
                        // The fit has not converged. Its σ is tested again, like a σ that an
                        // earlier fit assumed.
                        taken_over = is_beyond_doubt(&fitting.whole());
                        if !taken_over {
                            (fitting.noise_model, fitting.turn_noise_model) = DECLARED_NOISE;
                        }
                    }
                    // A fit with combinations held at their start, or one that diverged because its
                    // σ was too small, starts again.
                    let went_well = end.termination.converged()
                        || end.termination == Termination::IterationLimit;
                    begin = if went_well && end.gauge.rows.nrows() == 0 {
                        end.x
                    } else {
                        start.clone()
                    };
                }
                None if judged_early && end.termination.converged() => {
                    begin = if end.gauge.rows.nrows() == 0 { end.x } else { start.clone() }
                }
                None if first
                    && end.iterations >= STEPS_BEFORE_NOISE_TEST
                    && !end.termination.converged() =>
                {
                    begin = end.x;
                }
                None => {
                    let statistics = Statistics::new(&whole, &end, Some(fitting.noise_model))?;
                    return Ok((end, statistics, Noise::Declared));
                }
            }
            continue;
        }
        let statistics = Statistics::new(&whole, &end, None)?;
        let next = (fitting.sigma * statistics.reduced_chi2.map_or(1.0, f64::sqrt)).max(MIN_SIGMA);
        let settled = (next - fitting.sigma).abs() < NOISE_TOLERANCE * fitting.sigma;
        if settled || fits == MAX_NOISE_FITS {
            let noise = match statistics.reduced_chi2 {
                Some(_) => Noise::Estimated(fitting.sigma),
                None => Noise::Unknown,
            };
            return Ok((end, statistics, noise));
        }
        fitting.sigma = next;
    }
}

/// Returns true if the noise variance that a stage assumes, r times the declared one, certainly
/// contradicts the declared one. The test statistic is 2 ln of the likelihood ratio, ν (r − 1 − ln
/// r) with ν degrees of freedom. It must exceed [`REJECTION_FACTOR`] times its critical value.
fn is_beyond_doubt(stage: &Stage) -> bool {
    let ratios = stage
        .poses
        .iter()
        .zip(&stage.declared)
        .map(|(pose, declared)| (pose.sigma / declared).powi(2));
    let ratio = ratios.sum::<f64>() / stage.poses.len().max(1) as f64;
    let freedom = stage.count().saturating_sub(stage.unknowns.len()) as f64;
    freedom * (ratio - 1.0 - ratio.ln()) > REJECTION_FACTOR * by_chance()
}

/// Returns the noise models of positions and orientations for the next fit, or `None` if the
/// `assumed` ones are kept. Poses that a robust loss treats as outliers are left out.
///
/// The declared σ is contradicted if 2 ln of the likelihood ratio exceeds its critical value (χ²₁)
/// at probability 0.001. With few degrees of freedom, a declared σ is lowered only on far more
/// evidence.
fn next_noise_models(
    stage: &Stage,
    end: &FitEnd,
    assumed: (NoiseModel, NoiseModel),
) -> Result<Option<(NoiseModel, NoiseModel)>, StageError> {
    let of_fit = || Statistics::new(stage, end, Some(assumed.0));
    let robust = if stage.loss == Loss::Squares { None } else { Some(of_fit()?) };
    let counts =
        |place: &usize| robust.as_ref().is_none_or(|fit| fit.lengths.outlying(*place).is_none());
    let places: Vec<usize> = (0..stage.poses.len()).filter(counts).collect();
    let poses: Vec<Pose> = places.iter().map(|&place| stage.poses[place]).collect();
    let several_kinds =
        poses.iter().any(|pose| pose.observation.kind() != poses[0].observation.kind());
    let unmoved = stage.unmoved(&end.x);
    let count = poses.iter().map(Pose::coordinates).sum::<usize>() - unmoved.count() * poses.len();
    let turned = 3 * poses.iter().filter(|pose| pose.orientation.is_some()).count();
    let are_all_poses = poses.len() == stage.poses.len();
    let residuals = stage.residuals_of(poses, &end.x);
    let x = residuals.unknowns_in(&end.x);
    let data = if are_all_poses {
        stage.linearised(&end.x, Loss::Squares)
    } else {
        Fit::new(&residuals).linearise(&x)
    };
    let priors = stage.prior_sigmas();
    let mut held: Vec<bool> = end.at_bound.iter().map(Option::is_some).collect();
    let closed = confine(&data.triangle, &end.gauge.rows, &stage.held(&end.x)?, &mut held);
    let whitened = residual_vector(&residuals, &x);
    let unmoved_squares = unmoved.squares(whitened.as_slice(), stage.coordinates());
    let rows = (count, (2.0 * data.cost - unmoved_squares).max(0.0));
    let likelihood = VarianceLikelihood::new(&data, rows, &x, &priors, &held, &closed);
    let (ratio, gain) = likelihood.maximum();
    if !ratio.is_finite() {
        return Ok(None);
    }
    let first = assumed == DECLARED_NOISE;
    let shares = mean_square_ratios(&whitened, stage.coordinates(), [count - turned, turned]);
    // The σ of positions and that of orientations must both have converged.
    let settled = shares.iter().all(|share| ((ratio * share).sqrt() - 1.0).abs() < SCALE_TOLERANCE);
    let is_lowered_by_few = ratio < 1.0 && likelihood.freedom() < MIN_FREEDOM_TO_LOWER;
    let chance = by_chance() * if is_lowered_by_few { LOWERING_FACTOR } else { 1.0 };
    if (first && gain <= chance) || (!first && settled) {
        return Ok(None);
    }
    let of = |value: &dyn Fn(usize) -> f64| {
        let of_arm = places.iter().filter(|&&place| stage.poses[place].observation.is_of_arm());
        of_arm.map(|&place| value(place)).collect::<Vec<f64>>()
    };
    // One model error can apply to all rows only if all rows measure the same kind of quantity.
    let raised = if several_kinds { NoiseModel::scaled } else { NoiseModel::raised };
    let of_position = raised(
        &of(&|place| stage.declared[place]),
        &of(&|place| stage.poses[place].sigma),
        ratio * shares[0],
    );
    let assumed_turn =
        |place: usize| stage.poses[place].orientation.map_or(1.0, |orientation| orientation.sigma);
    let of_turn = match stage.declared_turn {
        Some(sigma) => NoiseModel::raised(&of(&|_| sigma), &of(&assumed_turn), ratio * shares[1]),
        None => NoiseModel::DECLARED,
    };
    let next = (of_position, of_turn);
    Ok((next != assumed).then_some(next))
}

/// Returns the mean squares of the whitened residuals of positions and of orientations, each
/// divided by the mean square of all. Both are 1 if only positions are fitted. `coordinates` is the
/// number of residuals per pose, `counts` those of measured coordinates of positions and
/// orientations.
fn mean_square_ratios(whitened: &DVector<f64>, coordinates: usize, counts: [usize; 2]) -> [f64; 2] {
    if coordinates == 3 {
        return [1.0; 2];
    }
    let sum = |part: fn(&[f64]) -> &[f64]| -> f64 {
        whitened.as_slice().chunks_exact(coordinates).flat_map(part).map(|r| r * r).sum()
    };
    let sums = [sum(|r| &r[..3]), sum(|r| &r[3..])];
    let mean = |sum: f64, count: usize| sum / count.max(1) as f64;
    let (position, turn) = (mean(sums[0], counts[0]), mean(sums[1], counts[1]));
    let mean_of_both = mean(sums[0] + sums[1], counts[0] + counts[1]);
    if mean_of_both > 0.0 { [position / mean_of_both, turn / mean_of_both] } else { [1.0; 2] }
}

/// Returns the mean noise variance that a stage assumed, relative to the declared one, and the root
/// mean square of the σ that it assumed for the rows of `kind`. Known distances between points are
/// left out, because they keep their declared σ.
pub(in crate::fit) fn assumed_noise(stage: &Stage, kind: Observation) -> (f64, f64) {
    let rows =
        stage.poses.iter().zip(&stage.declared).filter(|(pose, _)| pose.observation.is_of_arm());
    let (poses, declared): (Vec<&Pose>, Vec<f64>) = rows.unzip();
    let assumed = together(poses.iter().map(|pose| pose.sigma));
    let of_kind =
        poses.iter().filter(|pose| pose.observation.kind() == kind.kind()).map(|pose| pose.sigma);
    (
        (assumed / together(declared.into_iter())).powi(2),
        together(of_kind.collect::<Vec<f64>>().into_iter()),
    )
}

/// Returns the root mean square of several σ.
pub(in crate::fit) fn together(sigmas: impl ExactSizeIterator<Item = f64>) -> f64 {
    let n = sigmas.len().max(1) as f64;
    (sigmas.map(|sigma| sigma * sigma).sum::<f64>() / n).sqrt()
}
