//! Bounds that the errors of predicted positions do not exceed with a given probability.

use std::collections::BTreeMap;

use statrs::function::beta::ln_beta;

use super::correction::{CorrectedPose, Correction};
use crate::measurement::Measurements;
use crate::quantity::format::percent_of;

/// Probability of as many exceeded bounds by chance below which the bounds are contradicted.
const MIN_CHANCE_OF_EXCESS: f64 = 0.01;

/// Number of probabilities between 0 and 1 at which quantiles of errors are computed.
const CHANCES: usize = 1000;
/// Number of halvings of the interval in which a bound is sought.
const HALVINGS: usize = 40;

/// Uncertainty of predicted poses, and error bounds that hold with the probability `level`.
#[derive(Debug, Clone)]
pub struct Bounds {
    /// Probability with which a bound holds, 0 to 1.
    pub level: f64,
    /// Correction and uncertainty of the prediction in each pose. Covariances are scaled by the
    /// errors of left-out configurations, as bounds are.
    pub poses: Vec<CorrectedPose>,
    /// Upper bound of the error length in each pose \[m\].
    lengths: Vec<f64>,
    /// Ratio of the root mean square of left-out errors to their predicted lengths; 1 if no
    /// configuration was left out.
    scale: f64,
    /// Number of configurations whose left-out errors determine the bounds.
    learned_from: usize,
    /// Reduced χ² of the fit if its residuals are larger than the declared noise; `None` if they are
    /// not, or no noise is declared.
    pub(crate) misfit: Option<f64>,
}

/// Error bounds with the errors of measured positions that they are compared with.
#[derive(Debug, Clone, Copy)]
pub struct Compared<'a> {
    /// Error bounds with which the errors of a table's rows are compared.
    pub bounds: &'a Bounds,
    /// Row and error length \[m\] of each row that measures a position.
    pub errors: &'a [(usize, f64)],
    /// Comparison with the rows that were not fitted; `None` if there are none.
    pub test: Option<&'a BoundTest>,
}

/// Comparison of error bounds with the errors of configurations that were not fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundTest {
    /// Probability with which a bound holds, 0 to 1.
    pub level: f64,
    /// Number of configurations whose mean error does not exceed their bound.
    pub within: usize,
    /// Number of configurations that have an error and a bound.
    pub of: usize,
    /// Number of fitted configurations on which the bounds rest.
    pub learned_from: usize,
    /// Factor by which the bounds were widened after this comparison, at least 1.
    pub widened: f64,
}

impl BoundTest {
    /// Returns the number of configurations that exceed their bound.
    pub fn beyond(&self) -> usize {
        self.of - self.within
    }

    /// Returns the number of configurations that are expected to exceed their bound.
    pub fn expected_beyond(&self) -> f64 {
        (1.0 - self.level) * self.of as f64
    }

    /// Returns the probability that by chance at least as many errors exceed their bounds.
    ///
    /// The share of errors beyond a quantile of n errors has a beta distribution with the
    /// parameters (1 − level)(n + 1) and level (n + 1), so their number has a beta-binomial
    /// distribution.
    pub fn chance(&self) -> f64 {
        let (n, of) = (self.learned_from as f64 + 1.0, self.of as f64);
        let (a, b) = ((1.0 - self.level) * n, self.level * n);
        let probability = |beyond: usize| {
            let k = beyond as f64;
            let ln_choices = -(of + 1.0).ln() - ln_beta(of - k + 1.0, k + 1.0);
            (ln_choices + ln_beta(k + a, of - k + b) - ln_beta(a, b)).exp()
        };
        (1.0 - (0..self.beyond()).map(probability).sum::<f64>()).clamp(0.0, 1.0)
    }

    /// Returns true if more configurations exceed their bounds than chance explains.
    pub fn is_contradicted(&self) -> bool {
        self.beyond() > 0 && self.chance() < MIN_CHANCE_OF_EXCESS
    }
}

