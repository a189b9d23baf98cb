//! Free parameters: names, units, priors and bounds, resolved from the problem's rules.
//!
//! An unknown x is a deviation from nominal. It is additive for angles \[rad\] and lengths \[m\]
//! and equals ln(value / nominal) for stiffnesses and rigidities. So x = 0 is nominal everywhere,
//! and a stiffness stays positive.

mod constraint;
mod inner;
mod regressor;
mod resolve;
mod site;
mod waves;

pub(crate) use crate::laws::ArmField;
pub use crate::laws::{BeamField, JointField};
pub use constraint::LinearConstraint;
pub(crate) use constraint::resolve_constraints;

pub(crate) use inner::{
    load_derivative, slope_regressor, uses_moments, value_regressor, with_moments,
};
pub(crate) use regressor::Regressor;
pub(crate) use resolve::{EffectParameter, resolve};
pub(crate) use resolve::{are_all_fixed, makes_rule_invalid, rule_of};
pub use site::ParameterSite;
pub(crate) use waves::Waves;

use crate::laws::expression::Per;
use crate::quantity::Unit;

/// Free parameter of the model.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Name as in the problem file: `joint2.alpha`, `A.EI`, `base[B].rx`.
    pub name: String,
    /// Site of the model at which the parameter acts.
    pub site: ParameterSite,
    /// Function of the pose that multiplies the parameter at its site.
    pub regressor: Regressor,
    /// Nominal value, in SI units.
    pub nominal: f64,
    /// Standard deviation (1 σ) of the Gaussian prior on the deviation x about 0; `None` without a
    /// prior.
    pub sigma: Option<f64>,
    /// Lower bound on the deviation x; −∞ without a bound.
    pub lower: f64,
    /// Upper bound on the deviation x; +∞ without a bound.
    pub upper: f64,
}

impl Parameter {
    /// Returns the unit of the parameter's value.
    pub fn unit(&self) -> Unit {
        unit(self.site, &self.regressor)
    }

    /// Returns the value at the deviation `x`, in SI units.
    pub fn value(&self, x: f64) -> f64 {
        if self.unit().is_relative() { self.nominal * x.exp() } else { self.nominal + x }
    }

    /// Returns the deviation x at which the parameter has a value, in SI units; the inverse of
    /// [`Parameter::value`].
    pub fn deviation(&self, value: f64) -> f64 {
        if self.unit().is_relative() { (value / self.nominal).ln() } else { value - self.nominal }
    }

    /// Returns the standard error of the value, in SI units, for a standard error `error` of the
    /// deviation at `x`.
    pub fn value_error(&self, x: f64, error: f64) -> f64 {
        if self.unit().is_relative() { self.value(x) * error } else { error }
    }

    /// Returns true if x has a lower or an upper bound.
    pub fn is_bounded(&self) -> bool {
        self.lower.is_finite() || self.upper.is_finite()
    }
}

/// Returns the unit of a parameter that is multiplied by `regressor` at `site`.
pub(crate) fn unit(site: ParameterSite, regressor: &Regressor) -> Unit {
    if *regressor == Regressor::Inner {
        return Unit::Number;
    }
    match (regressor.per(), site.unit()) {
        (per, unit @ (Unit::Pixel | Unit::Number)) if per != Per::Number => {
            unit.divided_by(per.powers())
        }
        (Per::Kelvin, Unit::Angle) => Unit::AnglePerDegree,
        (Per::Kelvin, Unit::PerLength) => Unit::CurvaturePerDegree,
        (Per::Kelvin, Unit::Ratio) => Unit::PerDegree,
        (Per::Kelvin, _) => Unit::LengthPerDegree,
        (Per::Mass, Unit::Angle) => Unit::AnglePerMass,
        (Per::Mass, Unit::PerLength) => Unit::CurvaturePerMass,
        (Per::Mass, Unit::Ratio) => Unit::StrainPerMass,
        (Per::Mass, _) => Unit::LengthPerMass,
        (Per::Second, Unit::Angle) => Unit::AngularSpeed,
        (Per::Second, Unit::PerLength) => Unit::CurvaturePerTime,
        (Per::Second, Unit::Ratio) => Unit::StrainPerTime,
        (Per::Second, _) => Unit::Speed,
        (Per::Torque, Unit::Angle) => Unit::Compliance,
        (Per::Torque, Unit::PerLength) => Unit::Flexibility,
        (Per::Torque, Unit::Ratio) => Unit::StrainPerTorque,
        (Per::Torque, Unit::Length) => Unit::LengthPerTorque,
        (Per::Torque, unit) => unit.divided_by([0, 1, 0, 0, 0, 1, 0]),
        (Per::TorqueMass, Unit::Angle) => Unit::AnglePerTorqueMass,
        (Per::TorqueMass, unit) => unit.divided_by([0, 1, 0, 1, 0, 1, 0]),
        (Per::Product(powers), unit) => unit.divided_by(powers),
        (Per::Covariate, Unit::Angle) => Unit::AnglePerUnit,
        (Per::Covariate, Unit::PerLength) => Unit::CurvaturePerUnit,
        (Per::Covariate, Unit::Ratio) => Unit::StrainPerUnit,
        (Per::Covariate, _) => Unit::LengthPerUnit,
        (Per::Angle, Unit::Length) => Unit::LengthPerAngle,
        (Per::Length, Unit::Angle) => Unit::AnglePerLength,
        (Per::Angle, Unit::PerLength) | (Per::Length, Unit::Ratio) => Unit::PerLength,
        (Per::Length, Unit::PerLength) => Unit::CurvaturePerLength,
        (Per::Angle | Per::Length, _) => Unit::Ratio,
        (Per::Number, unit) => unit,
    }
}
