//! Check of the geometry that the problem holds at its nominal values.

use std::collections::BTreeMap;

use nalgebra::DVector;
use serde_json::json;

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode};
use super::misread::MAX_RATIO_ERROR_OF_ARM;
use super::row_kind::format_error;
use crate::fit::stages::fitting::{FitEnd, Fitting};
use crate::least_squares::{Linearisation, Triangle, jacobian_and_residual};
use crate::measurement::MAX_FITTED_BASES;
use crate::model::parameter::{Parameter, ParameterSite};
use crate::problem::{Observation, ParameterRule, Problem};
use crate::quantity::Unit;
use crate::quantity::format::{decimals, number};

/// Smallest share of the misfit, beyond what noise explains, that a held parameter, or two of them,
/// take away if they are free. They are then named.
const MIN_EXPLAINED_SHARES: [f64; 2] = [0.8, 0.95];
/// Smallest share that the linearised fit must promise, at which they are fitted in full.
const MIN_EXPECTED_SHARE: f64 = 0.5;
/// Smallest share that a held base takes away if it is free and no single parameter explains the
/// misfit. A base is seldom known as well as the geometry, so that it is named beside other causes.
const MIN_SHARE_OF_BASE: f64 = 0.5;
/// Pattern of the parameters of the base.
const BASE: &str = "base.*";
/// Maximum number of held parameters that are fitted in full, each by itself, and of pairs of them:
/// those with the largest expected share.
const MAX_FITTED: usize = 3;
/// Smallest squared length of a column, as a fraction of its length before the free parameters are
/// fitted, at which the data tell the held parameter from them.
const MIN_OWN_SHARE: f64 = 1e-6;
/// Squared length of the row that keeps a free parameter determined, as a fraction of the squared
/// length of its column.
const RIDGE: f64 = 1e-12;
/// Largest ratio of the displacement by a held parameter's deviation to the rms error of the fit.
const MAX_DISPLACEMENT_RATIO: f64 = 50.0;
/// Largest ratio of the mean square of left-out errors to that of the best held parameter, at which
/// another one acts alike.
const MAX_RATIO_ALIKE: f64 = 1.2;
/// Fields of the geometry of a joint, as in names of parameters.
const FIELDS: [&str; 5] = ["alpha", "a", "theta", "d", "beta"];
/// Largest deviation, in σ of a usual prior, with which that prior is recommended.
const MAX_PRIOR_SIGMAS: f64 = 3.0;

/// Checks that no parameter of the geometry that the problem holds, and no two of them, cause most of
/// a misfit which contradicts the declared σ.
pub(super) fn held_geometry_is_right(fit: &CheckedFit) -> Option<Finding> {
    let leading = fit.table().leading();
    // Another reading of the table explains the misfit by itself, unless it is a small error of the
    // arm or the instrument.
    let reading = fit.explanations.get().and_then(|found| found.fitted.first());
    let is_misread = reading.is_some_and(|reading| {
        reading.effect.as_ref().is_none_or(|(_, size)| size.abs() >= MAX_RATIO_ERROR_OF_ARM)
    });
    if !(fit.contradicts_noise() && leading.is_position()) || is_misread {
        return None;
    }
    finding(fit, leading)
}

/// Result of a fit to the identification rows.
struct Trial {
    /// Root mean square of the errors of the leading kind of rows (positions, if there are any)
    /// \[m\].
    rms: f64,
    /// Mean square of the errors of configurations that are left out one at a time \[m²\].
    left_out: f64,
}

/// Held parameters with the result of a fit in which they are free.
struct Freed {
    names: Vec<String>,
    /// Fitted deviations from nominal, with their units.
    deviations: Vec<String>,
    /// Freedom of each to write in `[parameters]`: a usual prior, or none if the deviation
    /// contradicts it.
    freedoms: Vec<&'static str>,
    trial: Trial,
}

impl Trial {
    /// Summarises the errors of a fit of `fitting`, with its end.
    fn of(fit: &CheckedFit, rows: &[usize], (fitting, end): (&Fitting, &FitEnd)) -> Self {
        let errors = fitting.left_out(end, fit.problem);
        let squares: f64 = errors.iter().map(nalgebra::Matrix::norm_squared).sum();
        Self {
            rms: fit.rms(rows, &fitting.position_errors(rows, &end.x)),
            left_out: squares / errors.len().max(1) as f64,
        }
    }
}

