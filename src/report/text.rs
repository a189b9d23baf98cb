//! What `identify` prints.

use super::errors::unpredicted;
use super::parameters::{blind_text, correlation_text, parameter_table};
use std::fmt::Write as _;

use super::quantity::{number, table};
use crate::identify::{Distrust, ErrorSummary, Identification, Noise};
use crate::least_squares::Identifiability;
use crate::problem::Problem;

/// Outliers that fit on a screen.
const SHOWN_OUTLIERS: usize = 20;

/// A result as a table with its story, ending in a line break.
pub fn estimate_text(problem: &Problem, result: &Identification) -> String {
    [
        headline(problem, result),
        errors(result),
        noise(problem, result),
        outliers(problem, result),
        parameter_table(result),
        active_constraints(result),
        conditioning(&result.identifiability, result.unknowns.len(), result.coordinates),
        blind_text(&result.identifiability, &result.unknowns, "estimate.json"),
        correlation_text(result, "estimate.json"),
    ]
    .into_iter()
    .filter(|part| !part.is_empty())
    .collect::<Vec<_>>()
    .join("\n")
}

/// Why a fit is not to be trusted, in one line.
pub fn why_not_trusted(result: &Identification) -> String {
    match &result.distrust {
        Some(reason) => format!("the fit is not to be trusted: {reason}"),
        None => "the fit is to be trusted".to_owned(),
    }
}

fn headline(problem: &Problem, result: &Identification) -> String {
    let fitted = &result.fitted;
    let reason = result.solver_reason.map(|reason| format!(" (auto: {reason})")).unwrap_or_default();
    format!(
        "{}\n{} parameters from {} poses, {} poses held out; strategy {}, solver {}{reason}\n{} after {} steps, {:.3} s\n",
        problem.title,
        result.unknowns.len(),
        fitted.identification.n,
        fitted.held_out.n,
        result.strategy.as_str(),
        result.solver.as_str(),
        result.termination,
        result.iterations,
        result.seconds,
    )
}

fn errors(result: &Identification) -> String {
    let row = |poses: &str, when: &str, of: &ErrorSummary| {
        let values = [of.mean.x, of.mean.y, of.mean.z, of.mean.norm, of.rms.norm, of.max.norm];
        let mut row = vec![poses.to_owned(), when.to_owned()];
        row.extend(values.map(|value| number(value * 1e3, 4)));
        row
    };
    let (before, after) = (&result.registered, &result.fitted);
    let rows = vec![
        row("identification", "before", &before.identification),
        row("", "after", &after.identification),
        row("held out", "before", &before.held_out),
        row("", "after", &after.held_out),
    ];
    let header = ["error, mm", "", "mean x", "mean y", "mean z", "mean norm", "rms norm", "max norm"];
    let mut text = table(&header, rows, &[0, 1]);
    text.push_str("  before: nominal arm, with base and tool fitted where they are free\n");
    if let Some(words) = no_errors(result) {
        let _ = writeln!(text, "  –: {words}");
    }
    text
}

/// Poses whose errors an identification does not know.
pub(super) fn no_errors(result: &Identification) -> Option<String> {
    unpredicted(&[("the nominal arm", &result.registered), ("the arm as identified", &result.fitted)])
}

/// How large the residual is against the declared noise.
pub(super) fn noise(problem: &Problem, result: &Identification) -> String {
    match (result.noise, result.reduced_chi2) {
        (Noise::Estimated(sigma), _) => format!(
            "No σ is declared; the scatter about the fit gives {} mm per coordinate, model errors included.\n",
            number(sigma * 1e3, 4)
        ),
        (Noise::Unknown, _) => {
            "No σ is declared, and the fit leaves nothing over to estimate it from: there are no standard errors.\n"
                .to_owned()
        }
        (Noise::Declared, Some(_))
            if result.too_few_poses.is_some() || matches!(result.distrust, Some(Distrust::TooFewEquations { .. })) =>
        {
            "There are not enough different poses to judge the declared σ, or the model.\n".to_owned()
        }
        (Noise::Declared, None) => "There are not enough measurements to judge the declared σ.\n".to_owned(),
        (Noise::Declared, Some(chi2)) if result.noise_factor > 1.0 => {
            let declared = problem.data.position_sigma.map_or_else(String::new, |s| format!(" ({:.4} mm)", s * 1e3));
            format!(
                "Reduced χ² is {}: the residual is {} times the declared σ{declared}, so the model lacks something.\n\
                 Standard errors are raised by that factor.\n",
                number(chi2, 2),
                number(chi2.sqrt(), 1)
            )
        }
        (Noise::Declared, Some(chi2)) => {
            format!("Reduced χ² is {}: the model explains the data to the declared σ.\n", number(chi2, 2))
        }
    }
}

/// The constraints that hold parameters back; nothing to say without any.
fn active_constraints(result: &Identification) -> String {
    let active = &result.active_constraints;
    if active.is_empty() {
        return String::new();
    }
    let mut text = "Held by a constraint (standard errors are those along it):\n".to_owned();
    for constraint in active {
        let line = constraint.location.line.map_or_else(String::new, |line| format!("line {line}: "));
        let _ = writeln!(text, "  {line}{}", constraint.words);
    }
    text
}

/// Poses whose residual is too long to be noise; nothing to say without any.
pub(super) fn outliers(problem: &Problem, result: &Identification) -> String {
    let outliers = &result.outliers;
    if outliers.is_empty() {
        return String::new();
    }
    let treatment = if problem.robust.is_some() {
        "the robust loss keeps them from ruling the fit"
    } else {
        "they count in full; a section [robust] would limit them"
    };
    let (n, poses) = (outliers.len(), result.fitted.identification.n);
    let mut text = format!("{n} of {poses} poses are too far off to be noise ({treatment}):\n");
    for outlier in outliers.iter().take(SHOWN_OUTLIERS) {
        let (error, distance) = (number(outlier.error.norm() * 1e3, 3), number(outlier.distance, 1));
        let _ = writeln!(text, "  {}: {error} mm, {distance} σ of the scatter", outlier.location);
    }
    if n > SHOWN_OUTLIERS {
        let _ = writeln!(text, "  and {} more in estimate.json", n - SHOWN_OUTLIERS);
    }
    text
}

/// Rank, condition number and observability indices, in one line.
pub(super) fn conditioning(found: &Identifiability, unknowns: usize, coordinates: usize) -> String {
    let [o1, o2, o3, o4, o5] = found.observability(coordinates);
    format!(
        "At the nominal arm: rank {} of {unknowns}, condition number {:.3e}; observability O1 {o1:.3e}, O2 {o2:.3e}, O3 {o3:.3e}, O4 {o4:.3e}, O5 {o5:.3e}\n",
        found.rank,
        found.condition_number(),
    )
}
