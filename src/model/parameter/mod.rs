//! Free parameters: names, units, priors and bounds, resolved from the problem's rules.
//!
//! An unknown x is a deviation from nominal: additive for angles \[rad\] and lengths \[m\],
//! ln(value / nominal) for stiffnesses and rigidities, so that x = 0 is nominal everywhere and a
//! stiffness never turns negative.

mod constraint;
mod name;
mod regressor;
mod resolve;

pub use constraint::{LinearConstraint, constrain};
pub use name::{ArmField, BeamField, JointField, ParameterSite};
pub(crate) use regressor::Waves;
pub use regressor::{Quantity, Regressor};
pub use resolve::{EffectParameter, resolve};
pub(crate) use resolve::{holds_all, refuses, rule_of};

use crate::quantity::Unit;

/// A free parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name as in the problem file: `joint2.alpha`, `A.EI`, `base[B].rx`.
    pub name: String,
    /// Where it enters the model.
    pub site: ParameterSite,
    /// What it is multiplied by there.
    pub regressor: Regressor,
    /// Nominal value, SI.
    pub nominal: f64,
    /// 1 σ of the Gaussian prior on x about 0.
    pub sigma: Option<f64>,
    /// Lower bound on x, −∞ where there is none.
    pub lower: f64,
    /// Upper bound on x, +∞ where there is none.
    pub upper: f64,
}

impl Parameter {
    /// Kind of quantity.
    pub fn unit(&self) -> Unit {
        unit(self.site, self.regressor)
    }

    /// Value at x, SI.
    pub fn value(&self, x: f64) -> f64 {
        if self.unit().is_relative() { self.nominal * x.exp() } else { self.nominal + x }
    }

    /// x of a value, SI; the inverse of [`Parameter::value`].
    pub fn deviation(&self, value: f64) -> f64 {
        if self.unit().is_relative() { (value / self.nominal).ln() } else { value - self.nominal }
    }

    /// Standard error of the value from that of x, SI.
    pub fn value_error(&self, x: f64, error: f64) -> f64 {
        if self.unit().is_relative() { self.value(x) * error } else { error }
    }

    /// Whether x has a lower or an upper bound.
    pub fn is_bounded(&self) -> bool {
        self.lower.is_finite() || self.upper.is_finite()
    }
}

/// Kind of a quantity that is multiplied by `regressor` before it enters at `site`.
pub(crate) fn unit(site: ParameterSite, regressor: Regressor) -> Unit {
    match (regressor, site.unit()) {
        (Regressor::Warming { .. } | Regressor::Lagging { .. }, of) => match of {
            Unit::Angle => Unit::AnglePerDegree,
            Unit::PerLength => Unit::CurvaturePerDegree,
            Unit::Ratio => Unit::PerDegree,
            _ => Unit::LengthPerDegree,
        },
        (Regressor::LoadedSide { .. }, Unit::Angle) => Unit::AnglePerMass,
        (Regressor::LoadedSide { .. }, _) => Unit::LengthPerMass,
        (Regressor::Elapsed, _) => Unit::Speed,
        (Regressor::Covariate(_), Unit::Angle) => Unit::AnglePerUnit,
        (Regressor::Covariate(_), _) => Unit::LengthPerUnit,
        (Regressor::Command(_), Unit::Length) => Unit::LengthPerAngle,
        (Regressor::Travel(_), Unit::Angle) => Unit::AnglePerLength,
        (Regressor::Command(_) | Regressor::Travel(_), _) => Unit::Ratio,
        (_, unit) => unit,
    }
}