/// Returns the finding that names the held parameter, or the two, which explain most of the misfit.
fn finding(fit: &CheckedFit, leading: Observation) -> Option<Finding> {
    let [single, pairs] = promising(fit).unwrap_or_default();
    // A problem with the base free is refused beyond this number.
    let sessions = fit.table().session.names.len();
    let may_move = !fit.is_base_free() && sessions <= MAX_FITTED_BASES;
    if single.is_empty() && pairs.is_empty() && !may_move {
        return None;
    }
    let rows = fit.kind(leading).rows;
    let rms = fit.rms(&rows, &fit.errors_at(&rows, &fit.end.x));
    // All fits have the declared σ, so that the priors weigh equally.
    let refit = |problem: &Problem, names: &[String]| {
        fit.with_problem(problem, |fitting| {
            let end = fitting.refitted()?;
            let freed = |name: &String| {
                if name == BASE {
                    return Some((shown_base(fitting, &end), "free = true"));
                }
                let mut parameters = fitting.model.parameters.iter().zip(end.x.iter());
                let (parameter, x) = parameters.find(|(parameter, _)| parameter.name == *name)?;
                let arm = if parameter.unit() == Unit::Angle { fitting.model.reach() } else { 1.0 };
                // Other parameters make up for nearly all of such a deviation, so none is shown.
                let is_plausible = x.abs() * arm <= MAX_DISPLACEMENT_RATIO * rms;
                is_plausible.then(|| (shown(parameter, *x), prior(parameter, *x)))
            };
            let freed: Option<Vec<_>> = names.iter().map(freed).collect();
            Some((freed?, Trial::of(fit, &rows, (fitting, &end))))
        })?
    };
    let (_, declared) = refit(fit.problem, &[])?;
    let noise = rms.powi(2) / fit.noise_factor;
    let misfit = (declared.rms.powi(2) - noise).max(0.0);
    let limit = |share: f64| (1.0 - share).mul_add(misfit, noise);
    let fitted = |names: &Vec<String>| {
        let problem = with_free(fit.problem, names.iter().cloned());
        let (freed, trial) = refit(&problem, names)?;
        let (deviations, freedoms) = freed.into_iter().unzip();
        Some(Freed { names: names.clone(), deviations, freedoms, trial })
    };
    let explaining = |sets: &[Vec<String>], share: f64| -> Vec<Freed> {
        let is_better = |freed: &Freed| {
            freed.trial.rms.powi(2) <= limit(share) && freed.trial.left_out < declared.left_out
        };
        sets.iter().filter_map(fitted).filter(is_better).collect()
    };
    let mut freed = explaining(&single, MIN_EXPLAINED_SHARES[0]);
    if freed.is_empty() && may_move {
        freed = explaining(&[vec![BASE.to_owned()]], MIN_SHARE_OF_BASE);
    }
    // Two may explain what a single one, or the base, leaves.
    let most_left = limit(MIN_EXPLAINED_SHARES[1]);
    if freed.iter().all(|freed| freed.trial.rms.powi(2) > most_left) {
        let both = explaining(&pairs, MIN_EXPLAINED_SHARES[1]);
        freed = if both.is_empty() { freed } else { both };
    }
    freed.sort_by(|a, b| a.trial.left_out.total_cmp(&b.trial.left_out));
    let best = freed.first()?;
    let is_alike = |other: &&Freed| other.trial.left_out <= MAX_RATIO_ALIKE * best.trial.left_out;
    let mut alike: Vec<String> =
        freed[1..].iter().filter(is_alike).map(|other| other.names.join(" with ")).collect();
    let is_single = best.names.len() == 1;
    let set_up = held_set_up(fit, &best.names[0]).filter(|_| is_single);
    alike.extend(set_up.map(str::to_owned));
    let [it, they_are, deviate, their] = if is_single {
        ["it", "it is", "it deviates", "is held at its nominal value"]
    } else {
        ["this pair", "they are", "they deviate", "are held at their nominal values"]
    };
    let others = match alike.as_slice() {
        [] => String::new(),
        names => format!(" (these poses do not tell {it} from {})", names.join(" or ")),
    };
    let text = format!(
        "{} {their}{others}: if {they_are} free, {deviate} by {}, and the rms error is {} instead \
         of {}",
        best.names.join(" and "),
        best.deviations.join(" and "),
        format_error(leading.kind(), best.trial.rms, 3),
        format_error(leading.kind(), declared.rms, 3)
    );
    let rules = best.names.iter().zip(&best.freedoms);
    let rules = rules.map(|(name, freedom)| format!("\"{name}\" = {{ {freedom} }}"));
    let of_set_up = |set_up| format!("\"{set_up}\" = {{ free = true }}");
    let rules = set_up.map_or_else(|| rules.collect::<Vec<_>>().join(", "), of_set_up);
    let verb = if is_single { "free it" } else { "free both" };
    let remedy = format!("{verb} in [parameters]: {rules}");
    let together = best.names[1..].iter().cloned();
    let alike: Vec<String> = together.chain(alike).collect();
    let numbers = [json!(best.names[0]), json!(alike), declared.rms.into(), best.trial.rms.into()];
    Some(Finding::new(FindingCode::HeldParameter, numbers, text).with_remedy(remedy))
}

