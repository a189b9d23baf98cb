//! Tried step of the trust-region loop: gain ratio and next radius.

use super::Step;

/// Ratio of geodesic acceleration to step length that the next radius aims at. After an accelerated
/// step, the radius is multiplied by this ratio over the actual one, at least by 1.5 and at most by
/// 8.
const TARGET_ACCELERATION: f64 = 0.03;
/// Smallest gain ratio ρ at which the radius grows.
pub(super) const MIN_GROWTH_RATIO: f64 = 0.75;

/// Tried step with its actual and predicted reductions, relative to the previous cost.
pub(super) struct Trial {
    pub cost: f64,
    pub actual: f64,
    pub predicted: f64,
    pub slope: f64,
    pub ratio: f64,
    pub length: f64,
    pub damping: f64,
    /// Factor by which the radius grows after the step.
    pub radius_growth: f64,
}

impl Trial {
    /// Compares the predictions of `step` with the costs `before` and `after` it. `acceleration` is
    /// the ratio of geodesic acceleration to step length, `None` for a step without acceleration.
    pub fn new((step, acceleration): (&Step, Option<f64>), before: f64, after: f64) -> Self {
        // If the cost grew a hundredfold, it says nothing about the curvature.
        let actual = if after < 100.0 * before { 1.0 - after / before } else { -1.0 };
        let predicted = step.predicted / before;
        let ratio = if predicted > 0.0 { actual / predicted } else { 0.0 };
        Self {
            cost: after,
            actual,
            predicted,
            slope: step.slope / before,
            ratio,
            length: step.length,
            damping: step.damping,
            radius_growth: acceleration
                .map_or(2.0, |ratio| (TARGET_ACCELERATION / ratio).clamp(1.5, 8.0)),
        }
    }

    /// Returns the gain ratio ρ, or 1 if actual and predicted relative reduction differ by no more
    /// than `tolerance`, which is rounding of the cost.
    pub fn significant_ratio(&self, tolerance: f64) -> f64 {
        if (self.actual - self.predicted).abs() <= tolerance { 1.0 } else { self.ratio }
    }

    /// Returns the radius of the next step.
    pub fn next_radius(&self, radius: f64) -> f64 {
        if self.ratio <= 0.25 {
            // The factor is the minimum of the parabola through both costs and the slope, clamped
            // to 0.1 … 0.5.
            let shrink = if self.actual >= 0.0 {
                0.5
            } else {
                0.5 * self.slope / (self.slope - self.actual)
            };
            let shrink =
                if self.actual <= -1.0 || shrink.is_nan() { 0.1 } else { shrink.clamp(0.1, 0.5) };
            shrink * radius.min(10.0 * self.length)
        } else if self.ratio >= MIN_GROWTH_RATIO || self.damping == 0.0 {
            self.radius_growth * self.length
        } else {
            radius
        }
    }
}
