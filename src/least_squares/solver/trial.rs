//! Tried step of the trust-region loop: gain ratio and next radius.

use super::Step;

/// Ratio of geodesic acceleration to step length that the next radius aims at. After an accelerated
/// step, the radius is multiplied by this ratio over the actual one, at least by 1.5 and at most by
/// 8.
const TARGET_ACCELERATION: f64 = 0.03;
/// Smallest gain ratio ρ (actual over predicted reduction of the cost) at which the trust-region
/// radius grows.
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
    /// Factor on the trust-region radius after the step.
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

#[cfg(test)]
mod tests {
    use nalgebra::DVector;

    use super::*;

    /// Returns the trial of a step of length 2 with slope 6, predicted reduction 4 and damping 1,
    /// taken where the cost is 10.
    fn trial(after: f64, acceleration: Option<f64>) -> Trial {
        let point = DVector::zeros(1);
        let step = Step { point, length: 2.0, slope: 6.0, predicted: 4.0, damping: 1.0 };
        Trial::new((&step, acceleration), 10.0, after)
    }

    #[test]
    fn reductions_are_relative_to_the_cost_before() {
        let found = trial(7.0, None);
        let values = [found.actual, found.predicted, found.slope, found.ratio];
        for (value, expected) in values.into_iter().zip([0.3, 0.4, 0.6, 0.75]) {
            assert!((value - expected).abs() < 1e-15, "{values:?}");
        }
        // A cost that grows a hundredfold, or is infinite, counts as twice the cost before.
        for after in [1e3, f64::INFINITY] {
            assert!((trial(after, None).actual + 1.0).abs() < 1e-15);
        }
        assert!((trial(990.0, None).actual + 98.0).abs() < 1e-12);
    }

    #[test]
    fn differences_within_rounding_are_no_miss() {
        let found = trial(7.0, None);
        assert!((found.significant_ratio(0.2) - 1.0).abs() < 1e-15);
        assert!((found.significant_ratio(0.05) - 0.75).abs() < 1e-15);
    }

    #[test]
    fn the_radius_follows_the_gain_ratio() {
        let undamped = |after| Trial { damping: 0.0, ..trial(after, None) };
        let cases = [
            // Well predicted: twice the length of the step.
            (trial(6.0, None), 4.0),
            // In between: as before if the radius limited the step, else twice its length.
            (trial(8.0, None), 3.0),
            (undamped(8.0), 4.0),
            // Poorly predicted: half if the cost fell, else the minimum of the parabola through
            // both costs and the slope, 0.5 · 0.6 / (0.6 + 0.4), clamped to 0.1 … 0.5.
            (trial(9.5, None), 1.5),
            (trial(14.0, None), 0.9),
            (trial(10.5, None), 3.0 * 0.5 * 0.6 / 0.65),
            (trial(19.0, None), 0.6),
            // The cost doubled or more.
            (trial(21.0, None), 0.3),
            (trial(f64::INFINITY, None), 0.3),
            (Trial { slope: 3.0, ..trial(20.0, None) }, 0.3),
        ];
        for (k, (trial, expected)) in cases.into_iter().enumerate() {
            let radius = trial.next_radius(3.0);
            assert!((radius - expected).abs() < 1e-12, "case {k}: {radius}");
        }
        // A radius far beyond the step shrinks from ten times the length of the step.
        assert!((trial(9.5, None).next_radius(1e6) - 10.0).abs() < 1e-12);
    }

    #[test]
    fn the_radius_of_accelerated_steps_follows_their_acceleration() {
        for (acceleration, growth) in [(0.01, 3.0), (1e-6, 8.0), (0.0, 8.0), (0.5, 1.5)] {
            let radius = trial(6.0, Some(acceleration)).next_radius(3.0);
            assert!((radius - growth * 2.0).abs() < 1e-12, "{acceleration}: {radius}");
        }
    }
}