/// Returns how far the base moved in a fit: the largest shift and turn of all sessions.
fn shown_base(fitting: &Fitting, end: &FitEnd) -> String {
    let mut squares: BTreeMap<usize, [f64; 2]> = BTreeMap::new();
    for (parameter, x) in fitting.model.parameters.iter().zip(&end.x) {
        if let ParameterSite::Base { base, axis } = parameter.site {
            squares.entry(base).or_default()[usize::from(axis >= 3)] += x * x;
        }
    }
    let largest = |k: usize| squares.values().map(|of| of[k]).fold(0.0, f64::max).sqrt();
    let [shift, turn] = [largest(0), largest(1)];
    format!("{:.3} mm and {:.4}°", shift * 1e3, turn.to_degrees())
}

/// Returns the pattern of the base or the tool if it is held and acts as the named parameter does:
/// the base as joint 1, the tool as the last joint.
fn held_set_up(fit: &CheckedFit, name: &str) -> Option<&'static str> {
    let is_of = |joint: usize| name.starts_with(&format!("joint{joint}."));
    if is_of(1) && !fit.is_base_free() {
        Some("base.*")
    } else if is_of(fit.problem.joints.len()) && fit.is_target_held() {
        Some("tool.*")
    } else {
        None
    }
}

/// Returns the freedom to write in `[parameters]` for a parameter with the deviation `x`: a usual
/// prior, unless it would contradict the deviation.
fn prior(parameter: &Parameter, x: f64) -> &'static str {
    match parameter.unit() {
        Unit::Angle if x.abs() <= MAX_PRIOR_SIGMAS * 1_f64.to_radians() => "sigma_deg = 1.0",
        Unit::Length if x.abs() <= MAX_PRIOR_SIGMAS * 5e-3 => "sigma_mm = 5.0",
        _ => "free = true",
    }
}

/// Returns the deviation `x` of a parameter with its unit.
fn shown(parameter: &Parameter, x: f64) -> String {
    let unit = parameter.unit().display(parameter.nominal);
    let value = x * unit.factor;
    format!("{} {}", number(value, decimals(value.abs(), 4) + 1), unit.symbol)
}

/// Returns the problem with the named parameters free, without priors.
fn with_free(declared: &Problem, names: impl IntoIterator<Item = String>) -> Problem {
    let mut problem = declared.clone();
    let rules = names.into_iter().map(|name| ParameterRule::free(name, declared));
    problem.parameters.extend(rules);
    problem
}

/// Returns the held parameters, and the pairs of them, that promise to explain most of the misfit,
/// best first.
///
/// The gain in χ² of a column h is (h⊥ᵀ r)² / ‖h⊥‖², where h⊥ is the part of h outside the columns
/// of the free parameters. These columns and r are extended by the rows of the priors. A second
/// column gains the same of its part outside the first one.
fn promising(fit: &CheckedFit) -> Option<[Vec<Vec<String>>; 2]> {
    let is_free = |name: &str| fit.model().parameters.iter().any(|found| found.name == name);
    let joints = 1..=fit.problem.joints.len();
    let all = joints.flat_map(|joint| FIELDS.map(|field| format!("joint{joint}.{field}")));
    let held: Vec<String> = all.filter(|name| !is_free(name)).collect();
    let problem = with_free(fit.problem, held.iter().cloned());
    let gains = fit.with_problem(&problem, |fitting| gains(fit, fitting, &held))?;
    let best = |count: usize| {
        let is_of =
            |(set, gain): &&(Vec<usize>, f64)| set.len() == count && *gain >= MIN_EXPECTED_SHARE;
        let mut sets: Vec<&(Vec<usize>, f64)> = gains.iter().filter(is_of).collect();
        sets.sort_by(|a, b| b.1.total_cmp(&a.1));
        let names = |(set, _): &(Vec<usize>, f64)| set.iter().map(|&k| held[k].clone()).collect();
        sets.into_iter().take(MAX_FITTED).map(names).collect()
    };
    Some([best(1), best(2)])
}

