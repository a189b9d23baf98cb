//! Shadow price of a bound or constraint.

use crate::quantity::Unit;

/// Shadow price of a limit: improvement of the fit if the limit were moved out by one unit.
#[doc(hidden)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadowPrice {
    /// Lagrange multiplier −∂(½χ²)/∂limit, with priors counted in χ² \[1 / SI unit of the limit\];
    /// limits of logarithms have no unit.
    pub multiplier: f64,
    /// Decrease of the rms of the fitted position residuals, if all of the gain were theirs \[m /
    /// SI unit\].
    pub rms: f64,
}

impl ShadowPrice {
    /// Returns the decrease of the rms \[mm\] for a limit moved out by 1 mm, 1°, 1 % (where the
    /// logarithm is limited) or one SI unit, and the name of that step.
    #[doc(hidden)]
    pub fn in_mm(self, unit: Unit) -> (f64, &'static str) {
        let (step, name) = match unit {
            Unit::Length => (1e-3, "mm"),
            Unit::Angle => (1.0_f64.to_radians(), "°"),
            unit if unit.is_relative() => (0.01, "%"),
            unit => (1.0, unit.symbol()),
        };
        (1e3 * self.rms * step, name)
    }
}
