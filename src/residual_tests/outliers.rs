//! Search for outliers: poses whose residual is too large to be noise.

use nalgebra::{DVector, Vector3};
use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use super::chance::Chance;
use super::fit_residual::FitResidual;
use super::judgement::{Trial, Tried};
use super::leverage::{Kept, Leverage, Others, each_left_out};
use super::outcome::{Test, Untestable};

/// A round of the search removes at most one pose in this many, and at least one. Large outliers
/// distort the fit and hide smaller ones, so few are removed at a time.
const POSES_PER_REMOVAL: usize = 100;
/// At most one pose in this many can be an outlier. If more have large residuals, the noise itself
/// has heavy tails.
const MIN_POSES_PER_OUTLIER: usize = 5;

/// Result of a search for outliers.
pub(super) struct Found<'a> {
    /// Outlier test of the pose with the largest F statistic, before any pose is removed.
    pub tried: Tried,
    /// Fit to the poses without the outliers; `None` if there are no outliers.
    pub kept: Option<Kept<'a>>,
}

/// Finds outliers and refits without them, those with the largest F first.
///
/// For pose b with studentised residual e_b and k measured numbers, F = |e_b|² / (k s²). The
/// variance s² is that of the fit without b, with ν degrees of freedom. F has the F distribution
/// with k and ν degrees of freedom for any σ (approximately so with priors). A pose is an outlier
/// if N times the upper tail probability of F is at most `level` [Cook and Weisberg 1982, section
/// 2.2; Bonferroni]. The search ends before more than one pose in five would be removed, because
/// the noise then has heavy tails.
pub(super) fn find<'a>(fit: &FitResidual<'a>, leverage: &Leverage, level: f64) -> Found<'a> {
    let poses = fit.residual.len() / 3;
    let mut f_statistics = f_statistics(leverage, fit.residual);
    let mut kept: Option<Kept> = None;
    let tried = test(&f_statistics);
    let mut out = vec![false; poses];
    loop {
        let outliers = largest_outliers(&f_statistics, level);
        if outliers.is_empty() {
            break;
        }
        let pose_of = |number: usize| kept.as_ref().map_or(number, |kept| kept.poses[number]);
        let before = out.clone();
        for number in outliers {
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
        f_statistics = self::f_statistics(&rest.leverage, &rest.residual);
        kept = Some(rest);
    }
    Found { tried, kept }
}

/// F statistic of a pose with its null distribution.
struct FStatistic {
    ratio: f64,
    distribution: FisherSnedecor,
}

/// Returns the F statistic of each pose; `None` if the other poses leave no degrees of freedom.
fn f_statistics(leverage: &Leverage, residual: &DVector<f64>) -> Vec<Option<FStatistic>> {
    let rounding = f64::EPSILON * residual.norm_squared();
    let f_statistic = |((residual, others), &numbers): ((Vector3<f64>, Others), &usize)| {
        let numbers = numbers as f64;
        let distribution = FisherSnedecor::new(numbers, others.freedom).ok()?;
        let residual = residual.norm_squared();
        let variance = others.squares.max(rounding) / others.freedom;
        Some(FStatistic {
            ratio: if residual > 0.0 { residual / numbers / variance } else { 0.0 },
            distribution,
        })
    };
    let studentised = leverage.studentise(residual.as_slice());
    studentised
        .into_iter()
        .zip(each_left_out(leverage, residual))
        .zip(&leverage.coordinates)
        .map(f_statistic)
        .collect()
}

/// Returns the outlier test, whose statistic is the largest F of all poses.
fn test(f_statistics: &[Option<FStatistic>]) -> Tried {
    let testable = f_statistics
        .iter()
        .enumerate()
        .filter_map(|(pose, f_statistic)| Some((pose, f_statistic.as_ref()?)));
    let Some((worst, f_statistic)) = testable.max_by(|a, b| a.1.ratio.total_cmp(&b.1.ratio)) else {
        return Tried { test: Test::Outliers { worst: None }, trial: Err(Untestable::NoFreedom) };
    };
    let chance =
        Chance::Fisher { distribution: f_statistic.distribution, of: f_statistics.len() as f64 };
    let trial = Trial { statistic: f_statistic.ratio, chance, shown: |ratio| (3.0 * ratio).sqrt() };
    Tried { test: Test::Outliers { worst: Some(worst) }, trial: Ok(trial) }
}

/// Returns the indices of outliers among the tested poses, the largest F first, at most as many as
/// one round removes.
fn largest_outliers(f_statistics: &[Option<FStatistic>], level: f64) -> Vec<usize> {
    let count = f_statistics.len();
    let outliers = |(number, f_statistic): (usize, &Option<FStatistic>)| {
        let FStatistic { ratio, distribution } = f_statistic.as_ref()?;
        (!ratio.is_nan() && count as f64 * distribution.sf(*ratio) <= level)
            .then_some((number, *ratio))
    };
    let mut outliers: Vec<(usize, f64)> =
        f_statistics.iter().enumerate().filter_map(outliers).collect();
    outliers.sort_by(|a, b| b.1.total_cmp(&a.1));
    outliers.truncate((count / POSES_PER_REMOVAL).max(1));
    outliers.into_iter().map(|(number, _)| number).collect()
}