/// Returns the share of the misfit beyond noise that each of the `held` parameters, and each pair of
/// them, is expected to take away, with their indices, at the parameters of `fit`. `fitting` has all
/// of them free.
fn gains(fit: &CheckedFit, fitting: &Fitting, held: &[String]) -> Vec<(Vec<usize>, f64)> {
    let names = fit.model().parameters.iter().map(|parameter| parameter.name.as_str());
    let known: std::collections::HashMap<&str, f64> =
        names.zip(fit.end.x.iter().copied()).collect();
    let parameters = &fitting.model.parameters;
    let x = DVector::from_iterator(
        parameters.len(),
        parameters
            .iter()
            .map(|parameter| known.get(parameter.name.as_str()).copied().unwrap_or(0.0)),
    );
    let whole = fitting.whole();
    let (jacobian, residual) = {
        let residuals = whole.residuals(&x);
        jacobian_and_residual(&residuals, &residuals.unknowns_in(&x))
    };
    let place = |k: usize| whole.unknowns.iter().position(|&unknown| unknown == k);
    let is_known = |k: &usize| known.contains_key(parameters[*k].name.as_str());
    let free: Vec<usize> =
        (0..whole.unknowns.len()).filter(|&j| is_known(&whole.unknowns[j])).collect();
    let places: Vec<Option<usize>> = held
        .iter()
        .map(|name| place(parameters.iter().position(|parameter| parameter.name == *name)?))
        .collect();
    let columns: Vec<usize> =
        free.iter().copied().chain(places.iter().copied().flatten()).collect();
    let mut triangle = Triangle::of_rows(&jacobian.select_columns(&columns), &residual);
    let prior = |&column: &usize| {
        let k = whole.unknowns[column];
        let precision = parameters[k].sigma.map_or(0.0, |sigma| sigma.powi(-2));
        let ridge = RIDGE * jacobian.column(column).norm_squared() + f64::MIN_POSITIVE;
        let root = (precision + ridge).sqrt();
        (root, precision * x[k] / root)
    };
    triangle.absorb_diagonal(&free.iter().map(prior).collect::<Vec<(f64, f64)>>());
    let Linearisation { triangle, projected, .. } = triangle.into_linearisation();
    let misfit = residual.norm_squared() * (1.0 - fit.noise_factor.recip());
    let beyond_free = projected.rows_range(free.len()..);
    let beyond_free = beyond_free.clone_owned();
    let outside = |(column, (index, place)): (usize, (usize, usize))| {
        let part = triangle.column(free.len() + column);
        let part: DVector<f64> = part.rows_range(free.len()..).clone_owned();
        let before = jacobian.column(place).norm_squared();
        (part.norm_squared() > MIN_OWN_SHARE * before).then_some((index, part))
    };
    let placed = places.iter().enumerate().filter_map(|(index, place)| Some((index, (*place)?)));
    let outside: Vec<(usize, DVector<f64>)> = placed.enumerate().filter_map(outside).collect();
    let gain = |part: &DVector<f64>| part.dot(&beyond_free).powi(2) / part.norm_squared() / misfit;
    let mut gains = Vec::new();
    for (k, (first, part)) in outside.iter().enumerate() {
        let of_first = gain(part);
        gains.push((vec![*first], of_first));
        for (second, other) in &outside[..k] {
            let rest = other - part * (part.dot(other) / part.norm_squared());
            if rest.norm_squared() > MIN_OWN_SHARE * other.norm_squared() {
                gains.push((vec![*second, *first], of_first + gain(&rest)));
            }
        }
    }
    gains
}
