//! Plausible sizes and largest possible deviations of parameters.

use crate::model::Model;
use crate::model::parameter::{Parameter, ParameterSite};
use crate::quantity::Unit;

/// Plausible size of an angle \[rad\]: points then move by their distance from the axis.
const PLAUSIBLE_ANGLE: f64 = 1.0;
/// Plausible size of the logarithm of a stiffness or rigidity: ln 100.
const PLAUSIBLE_LN_STIFFNESS: f64 = 4.605_170_185_988_092;
/// Largest possible deviation of an angle \[rad\]. Beyond half a turn, an angle equals a smaller
/// one of the other sign.
const MAX_ANGLE: f64 = std::f64::consts::PI;

/// Returns the plausible size of a parameter without a prior. It is the reach of the arm for a
/// length, 1 rad for an angle, and ln 100 for the logarithm of a stiffness. Returns `None` for
/// parameters with a prior, for positions of bases and fixtures, which are arbitrary, and for other
/// units.
pub(in crate::fit) fn plausible_size(model: &Model, parameter: &Parameter) -> Option<f64> {
    if parameter.sigma.is_some()
        || matches!(
            parameter.site,
            ParameterSite::Base { axis: 0..3, .. } | ParameterSite::Fixture { .. }
        )
    {
        return None;
    }
    size_of_unit(model, parameter)
}

/// Returns the reach of the arm for a length, 1 rad for an angle, ln 100 for the logarithm of a
/// stiffness, and `None` for other units.
pub(in crate::fit) fn size_of_unit(model: &Model, parameter: &Parameter) -> Option<f64> {
    match parameter.unit() {
        Unit::Length => Some(model.reach()),
        Unit::Angle => Some(PLAUSIBLE_ANGLE),
        unit => unit.is_relative().then_some(PLAUSIBLE_LN_STIFFNESS),
    }
}

/// Returns the largest possible deviation of a parameter of the arm from nominal. It is the reach
/// of the arm for a length, π for an angle, and ln 100 for the logarithm of a stiffness. Returns
/// `None` for bases, fixtures, orientations of targets, and other units.
pub(in crate::fit) fn largest_deviation(model: &Model, parameter: &Parameter) -> Option<f64> {
    match (parameter.site, parameter.unit()) {
        (
            ParameterSite::Base { .. }
            | ParameterSite::Fixture { .. }
            | ParameterSite::Target { axis: 3.., .. },
            _,
        ) => None,
        (_, Unit::Length) => Some(model.reach()),
        (_, Unit::Angle) => Some(MAX_ANGLE),
        (_, unit) => unit.is_relative().then_some(PLAUSIBLE_LN_STIFFNESS),
    }
}
