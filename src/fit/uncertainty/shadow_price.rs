//! Shadow price of a bound or constraint: what moving it outwards would gain.

use std::borrow::Cow;

use crate::quantity::Unit;

/// Shadow price of a limit: improvement of the fit per unit by which the limit is moved outwards.
#[doc(hidden)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShadowPrice {
    /// Lagrange multiplier: decrease of ½χ² per unit by which the limit is moved outwards, with the
    /// priors included in χ² \[1 / SI unit of the limit\]. Limits of logarithms have no unit.
    pub multiplier: f64,
    /// Decrease of the rms residual of positions (of the first kind of rows, if none measures a
    /// position) per unit of the limit, if the whole decrease of χ² came from these rows \[m / SI
    /// unit of the limit\].
    pub rms: f64,
}

impl ShadowPrice {
    /// Returns the decrease of the rms residual \[mm\] for a limit moved outwards by one step, and
    /// the name of that step. The step is 1 mm, 1°, 1 % (for logarithms) or one SI unit.
    #[doc(hidden)]
    pub fn in_mm(self, unit: Unit) -> (f64, Cow<'static, str>) {
        let (step, name) = match unit {
            Unit::Length => (1e-3, "mm".into()),
            Unit::Angle => (1.0_f64.to_radians(), "°".into()),
            unit if unit.is_relative() => (0.01, "%".into()),
            unit => (1.0, unit.symbol()),
        };
        (1e3 * self.rms * step, name)
    }
}
