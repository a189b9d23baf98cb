//! How far parameters may plausibly go.

use crate::model::Model;
use crate::model::parameter::{Parameter, ParameterSite};
use crate::quantity::Unit;

/// An angle \[rad\] that moves points by their distance from the axis.
const ANGLE: f64 = 1.0;
/// ln of the factor by which a stiffness or rigidity may differ from nominal.
const LN_STIFFNESS: f64 = 4.605_170_185_988_092;
/// Beyond half a turn every angle is another one within it.
const HALF_TURN: f64 = std::f64::consts::PI;

/// How far a parameter without a prior may plausibly deviate: a length by the arm's own size, an
/// angle by 1 rad, a stiffness by a factor of 100. `None` for those with a prior, and for what may
/// be anywhere or has no size of its own.
pub(in crate::fit) fn plausible(model: &Model, parameter: &Parameter) -> Option<f64> {
    if parameter.sigma.is_some()
        || matches!(
            parameter.site,
            ParameterSite::Base { axis: 0..3, .. } | ParameterSite::Fixture { .. }
        )
    {
        return None;
    }
    match parameter.unit() {
        Unit::Length => Some(model.reach()),
        Unit::Angle => Some(ANGLE),
        unit => unit.is_relative().then_some(LN_STIFFNESS),
    }
}

/// What no parameter of the arm exceeds, with a prior or without: as [`plausible`], angles by half
/// a turn.
pub(in crate::fit) fn largest(model: &Model, parameter: &Parameter) -> Option<f64> {
    match (parameter.site, parameter.unit()) {
        (
            ParameterSite::Base { .. }
            | ParameterSite::Fixture { .. }
            | ParameterSite::Target { axis: 3.., .. },
            _,
        ) => None,
        (_, Unit::Length) => Some(model.reach()),
        (_, Unit::Angle) => Some(HALF_TURN),
        (_, unit) => unit.is_relative().then_some(LN_STIFFNESS),
    }
}
