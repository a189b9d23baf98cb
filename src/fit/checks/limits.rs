//! Check of bounds and constraints against the measurements.

use serde_json::json;

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode};
use super::row_kind::{format_error, listed};
use crate::error::Location;
use crate::least_squares::solver::AtBound;
use crate::model::parameter::{LinearConstraint, Parameter};
use crate::problem::pattern::matches;
use crate::problem::{Freedom, ParameterRule, Problem, Quantities};
use crate::quantity::format::{decimals, number};

/// Largest ratio of the rms residual without limits to that with them, at which the limits are
/// refuted. The σ of a prior is refuted by the same ratio.
const MAX_RATIO: f64 = 0.5;
/// Distance from a limit, relative to its size, at which the fit rests on it.
const AT_LIMIT: f64 = 1e-6;

/// Checks that bounds and constraints do not cause most of a misfit that contradicts the declared σ.
pub(super) fn limits_hold(fit: &CheckedFit) -> Option<Finding> {
    if !fit.contradicts_noise() {
        return None;
    }
    let limits = suspected(fit);
    if limits.is_empty() {
        return None;
    }
    let kind = fit.leading();
    let before = fit.rms_at(&kind.rows, &fit.end.x);
    let after = fit.with_problem(&without_limits(fit.problem), |fitting| {
        let end = fitting.refitted()?;
        Some(fit.rms(&kind.rows, &fitting.position_errors(&kind.rows, &end.x)))
    });
    let after = after.flatten().filter(|after| *after < MAX_RATIO * before)?;
    let named = listed(&limits);
    let name = kind.observation.kind();
    let text = format!(
        "limits of the problem cause most of the misfit: {named}; without limits the \
         rms error is {} instead of {}",
        format_error(name, after, 3),
        format_error(name, before, 3)
    );
    let numbers = [json!(limits), before.into(), after.into()];
    Some(Finding::new(FindingCode::LimitContradicted, numbers, text))
}

/// Returns the limits on which the fit rests, and those that exclude the nominal arm, in words with
/// their places.
fn suspected(fit: &CheckedFit) -> Vec<String> {
    let model = fit.model();
    let bounds = fit.whole.unknowns.iter().zip(&fit.end.at_bound).filter_map(|(&k, at_bound)| {
        let parameter = &model.parameters[k];
        let excludes_nominal = parameter.lower > 0.0 || parameter.upper < 0.0;
        let side = match at_bound {
            Some(side) => *side,
            None if parameter.lower > 0.0 => AtBound::Lower,
            None if parameter.upper < 0.0 => AtBound::Upper,
            None => return None,
        };
        bound_words(fit.problem, parameter, (side, excludes_nominal))
    });
    let constraints = model.constraints.iter().filter_map(|constraint| {
        let sum: f64 = constraint.terms.iter().map(|&(k, factor)| factor * fit.end.x[k]).sum();
        let [lower, upper] = [constraint.lower, constraint.upper];
        let scale = [lower, upper].into_iter().filter(|limit| limit.is_finite());
        let margin = AT_LIMIT * scale.map(f64::abs).fold(f64::MIN_POSITIVE, f64::max);
        let is_low = sum <= lower + margin || lower > 0.0;
        let is_high = sum >= upper - margin || upper < 0.0;
        constraint_words(constraint, (is_low, is_high))
    });
    bounds.chain(constraints).collect()
}

/// Describes a bound with its place: `joint4.theta, upper bound 0.1 ° (./problem.toml:90)`. `None`
/// if no rule of the problem gives it.
fn bound_words(
    problem: &Problem,
    parameter: &Parameter,
    (side, excludes_nominal): (AtBound, bool),
) -> Option<String> {
    let name = &parameter.name;
    let plain = match name.split_once('[') {
        Some((head, tail)) => format!("{head}{}", tail.split_once(']').map_or("", |tail| tail.1)),
        None => name.clone(),
    };
    let is_of =
        |rule: &&ParameterRule| matches(&rule.pattern, name) || matches(&rule.pattern, &plain);
    let rule = problem.parameters.iter().rev().find(is_of)?;
    let (word, x) = match side {
        AtBound::Lower => ("lower", parameter.lower),
        AtBound::Upper => ("upper", parameter.upper),
    };
    let bound = if parameter.unit().is_relative() {
        format!("{} times nominal", number(x.exp(), decimals(x.exp(), 4)))
    } else {
        let unit = parameter.unit().display(parameter.nominal);
        let shown = x * unit.factor;
        format!("{} {}", number(shown, decimals(shown, 4)), unit.symbol)
    };
    let hint = if !excludes_nominal {
        ""
    } else if parameter.unit().is_relative() {
        "; bounds of a stiffness are multiples of the nominal one"
    } else {
        "; bounds are of the deviation from nominal"
    };
    Some(format!("{name}, {word} bound {bound} ({}{hint})", place(&rule.location)))
}

/// Describes a constraint with its place: `joint3.a ≥ -600 mm (./problem.toml:110)`. `None` if
/// neither limit is suspected.
fn constraint_words(
    constraint: &LinearConstraint,
    (is_low, is_high): (bool, bool),
) -> Option<String> {
    let [lower, upper] = &constraint.limits;
    let limit = lower.as_ref().filter(|_| is_low).or(upper.as_ref().filter(|_| is_high))?;
    let excludes_nominal = constraint.lower > 0.0 || constraint.upper < 0.0;
    let hint = if excludes_nominal {
        "; the nominal arm does not keep it: a constraint is of values, not of deviations"
    } else {
        ""
    };
    Some(format!("{} {limit} ({}{hint})", constraint.sum, place(&constraint.location)))
}

/// Returns file and line of a location.
fn place(location: &Location) -> String {
    location.of_line().to_string()
}

/// Returns the problem without bounds in `[parameters]` and without constraints.
fn without_limits(declared: &Problem) -> Problem {
    let mut problem = declared.clone();
    problem.constraints.clear();
    for rule in &mut problem.parameters {
        if let Freedom::Free { min, max, .. } = &mut rule.freedom {
            (*min, *max) = (Quantities::default(), Quantities::default());
        }
    }
    problem
}
