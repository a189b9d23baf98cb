//! Linear inequalities between unknowns, from `[[constraint]]`.

use super::Parameter;
use super::resolve::{EffectParameter, candidates};
use crate::error::{InputError, InputErrorKind, Location};
use crate::problem::item::MAX_MAGNITUDE;
use crate::problem::{Constraint, Limit, LimitKind, Problem};
use crate::quantity::Unit;

/// Constraint lower ≤ Σ cₖ xₖ ≤ upper on unknowns xₖ; a missing limit is infinite.
///
/// Geometry enters by its value, Σ cₖ (nominalₖ + xₖ), stiffness and rigidity by the logarithm, Σ
/// cₖ (ln nominalₖ + xₖ) in SI units. Both are linear in x. The nominal part, with all fixed
/// parameters, is subtracted from the limits.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearConstraint {
    /// Indices of free parameters, with their coefficients.
    pub terms: Vec<(usize, f64)>,
    /// Lower limit on Σ c x, in the SI unit of the sum.
    pub lower: f64,
    /// Upper limit on Σ c x, in the SI unit of the sum.
    pub upper: f64,
    /// Text of the sum: `ln A.EI − ln B.EI`.
    pub sum: String,
    /// Text of the lower and of the upper limit, such as `≥ 0`.
    pub limits: [Option<String>; 2],
    /// Location in the problem file.
    pub location: Location,
}

impl LinearConstraint {
    /// Returns the constraint on the parameters listed in `kept`, with positions in this list as
    /// indices; `None` if it contains a parameter that is not listed.
    pub fn on_parameters(&self, kept: &[usize]) -> Option<Self> {
        let renumbered =
            |&(k, c): &(usize, f64)| Some((kept.iter().position(|&kept| kept == k)?, c));
        let terms = self.terms.iter().map(renumbered).collect::<Option<Vec<_>>>()?;
        Some(Self { terms, ..self.clone() })
    }
}

/// Creates the constraints of `problem` on its free `parameters`.
///
/// # Errors
/// Returns an error if a name is no parameter, units do not match, a limit has another unit, or no
/// parameter of the constraint is free.
pub fn resolve_constraints(
    problem: &Problem,
    bases: &[String],
    targets: &[String],
    effects: &[EffectParameter],
    parameters: &[Parameter],
) -> Result<Vec<LinearConstraint>, InputError> {
    let candidates = candidates(problem, bases, targets, effects);
    let constrainable: Vec<(String, Unit, f64)> =
        candidates.into_iter().map(|c| (c.name.clone(), c.unit(), c.nominal)).collect();
    problem
        .constraints
        .iter()
        .map(|constraint| resolve_constraint(constraint, &constrainable, parameters))
        .collect()
}

fn resolve_constraint(
    constraint: &Constraint,
    constrainable: &[(String, Unit, f64)],
    parameters: &[Parameter],
) -> Result<LinearConstraint, InputError> {
    let mut terms = Vec::new();
    let mut first: Option<(&str, LimitKind)> = None;
    let (mut nominal, mut sum) = (0.0, String::new());
    for term in &constraint.terms {
        let error = |kind| Err(term.location.clone().error(kind));
        let Some((name, unit, value)) = constrainable.iter().find(|(name, ..)| *name == term.name)
        else {
            let known = constrainable.iter().map(|(name, ..)| name.clone()).collect();
            return error(InputErrorKind::UnknownParameter { name: term.name.clone(), known });
        };
        if !matches!(unit, Unit::Angle | Unit::Length) && !unit.is_relative() {
            return error(InputErrorKind::NotConstrainable);
        }
        let kind = kind_of(*unit);
        match first {
            None => first = Some((name, kind)),
            Some((other, of)) if of != kind => {
                return error(InputErrorKind::MixedKinds { other: other.to_owned() });
            }
            Some(_) => {}
        }
        let coefficient = term.coefficient;
        nominal += coefficient * if kind == LimitKind::Logarithm { value.ln() } else { *value };
        if let Some(k) = parameters.iter().position(|parameter| parameter.name == *name) {
            terms.push((k, coefficient));
        }
        let sign = match (sum.is_empty(), coefficient < 0.0) {
            (true, false) => "",
            (true, true) => "−",
            (false, false) => " + ",
            (false, true) => " − ",
        };
        let logarithm = if kind == LimitKind::Logarithm { "ln " } else { "" };
        let size = Some(coefficient.abs().to_string())
            .filter(|size| size != "1")
            .map_or_else(String::new, |s| s + " ");
        sum.extend([sign, &size, logarithm, name]);
    }
    let Some((parameter, kind)) = first.filter(|_| !terms.is_empty()) else {
        return Err(constraint.location.clone().error(InputErrorKind::NothingConstrained));
    };
    if let Some(limit) =
        constraint.at_least.iter().chain(&constraint.at_most).find(|limit| limit.kind != kind)
    {
        let kind = InputErrorKind::LimitOfAnotherKind {
            parameter: parameter.to_owned(),
            write: limit_keys(kind),
        };
        return Err(limit.location.clone().error(kind));
    }
    // Values beyond this limit of all numbers could not be computed.
    let sizes: f64 = constraint.terms.iter().map(|term| term.coefficient.abs()).sum();
    let reach = sizes * MAX_MAGNITUDE.ln();
    let is_unreachable = |limit: &&Limit, sign: f64| {
        limit.kind == LimitKind::Logarithm && sign * limit.value > reach
    };
    let least = constraint.at_least.as_ref().filter(|limit| is_unreachable(limit, 1.0));
    let most = constraint.at_most.as_ref().filter(|limit| is_unreachable(limit, -1.0));
    if let Some(limit) = least.or(most) {
        return Err(limit.location.clone().error(InputErrorKind::UnreachableLimit { reach }));
    }
    let value = |limit: &Option<Limit>, none: f64| {
        limit.as_ref().map_or(none, |limit| limit.value - nominal)
    };
    let words = |limit: &Option<Limit>, relation: &str| {
        Some(format!("{relation} {}", format_limit(limit.as_ref()?)))
    };
    Ok(LinearConstraint {
        terms,
        lower: value(&constraint.at_least, f64::NEG_INFINITY),
        upper: value(&constraint.at_most, f64::INFINITY),
        sum,
        limits: [words(&constraint.at_least, "≥"), words(&constraint.at_most, "≤")],
        location: constraint.location.clone(),
    })
}

fn kind_of(unit: Unit) -> LimitKind {
    match unit {
        Unit::Angle => LimitKind::Angle,
        Unit::Length => LimitKind::Length,
        _ => LimitKind::Logarithm,
    }
}

fn limit_keys(kind: LimitKind) -> &'static str {
    match kind {
        LimitKind::Angle => "at_least_deg or at_least_rad, at_most_deg or at_most_rad",
        LimitKind::Length => "at_least_mm or at_least_m, at_most_mm or at_most_m",
        LimitKind::Logarithm => "at_least or at_most, of the logarithm",
    }
}

/// Formats a limit with nine digits, so that rounding by unit conversions is not visible.
fn format_limit(limit: &Limit) -> String {
    let (value, unit) = match limit.kind {
        LimitKind::Angle => (limit.value.to_degrees(), "°"),
        LimitKind::Length => (limit.value * 1e3, " mm"),
        LimitKind::Logarithm => (limit.value, ""),
    };
    format!("{}{unit}", (value * 1e9).round() / 1e9)
}
