//! Test of whether an arm meets a tolerance, with a stated probability of a wrong pass.

use statrs::distribution::{Binomial, DiscreteCDF as _};

use crate::numeric::bisect;

/// Number of bisections of the interval 0…1 by which a confidence bound of a share is found.
const BISECTIONS: usize = 50;
/// Number of poses at which the search for a sufficient number of poses ends.
const MAX_POSES: usize = 1_000_000;

/// Requirement on the accuracy of an arm: a given share of its poses has an error of at most a
/// tolerance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Tolerance: largest error of a pose that meets the requirement \[m\].
    pub length: f64,
    /// Share of all poses of the arm that must meet the tolerance, between 0 and 1.
    pub share: f64,
    /// Largest acceptable probability of a wrong pass, if a smaller share of all poses meets the
    /// tolerance; between 0 and 1.
    pub risk: f64,
}

/// Result of the test of a tolerance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// At least the required share of all poses is within the tolerance. The probability of a wrong
    /// pass is at most [`Tolerance::risk`].
    Pass,
    /// A smaller share than required of all poses is within the tolerance. The probability of a
    /// wrong failure is at most [`Tolerance::risk`].
    Fail,
    /// The tested poses are too few to decide.
    Undecided,
}

impl Verdict {
    /// Returns the word for the verdict in result files.
    pub fn as_str(self) -> &'static str {
        match self {
            Self::Pass => "pass",
            Self::Fail => "fail",
            Self::Undecided => "undecided",
        }
    }
}

/// Exact binomial test of a tolerance, on the errors of poses that were not used in the fit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToleranceTest {
    /// Requirement that is tested.
    pub tolerance: Tolerance,
    /// Result of the test.
    pub verdict: Verdict,
    /// Number of tested poses.
    pub poses: usize,
    /// Number of tested poses with an error above the tolerance, or without a prediction.
    pub beyond: usize,
    /// Lower and upper confidence bound of the share of all poses that are within the tolerance.
    /// Each bound is wrong with a probability of at most [`Tolerance::risk`]. [Clopper & Pearson
    /// 1934]
    pub share_within: [f64; 2],
    /// Number of tested poses at which the test would pass with the present number of poses beyond
    /// the tolerance; `None` if a million poses are too few.
    pub poses_to_pass: Option<usize>,
}

impl Tolerance {
    /// Tests the requirement on the errors of some poses \[m\]; NaN is beyond any tolerance.
    ///
    /// The poses must be drawn in the same way as those that the arm will take. The number beyond
    /// the tolerance then has a binomial distribution, whatever the distribution of the errors.
    /// Measurement noise counts as an error of the arm.
    pub fn test(self, errors: &[f64]) -> ToleranceTest {
        let poses = errors.len();
        // An error that is not a number meets no tolerance.
        let beyond = poses - errors.iter().filter(|error| **error <= self.length).count();
        let least = lower_bound(poses, poses - beyond, self.risk);
        let most = 1.0 - lower_bound(poses, beyond, self.risk);
        let verdict = match () {
            () if least >= self.share => Verdict::Pass,
            () if most < self.share => Verdict::Fail,
            () => Verdict::Undecided,
        };
        let passes = |count: &usize| at_most(*count, beyond, 1.0 - self.share) <= self.risk;
        let mut count = poses.max(beyond + 1);
        while !passes(&count) && count < MAX_POSES {
            count *= 2;
        }
        let poses_to_pass = passes(&count).then(|| {
            let (mut below, mut above) = (0, count);
            while above - below > 1 {
                let middle = below.midpoint(above);
                if passes(&middle) { above = middle } else { below = middle }
            }
            above
        });
        ToleranceTest {
            tolerance: self,
            verdict,
            poses,
            beyond,
            share_within: [least, most],
            poses_to_pass,
        }
    }
}

/// Returns the binomial probability that at most `beyond` of `poses` are beyond the tolerance, if
/// each pose is beyond it with this `probability`.
fn at_most(poses: usize, beyond: usize, probability: f64) -> f64 {
    if beyond >= poses {
        return 1.0;
    }
    Binomial::new(probability.clamp(0.0, 1.0), poses as u64)
        .map_or(1.0, |distribution| distribution.cdf(beyond as u64))
}

/// Returns the lower confidence bound of a share if `within` of `poses` are within the tolerance.
/// It is above the true share at most with the probability `risk`.
fn lower_bound(poses: usize, within: usize, risk: f64) -> f64 {
    // P(at most n − w beyond the tolerance) rises from 0 to 1 with the share within it.
    let is_unlikely = |share: f64| at_most(poses, poses - within, 1.0 - share) <= risk;
    if within == 0 { 0.0 } else { bisect(is_unlikely, (0.0, 1.0), BISECTIONS).0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn test(poses: usize, beyond: usize, share: f64) -> ToleranceTest {
        let errors: Vec<f64> = (0..poses).map(|k| if k < beyond { 2.0 } else { 0.5 }).collect();
        Tolerance { length: 1.0, share, risk: 0.05 }.test(&errors)
    }

    #[test]
    fn few_poses_decide_nothing_and_the_number_that_would_is_told() {
        // The probabilities of no pose beyond the tolerance are 0.9²⁸ = 0.052 and 0.9²⁹ = 0.047.
        let [few, enough] = [28, 29].map(|poses| test(poses, 0, 0.9));
        assert_eq!((few.verdict, few.poses_to_pass), (Verdict::Undecided, Some(29)));
        assert_eq!((enough.verdict, enough.poses_to_pass), (Verdict::Pass, Some(29)));
        assert!((enough.share_within[0] - 0.05_f64.powf(1.0 / 29.0)).abs() < 1e-9);
        assert!((enough.share_within[1] - 1.0).abs() < 1e-15);
        assert_eq!(test(50, 30, 0.9).verdict, Verdict::Fail);
        // The reference is the table of Clopper and Pearson for 45 of 50, one-sided 95 %: 0.8008
        // and 0.9583.
        let [least, most] = test(50, 5, 0.9).share_within;
        assert!((least - 0.801).abs() < 2e-3 && (most - 0.960).abs() < 3e-3, "{least} {most}");
        assert_eq!(test(0, 0, 0.9).verdict, Verdict::Undecided);
    }

    #[test]
    fn wrong_passes_are_no_more_than_the_risk() {
        // Exactly 90 % of all poses are within the tolerance. A pass then has the probability that
        // few of the tested poses are beyond it.
        for poses in [10, 29, 50, 100, 321] {
            let passing = (0..poses).filter(|&k| test(poses, k, 0.9).verdict == Verdict::Pass);
            let most = passing.max();
            let probability = most.map_or(0.0, |most| at_most(poses, most, 0.1));
            assert!(probability <= 0.05, "{poses}: {probability}");
        }
    }
}