impl Bounds {
    /// Creates the bounds at probability `level` for poses that `correction` corrected.
    pub fn new(correction: &Correction, mut poses: Vec<CorrectedPose>, level: f64) -> Self {
        let scores = &correction.scores;
        let factor = scores.quantile(level);
        let lengths = poses.iter().map(|pose| factor * pose.size + pose.aside).collect();
        let scale = scores.scale().unwrap_or(1.0);
        for pose in &mut poses {
            pose.covariance *= scale * scale;
            pose.size = pose.size.hypot(pose.aside / scale);
        }
        Self { level, poses, lengths, scale, learned_from: scores.configurations, misfit: None }
    }

    /// Returns the bounds for the case that, with the probability `share`, each pose errs by
    /// another `differences` \[m\] in addition.
    ///
    /// The bound b is the smallest with (1 − w) P(e ≤ b) + w P(e ≤ b − d) ≥ `level`, for the share w,
    /// the difference d and the error e, whose quantiles `quantile` returns as multiples of its
    /// expected length.
    #[must_use]
    pub(super) fn with_differences(
        mut self,
        quantile: impl Fn(f64) -> f64,
        share: f64,
        differences: &[f64],
    ) -> Self {
        let chance_of = |k: usize| k as f64 / CHANCES as f64;
        let quantiles: Vec<f64> = (0..CHANCES).map(|k| quantile(chance_of(k))).collect();
        let chance = |ratio: f64| {
            chance_of(quantiles.partition_point(|known| *known <= ratio).saturating_sub(1))
        };
        let level = self.level;
        let poses = self.poses.iter_mut().zip(&mut self.lengths).zip(differences);
        for ((pose, length), difference) in poses {
            let holds = |bound: f64| {
                let [without, with] =
                    [bound, bound - difference].map(|bound| chance(bound / pose.size));
                (1.0 - share) * without + share * with >= level
            };
            let (mut low, mut high) = (0.0, *length + difference);
            for _ in 0..HALVINGS {
                let middle = f64::midpoint(low, high);
                if holds(middle) {
                    high = middle;
                } else {
                    low = middle;
                }
            }
            *length = high;
            pose.size = pose.size.hypot(share.sqrt() * difference);
        }
        self
    }

    /// Returns the bounds for the case that each pose errs by `differences` \[m\] in addition.
    #[must_use]
    pub(super) fn with_uncorrected(mut self, differences: &[f64]) -> Self {
        let poses = self.poses.iter_mut().zip(&mut self.lengths).zip(differences);
        for ((pose, length), difference) in poses {
            *length += difference;
            pose.size = pose.size.hypot(difference / self.scale);
        }
        self
    }

    /// Returns the bounds with the reduced χ² of a fit whose residuals are larger than noise.
    #[must_use]
    pub fn with_misfit(self, misfit: Option<f64>) -> Self {
        Self { misfit, ..self }
    }

    /// Returns the bounds of some of the poses.
    pub(crate) fn of_poses(&self, chosen: &[usize]) -> Self {
        Self {
            poses: chosen.iter().map(|&pose| self.poses[pose]).collect(),
            lengths: chosen.iter().map(|&pose| self.lengths[pose]).collect(),
            ..*self
        }
    }

    /// Compares the bounds with errors that were not fitted. `errors` has for each of them the
    /// index of its pose in these bounds, its row in `table`, and its length \[m\]. Rows of one
    /// configuration err alike, so they count once with their mean error.
    pub fn test(
        &self,
        table: &Measurements,
        errors: impl IntoIterator<Item = (usize, usize, f64)>,
    ) -> BoundTest {
        let mut excesses: BTreeMap<Vec<u64>, f64> = BTreeMap::new();
        for (pose, row, length) in errors {
            let excess = length - self.bound(pose);
            if excess.is_finite() {
                let key = table.configuration(row).iter().map(|q| q.to_bits()).collect();
                *excesses.entry(key).or_default() += excess;
            }
        }
        BoundTest {
            level: self.level,
            within: excesses.values().filter(|excess| **excess <= 0.0).count(),
            of: excesses.len(),
            learned_from: self.learned_from,
            widened: 1.0,
        }
    }

