//! When an undamped iteration counts as diverging.

/// When an undamped iteration counts as diverging.
///
/// It does when ½‖r‖² > `growth` · (lowest ½‖r‖² so far) in `patience` iterations one after
/// another, or as soon as ½‖r‖² is not finite.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Divergence {
    /// Factor above the lowest cost so far, at least 1; default 10.
    pub growth: f64,
    /// Iterations in a row, at least 1; default 5.
    pub patience: u64,
}

impl Default for Divergence {
    fn default() -> Self {
        Self { growth: 10.0, patience: 5 }
    }
}

/// The costs of a run, judged one by one.
#[derive(Debug, Clone, Copy)]
pub(super) struct Watch {
    divergence: Divergence,
    lowest: f64,
    above: u64,
}

impl Watch {
    pub fn new(divergence: Divergence) -> Self {
        Self { divergence, lowest: f64::INFINITY, above: 0 }
    }

    /// Takes in the next cost; true when the run diverges.
    pub fn diverges(&mut self, cost: f64) -> bool {
        self.above = if cost > self.divergence.growth * self.lowest { self.above + 1 } else { 0 };
        self.lowest = self.lowest.min(cost);
        !cost.is_finite() || self.above >= self.divergence.patience.max(1)
    }
}
