//! Bounds of the errors of predicted positions.

use super::correction::{CorrectedPose, Correction};

/// Uncertainty of some predictions, and bounds of their errors that hold with a stated probability.
#[derive(Debug, Clone)]
pub struct Bounds {
    /// Probability with which a bound holds.
    pub level: f64,
    /// Uncertainty of each pose.
    pub poses: Vec<CorrectedPose>,
    /// Factor from the expected size of an error to its bound.
    factor: f64,
}

impl Bounds {
    /// Bounds at `level` of poses that were corrected by `correction`.
    pub fn new(correction: &Correction, poses: Vec<CorrectedPose>, level: f64) -> Self {
        Self { level, poses, factor: correction.scores.quantile(level) }
    }

    /// Bound of the length of measured − predicted of a pose \[m\].
    pub fn bound(&self, pose: usize) -> f64 {
        self.factor * self.poses[pose].size
    }

    /// Mean bound of the poses \[m\]; NaN without any.
    pub fn mean(&self) -> f64 {
        let bounds = (0..self.poses.len()).map(|pose| self.bound(pose));
        bounds.sum::<f64>() / self.poses.len() as f64
    }

    /// Expected root mean square length of measured − predicted \[m\].
    pub fn expected(&self) -> f64 {
        let squares = self.poses.iter().map(|pose| pose.size * pose.size);
        (squares.sum::<f64>() / self.poses.len() as f64).sqrt()
    }

    /// Share of errors of these lengths \[m\] that lie within their bounds.
    pub fn coverage(&self, lengths: impl IntoIterator<Item = f64>) -> f64 {
        let within: Vec<bool> = lengths
            .into_iter()
            .enumerate()
            .map(|(pose, length)| length <= self.bound(pose))
            .collect();
        within.iter().filter(|within| **within).count() as f64 / within.len() as f64
    }

    /// Name of the column of bounds: `bound95_mm` at a level of 0.95.
    pub fn column(&self) -> String {
        format!("bound{}_mm", (self.level * 1e6).round() / 1e4)
    }
}
