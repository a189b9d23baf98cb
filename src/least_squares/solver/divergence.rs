//! Divergence test of undamped iterations.

/// Criterion by which an undamped iteration counts as diverging.
///
/// The iteration diverges if ½‖r‖² > `growth` · (lowest ½‖r‖² so far) in `patience` successive
/// iterations, or as soon as ½‖r‖² is not finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Divergence {
    /// Allowed ratio of the cost to the lowest cost so far, at least 1; default 10.
    pub growth: f64,
    /// Number of successive iterations above that ratio, at least 1; default 5.
    pub patience: u64,
}

impl Default for Divergence {
    fn default() -> Self {
        Self { growth: 10.0, patience: 5 }
    }
}

/// Divergence test over the successive costs of one run.
#[derive(Debug, Clone, Copy)]
pub(super) struct DivergenceMonitor {
    divergence: Divergence,
    lowest: f64,
    above: u64,
}

impl DivergenceMonitor {
    /// Starts the test before the first cost.
    pub fn new(divergence: Divergence) -> Self {
        Self { divergence, lowest: f64::INFINITY, above: 0 }
    }

    /// Records the next cost and returns true if the run diverges.
    pub fn diverges(&mut self, cost: f64) -> bool {
        self.above = if cost > self.divergence.growth * self.lowest { self.above + 1 } else { 0 };
        self.lowest = self.lowest.min(cost);
        !cost.is_finite() || self.above >= self.divergence.patience.max(1)
    }
}
