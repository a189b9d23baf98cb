//! Poses that are too far off to be noise.

use nalgebra::Vector3;
use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use super::Remainder;
use super::chance::Chance;
use super::deletion::Kept;
use super::judgement::{ALPHA, Trial, Tried};
use super::leverage::Leverage;
use super::outcome::{Test, Untestable};

/// Rounds of leaving out outliers, since large ones hide small ones.
const ROUNDS: usize = 5;
/// More than one pose in so many is no outlier.
const ONE_IN: usize = 5;

/// What a search for outliers found.
pub(super) struct Found {
    /// The test of the pose that is farthest off, with all poses present.
    pub tried: Tried,
    /// The poses without the outliers; `None` where there are none.
    pub kept: Option<Kept>,
}

/// Leaves out poses that are too far off, round by round.
///
/// Of pose b with studentised residual eᵦ, F = (|eᵦ|² / 3) / s², s² = (‖r‖² − |eᵦ|²) / (ν − 3) is the variance of the others'
/// fit, so that F has the F distribution with 3 and ν − 3 degrees of freedom whatever σ is; it is too far off where
/// N P(F) < 0.01 [Cook and Weisberg 1982, section 2.2; Bonferroni].
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
    let mut kept: Option<Kept> = None;
    for _ in 0..ROUNDS {
        let (present, ratios, freedom) = match &kept {
            None => ((0..poses).collect(), all.clone(), leverage.freedom),
            Some(kept) => {
                let studentised = kept.leverage.studentise(kept.residual.as_slice());
                let freedom = kept.leverage.freedom;
                (kept.poses.clone(), ratios(&studentised, kept.residual.norm_squared(), freedom), freedom)
            }
        };
        let Ok(distribution) = FisherSnedecor::new(3.0, freedom - 3.0) else { break };
        let too_far = |ratio: f64| present.len() as f64 * distribution.sf(ratio) < ALPHA;
        let far: Vec<usize> =
            present.iter().zip(&ratios).filter(|&(_, &ratio)| too_far(ratio)).map(|(&pose, _)| pose).collect();
        let gone = poses - present.len() + far.len();
        if far.is_empty() || gone > (poses / ONE_IN).max(1) {
            break;
        }
        far.iter().for_each(|&pose| out[pose] = true);
        let Some(without) = Kept::without(remainder, &out) else { break };
        kept = Some(without);
    }
    Found { tried, kept }
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
