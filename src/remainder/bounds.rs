//! Bounds that the errors of predicted positions do not exceed with a given probability.

use super::correction::{CorrectedPose, Correction};
use crate::quantity::format::percent_of;

/// Uncertainty of predicted poses, and error bounds that hold with the probability `level`.
#[derive(Debug, Clone)]
pub struct Bounds {
    /// Probability with which a bound holds, 0 to 1.
    pub level: f64,
    /// Correction and uncertainty of the prediction in each pose.
    pub poses: Vec<CorrectedPose>,
    /// Ratio of a pose's error bound to its expected error length ([`CorrectedPose::size`]).
    factor: f64,
}

impl Bounds {
    /// Creates the bounds at probability `level` for poses that `correction` corrected.
    pub fn new(correction: &Correction, poses: Vec<CorrectedPose>, level: f64) -> Self {
        Self { level, poses, factor: correction.scores.quantile(level) }
    }

    /// Returns the upper bound of a pose's error length ‖measured − predicted‖ \[m\].
    pub fn bound(&self, pose: usize) -> f64 {
        self.factor * self.poses[pose].size
    }

    /// Returns the mean of the error bounds over the poses \[m\]; NaN if there are none.
    pub fn mean(&self) -> f64 {
        let bounds = (0..self.poses.len()).map(|pose| self.bound(pose));
        bounds.sum::<f64>() / self.poses.len() as f64
    }

    /// Returns the expected root mean square of the error length over all poses \[m\].
    pub fn expected(&self) -> f64 {
        let squares = self.poses.iter().map(|pose| pose.size * pose.size);
        (squares.sum::<f64>() / self.poses.len() as f64).sqrt()
    }

    /// Returns the share of the given error lengths \[m\], in the order of the poses, that do not
    /// exceed their bounds.
    pub fn coverage(&self, lengths: impl IntoIterator<Item = f64>) -> f64 {
        let within: Vec<bool> = lengths
            .into_iter()
            .enumerate()
            .map(|(pose, length)| length <= self.bound(pose))
            .collect();
        within.iter().filter(|within| **within).count() as f64 / within.len() as f64
    }

    /// Returns the name of the bounds' column in tables, for example `bound95_mm` at a level of
    /// 0.95.
    pub fn column(&self) -> String {
        format!("bound{}_mm", percent_of(self.level))
    }
}
