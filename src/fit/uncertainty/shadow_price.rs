//! What a bound or constraint costs.

use crate::quantity::Unit;

/// What a limit costs: by how much the fit would be better if the limit were moved out by one unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadowPrice {
    /// Its Lagrange multiplier −∂(½χ²)/∂limit, priors counted in χ² \[1 / SI unit of the limit; of
    /// a logarithm: 1\].
    pub multiplier: f64,
    /// The same as the fall of the rms of the position residuals that were fitted, as if they bore
    /// all of it \[m / SI unit\].
    pub rms: f64,
}

impl ShadowPrice {
    /// The fall of the rms \[mm\] for a limit moved out by 1 mm, 1°, 1 % (of what enters by its
    /// logarithm) or one SI unit, and which of these.
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
