//! Drift: random change of the parameters of an arm with time, between two identifications.

use crate::error::{InputError, InputErrorKind};
use crate::model::Model;
use crate::model::parameter::{JointField, Parameter, ParameterSite};
use crate::problem::{Problem, pattern};
use crate::quantity::Unit;

/// Default drift of a joint's zero after one day, 1 σ \[rad\]: 0.0002°, so 0.004° after a year.
const ZERO_RATE: f64 = 3.5e-6;
/// Default drift of other angles of joints after one day, 1 σ \[rad\]: 0.00005°.
const ANGLE_RATE: f64 = 9e-7;
/// Default drift of geometric lengths of joints after one day, 1 σ \[m\]: 0.02 mm after a year.
const LENGTH_RATE: f64 = 1e-6;
/// Default drift of each coordinate of a target after one day, 1 σ \[m\]: 0.1 mm after a year.
const TOOL_RATE: f64 = 5e-6;
/// Default drift of each coordinate of the base and of fixtures after one day, 1 σ \[m\].
const BASE_LENGTH_RATE: f64 = 5e-6;
/// Default drift of the orientation of base, target and fixtures after one day, 1 σ \[rad\].
const BASE_ANGLE_RATE: f64 = 9e-6;
/// Default relative drift of stiffnesses and rigidities after one day, 1 σ: 1 % after a year.
const STIFFNESS_RATE: f64 = 5e-4;
/// Default drift of other parameters, such as those of laws, after one day: 1 σ as a fraction of
/// the σ of the prior. It is 10 % of that after a year.
const LAW_RATE: f64 = 5e-3;

/// Returns the variance that `days` days add to the deviation of each parameter of the model.
///
/// The drift is a random walk: its variance is rate² × days, with the rate in units of the
/// deviation per √day. The last matching rule of `[drift]` gives the rate, else the default of the
/// kind of parameter.
///
/// # Errors
/// Returns an error if a rule of `[drift]` matches no parameter.
pub(super) fn variances(
    problem: &Problem,
    model: &Model,
    days: f64,
) -> Result<Vec<f64>, InputError> {
    for rule in &problem.drift {
        if !model.parameters.iter().any(|parameter| matches(&rule.pattern, &parameter.name)) {
            let known = model.parameters.iter().map(|parameter| parameter.name.clone()).collect();
            let kind = InputErrorKind::MatchesNothing { pattern: rule.pattern.clone(), known };
            return Err(rule.location.clone().error(kind));
        }
    }
    let rate = |parameter: &Parameter| {
        let rules = problem.drift.iter().rev();
        let of_rule = rules
            .filter(|rule| matches(&rule.pattern, &parameter.name))
            .find_map(|rule| rule.sigma.of_kind(parameter.unit()));
        of_rule.unwrap_or_else(|| default_rate(parameter))
    };
    Ok(model.parameters.iter().map(|parameter| rate(parameter).powi(2) * days).collect())
}

/// Returns true if a pattern matches a parameter's name, or the name without the word in brackets.
fn matches(rule: &str, name: &str) -> bool {
    let plain = name
        .split_once('[')
        .and_then(|(before, after)| Some(format!("{before}{}", after.split_once(']')?.1)));
    pattern::matches(rule, name) || plain.is_some_and(|plain| pattern::matches(rule, &plain))
}

/// Returns the default drift of a parameter after one day, 1 σ of its deviation.
fn default_rate(parameter: &Parameter) -> f64 {
    let unit = parameter.unit();
    let placed = |length: f64| match unit {
        Unit::Angle => BASE_ANGLE_RATE,
        Unit::Length => length,
        _ => 0.0,
    };
    match parameter.site {
        ParameterSite::Base { .. } | ParameterSite::Fixture { .. } => placed(BASE_LENGTH_RATE),
        ParameterSite::Target { .. } => placed(TOOL_RATE),
        ParameterSite::Joint { field, .. } if parameter.regressor.is_constant() => match unit {
            Unit::Angle if field == JointField::Theta => ZERO_RATE,
            Unit::Angle => ANGLE_RATE,
            Unit::Length => LENGTH_RATE,
            _ if unit.is_relative() => STIFFNESS_RATE,
            _ => LAW_RATE * parameter.sigma.unwrap_or(0.0),
        },
        _ if unit.is_relative() => STIFFNESS_RATE,
        _ => LAW_RATE * parameter.sigma.unwrap_or(0.0),
    }
}
