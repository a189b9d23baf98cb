//! Search for outliers: poses whose residual is too large to be noise.

use nalgebra::{DVector, Vector3};
use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use super::chance::Chance;
use super::fit_residual::FitResidual;
use super::judgement::{Trial, Tried};
use super::leverage::{Kept, Leverage, Others, each_left_out};
use super::outcome::{Test, Untestable};

/// Reciprocal of the share of the poses that is removed in one round (at least one pose). Large
/// outliers distort the fit and hide smaller ones, so few are removed at a time.
const POSES_PER_REMOVAL: usize = 100;
/// Reciprocal of the largest share of poses that can be outliers. If more have large residuals, the
/// noise itself has heavy tails.
const MIN_POSES_PER_OUTLIER: usize = 5;

/// Result of a search for outliers.
pub(super) struct Found<'a> {
    /// Outlier test of the pose with the largest F statistic, before any pose is removed.
    pub tried: Tried,
    /// Fit to the poses without the outliers; `None` if there are no outliers.
    pub kept: Option<Kept<'a>>,
}

/// Finds outliers and refits without them, the farthest first.
///
/// For pose b with studentised residual e_b and k measured numbers, F = |e_b|² / (k s²). The
/// variance s² is that of the fit without b, with ν degrees of freedom. F has the F distribution
/// with k and ν degrees of freedom for any σ (approximately so with priors). A pose is an outlier
/// if N P(F) ≤ `level` [Cook and Weisberg 1982, section 2.2; Bonferroni]. At most one pose in five
/// can be an outlier; beyond that, the noise has heavy tails, and the remaining poses stay in.
pub(super) fn find<'a>(fit: &FitResidual<'a>, leverage: &Leverage, level: f64) -> Found<'a> {
    let poses = fit.residual.len() / 3;
    let mut distances = distances(leverage, fit.residual);
    let mut kept: Option<Kept> = None;
    let tried = test(&distances);
    let mut out = vec![false; poses];
    loop {
        let far = farthest_outliers(&distances, level);
        if far.is_empty() {
            break;
        }
        let pose_of = |number: usize| kept.as_ref().map_or(number, |kept| kept.poses[number]);
        let before = out.clone();
        for number in far {
            out[pose_of(number)] = true;
        }
        if out.iter().filter(|&&out| out).count() > (poses / MIN_POSES_PER_OUTLIER).max(1) {
            break;
        }
        // The previous fit is dropped first to free its memory; it is formed again if no fit
        // without the outliers exists.
        let had_some = kept.take().is_some();
        let Some(rest) = Kept::without(fit, &out) else {
            kept = had_some.then(|| Kept::without(fit, &before)).flatten();
            break;
        };
        distances = self::distances(&rest.leverage, &rest.residual);
        kept = Some(rest);
    }
    Found { tried, kept }
}

/// F statistic of a pose with its null distribution.
struct Distance {
    ratio: f64,
    distribution: FisherSnedecor,
}

/// Returns the F statistic of each pose; `None` if the other poses leave no degrees of freedom.
fn distances(leverage: &Leverage, residual: &DVector<f64>) -> Vec<Option<Distance>> {
    let rounding = f64::EPSILON * residual.norm_squared();
    let distance = |((residual, others), &numbers): ((Vector3<f64>, Others), &usize)| {
        let numbers = numbers as f64;
        let distribution = FisherSnedecor::new(numbers, others.freedom).ok()?;
        let residual = residual.norm_squared();
        let variance = others.squares.max(rounding) / others.freedom;
        Some(Distance {
            ratio: if residual > 0.0 { residual / numbers / variance } else { 0.0 },
            distribution,
        })
    };
    let studentised = leverage.studentise(residual.as_slice());
    studentised
        .into_iter()
        .zip(each_left_out(leverage, residual))
        .zip(&leverage.coordinates)
        .map(distance)
        .collect()
}

/// Returns the outlier test, whose statistic is the largest distance.
fn test(distances: &[Option<Distance>]) -> Tried {
    let testable = distances
        .iter()
        .enumerate()
        .filter_map(|(pose, distance)| Some((pose, distance.as_ref()?)));
    let Some((worst, distance)) = testable.max_by(|a, b| a.1.ratio.total_cmp(&b.1.ratio)) else {
        return Tried { test: Test::Outliers { worst: None }, trial: Err(Untestable::NoFreedom) };
    };
    let chance = Chance::Fisher { distribution: distance.distribution, of: distances.len() as f64 };
    let trial = Trial { statistic: distance.ratio, chance, shown: |ratio| (3.0 * ratio).sqrt() };
    Tried { test: Test::Outliers { worst: Some(worst) }, trial: Ok(trial) }
}

/// Returns the outliers, the farthest first, at most as many as one round removes.
fn farthest_outliers(distances: &[Option<Distance>], level: f64) -> Vec<usize> {
    let count = distances.len();
    let far = |(number, distance): (usize, &Option<Distance>)| {
        let Distance { ratio, distribution } = distance.as_ref()?;
        (!ratio.is_nan() && count as f64 * distribution.sf(*ratio) <= level)
            .then_some((number, *ratio))
    };
    let mut far: Vec<(usize, f64)> = distances.iter().enumerate().filter_map(far).collect();
    far.sort_by(|a, b| b.1.total_cmp(&a.1));
    far.truncate((count / POSES_PER_REMOVAL).max(1));
    far.into_iter().map(|(number, _)| number).collect()
}
