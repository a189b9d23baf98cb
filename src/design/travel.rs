//! Travel of the joints between poses.

use crate::measurement::Measurements;
use crate::numeric::range;

/// Measure of the travel between configurations, relative to the joints' ranges over some poses.
#[derive(Debug, Clone)]
pub(super) struct Travel {
    /// Inverse width of each joint's range [1/rad] or [1/m]; 0 for a joint that does not move.
    scales: Vec<f64>,
}

impl Travel {
    /// Takes the ranges of the joints from the poses of a table.
    pub fn of(table: &Measurements) -> Self {
        let scale = |joint: usize| {
            let (low, high) = range((0..table.len()).map(|row| table.configuration(row)[joint]));
            if high > low { (high - low).recip() } else { 0.0 }
        };
        Self { scales: (0..table.joints).map(scale).collect() }
    }

    /// Returns the largest move of a joint between two configurations, as a fraction of its range.
    pub fn between(&self, from: &[f64], to: &[f64]) -> f64 {
        let moves = from.iter().zip(to).zip(&self.scales);
        moves.map(|((from, to), scale)| (to - from).abs() * scale).fold(0.0, f64::max)
    }
}
