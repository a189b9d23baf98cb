//! Poses that are too far off to be noise.

use nalgebra::{DVector, Vector3};
use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use super::chance::Chance;
use super::fit_residual::FitResidual;
use super::judgement::{Trial, Tried};
use super::leverage::{Kept, Leverage, Others, each_left_out};
use super::outcome::{Test, Untestable};

/// Number of poses for each pose left out in one round, at least one. Large outliers pull the fit
/// off others and hide smaller ones.
const ONE_A_ROUND_IN: usize = 100;
/// Smallest number of poses for each outlier: where more are far off, they are no outliers.
const ONE_IN: usize = 5;

/// Result of a search for outliers.
pub(super) struct Found<'a> {
    /// Returns the test of the pose that is farthest off.
    pub tried: Tried,
    /// The poses without the outliers; `None` where there are none.
    pub kept: Option<Kept<'a>>,
}

/// Leaves out poses that are too far off, the farthest first.
///
/// Of pose b with studentised residual e_b, F = |e_b|² / k s² with its k numbers, where s² is the
/// variance of what a fit without b leaves of its ν degrees of freedom: it has the F distribution
/// with k and ν of them, whatever σ is (nearly so with priors). The pose is too far off where N
/// P(F) ≤ `level` [Cook and Weisberg 1982, section 2.2; Bonferroni]. Where more than one pose in
/// five is, the rest stays in: that is no outlier, but what the noise is like.
pub(super) fn find<'a>(fit: &FitResidual<'a>, leverage: &Leverage, level: f64) -> Found<'a> {
    let poses = fit.residual.len() / 3;
    let mut distances = distances(leverage, fit.residual);
    let mut kept: Option<Kept> = None;
    let tried = test(&distances);
    let mut out = vec![false; poses];
    loop {
        let far = too_far(&distances, level);
        if far.is_empty() {
            break;
        }
        let pose_of = |number: usize| kept.as_ref().map_or(number, |kept| kept.poses[number]);
        let before = out.clone();
        for number in far {
            out[pose_of(number)] = true;
        }
        if out.iter().filter(|&&out| out).count() > (poses / ONE_IN).max(1) {
            break;
        }
        // These make room for the next, and are formed anew where there are none.
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

/// F statistic of a pose and its distribution.
struct Distance {
    ratio: f64,
    distribution: FisherSnedecor,
}

/// Returns the F statistic of each pose; `None` where the other poses leave no degrees of freedom.
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

/// The test of the pose that is farthest off.
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

/// Returns the poses that are too far off, the farthest first, at most as many as one round leaves
/// out.
fn too_far(distances: &[Option<Distance>], level: f64) -> Vec<usize> {
    let count = distances.len();
    let far = |(number, distance): (usize, &Option<Distance>)| {
        let Distance { ratio, distribution } = distance.as_ref()?;
        (!ratio.is_nan() && count as f64 * distribution.sf(*ratio) <= level)
            .then_some((number, *ratio))
    };
    let mut far: Vec<(usize, f64)> = distances.iter().enumerate().filter_map(far).collect();
    far.sort_by(|a, b| b.1.total_cmp(&a.1));
    far.truncate((count / ONE_A_ROUND_IN).max(1));
    far.into_iter().map(|(number, _)| number).collect()
}