    /// Returns the upper bound of a pose's error length ‖measured − predicted‖ \[m\].
    pub fn bound(&self, pose: usize) -> f64 {
        self.lengths[pose]
    }

    /// Returns the expected root mean square of a pose's error length \[m\]: the predicted one, scaled
    /// by the errors of left-out configurations, as bounds are.
    pub(crate) fn expected_at(&self, pose: usize) -> f64 {
        self.scale * self.poses[pose].size
    }

    /// Returns the mean of the error bounds over the poses \[m\]; NaN if there are none.
    pub fn mean(&self) -> f64 {
        let bounds = (0..self.poses.len()).map(|pose| self.bound(pose));
        bounds.sum::<f64>() / self.poses.len() as f64
    }

    /// Returns the expected root mean square of the error length over all poses \[m\].
    pub fn expected(&self) -> f64 {
        let squares = (0..self.poses.len()).map(|pose| self.expected_at(pose).powi(2));
        (squares.sum::<f64>() / self.poses.len() as f64).sqrt()
    }

    /// Returns the share of error lengths \[m\] that do not exceed their bounds; NaN if there are
    /// none. Each error has the index of its pose.
    pub fn coverage(&self, errors: impl IntoIterator<Item = (usize, f64)>) -> f64 {
        let within = errors.into_iter().map(|(pose, length)| length <= self.bound(pose));
        let within: Vec<bool> = within.collect();
        within.iter().filter(|within| **within).count() as f64 / within.len() as f64
    }

    /// Returns the name of the bounds' column in tables, for example `bound95_mm` at a level of
    /// 0.95.
    pub fn column(&self) -> String {
        format!("bound{}_mm", percent_of(self.level))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix3, Vector3};

    use super::*;

    #[test]
    fn bounds_that_too_many_configurations_exceed_are_contradicted() {
        let (level, learned_from, widened) = (0.95, 28, 1.0);
        let test = |within, of| BoundTest { level, within, of, learned_from, widened };
        assert!([(50, 50), (41, 50), (0, 0)].iter().all(|&(k, n)| !test(k, n).is_contradicted()));
        assert!(test(16, 50).is_contradicted());
        assert!((test(50, 50).chance() - 1.0).abs() < 1e-12);
        assert!((test(41, 50).chance() - 0.0306).abs() < 1e-4);
    }

    #[test]
    fn bounds_hold_as_often_as_stated_if_another_effect_may_act() {
        // Errors are even between 0 and 1 mm, so that q(p) = p mm.
        let quantile = |level: f64| 1e-3 * level;
        let pose = CorrectedPose {
            shift: Vector3::zeros(),
            covariance: Matrix3::zeros(),
            size: 1.0,
            aside: 0.0,
            is_extrapolated: false,
        };
        let bound = |share: f64, difference: f64| {
            let bounds = Bounds {
                level: 0.95,
                poses: vec![pose],
                lengths: vec![0.95e-3],
                scale: 1.0,
                learned_from: 60,
                misfit: None,
            };
            bounds.with_differences(quantile, share, &[difference]).bound(0)
        };
        for (share, difference) in
            [(0.12, 1e-3), (0.12, 1e-4), (0.5, 2e-4), (0.9, 2e-3), (0.04, 5e-3), (0.04, 1e-5)]
        {
            let b = bound(share, difference);
            let even = |b: f64| (b * 1e3).clamp(0.0, 1.0);
            let held = (1.0 - share) * even(b) + share * even(b - difference);
            assert!(held >= 0.95 - 1e-12, "{share} {difference}: {held}");
            assert!(b <= difference + 1e-3, "{share} {difference}: {b}");
        }
        // One that hardly ever acts does not enlarge the bound by all that it would change.
        assert!(bound(0.04, 5e-3) < 1.0e-3 && bound(0.0, 5e-3) < 0.96e-3);
    }
}
