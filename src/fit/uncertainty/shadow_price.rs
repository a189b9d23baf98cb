//! Shadow price of a bound or constraint.

use crate::quantity::Unit;

/// Shadow price of a limit: improvement of the fit per unit by which the limit is moved outwards.
#[doc(hidden)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadowPrice {
    /// Lagrange multiplier −∂(½χ²)/∂limit, with priors counted in χ² \[1 / SI unit of the limit\];
    /// limits of logarithms have no unit.
    pub multiplier: f64,
    /// Decrease of the root mean squared position residual per unit, if the whole gain in χ² came
    /// from positions \[m / SI unit\].
    pub rms: f64,
}

impl ShadowPrice {
    /// Returns the decrease of the root mean square \[mm\] for a limit moved outwards by one step,
    /// and the name of that step. The step is 1 mm, 1°, 1 % (for logarithms) or one SI unit.
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
