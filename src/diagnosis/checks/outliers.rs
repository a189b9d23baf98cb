//! Poses that are too far off to be noise.

use nalgebra::Vector3;
use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use super::Remainder;
use super::chance::Chance;
use super::deletion::Kept;
use super::judgement::{ALPHA, Trial, Tried};
use super::leverage::Leverage;
use super::outcome::{Test, Untestable};

/// Poses left out in one round: one in so many, at least one. Large outliers pull the fit off others and hide smaller ones.
const ONE_A_ROUND_IN: usize = 100;
/// More than one pose in so many is no outlier.
const ONE_IN: usize = 5;

/// What a search for outliers found.
pub(super) struct Found {
    /// The test of the pose that is farthest off, with all poses present.
    pub tried: Tried,
    /// The poses without the outliers; `None` where there are none.
    pub kept: Option<Kept>,
}

/// Leaves out poses that are too far off, the farthest first.
///
/// Of pose b with studentised residual eᵦ, F = (|eᵦ|² / 3) / s², s² = (‖r‖² − |eᵦ|²) / (ν − 3) is the variance of the others'
/// fit, so that F has the F distribution with 3 and ν − 3 degrees of freedom whatever σ is; it is too far off where
/// N P(F) < 0.01 [Cook and Weisberg 1982, section 2.2; Bonferroni]. Nearly so with priors. Where more than one
/// pose in five is, the rest stays in: that is no outlier, but what the noise is like.
pub(super) fn find(remainder: &Remainder, studentised: &[Vector3<f64>], leverage: &Leverage) -> Found {
    let poses = studentised.len();
    let untested = |why| Found { tried: Tried { test: Test::Outliers { worst: None }, trial: Err(why) }, kept: None };
    let Ok(distribution) = FisherSnedecor::new(3.0, leverage.freedom - 3.0) else {
        return untested(Untestable::NoFreedom);
    };
    let all = ratios(studentised, remainder.residual.norm_squared(), leverage.freedom);
    let Some((worst, statistic)) = all.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1)) else {
        return untested(Untestable::TooFewPoses);
    };
    let chance = Chance::Fisher { distribution, of: poses as f64 };
    let trial = Ok(Trial { statistic, chance, shown: |ratio| (3.0 * ratio).sqrt() });
    let tried = Tried { test: Test::Outliers { worst: Some(worst) }, trial };

    let mut out = vec![false; poses];
    let mut kept = None;
    let mut far = too_far(&all, &(0..poses).collect::<Vec<_>>(), leverage.freedom);
    while !far.is_empty() {
        far.iter().for_each(|&pose| out[pose] = true);
        if out.iter().filter(|&&out| out).count() > (poses / ONE_IN).max(1) {
            break;
        }
        let Some(rest) = Kept::without(remainder, &out) else { break };
        let studentised = rest.leverage.studentise(rest.residual.as_slice());
        let ratios = ratios(&studentised, rest.residual.norm_squared(), rest.leverage.freedom);
        far = too_far(&ratios, &rest.poses, rest.leverage.freedom);
        kept = Some(rest);
    }
    Found { tried, kept }
}

/// Those of some poses with the largest F that are too far off, as many as leave in one round.
fn too_far(ratios: &[f64], poses: &[usize], freedom: f64) -> Vec<usize> {
    let Ok(distribution) = FisherSnedecor::new(3.0, freedom - 3.0) else { return Vec::new() };
    let count = poses.len();
    let mut ranked: Vec<usize> = (0..count).collect();
    ranked.sort_by(|&a, &b| ratios[b].total_cmp(&ratios[a]));
    let is_far = |&number: &usize| count as f64 * distribution.sf(ratios[number]) < ALPHA;
    ranked.into_iter().take((count / ONE_A_ROUND_IN).max(1)).take_while(is_far).map(|number| poses[number]).collect()
}

/// F of each pose; 0 of a pose that the fit always meets.
fn ratios(studentised: &[Vector3<f64>], squares: f64, freedom: f64) -> Vec<f64> {
    let ratio = |value: &Vector3<f64>| {
        let own = value.norm_squared();
        let others = (squares - own).max(f64::EPSILON * squares) / (freedom - 3.0);
        if own > 0.0 { own / 3.0 / others } else { 0.0 }
    };
    studentised.iter().map(ratio).collect()
}
