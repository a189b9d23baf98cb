//! How large the residual of a fit is against the declared σ, and which rows are beyond it.

use std::path::Path;

use super::document::{Block, first_of, named};
use super::errors::{brief, noun, rows_in, unit, with_unit};
use super::quantity::{counted, decimals, mm, number};
use crate::fit::{FindingCode, Identification, Noise, Outlier, size_of_kind};
use crate::problem::Problem;

/// Outliers that fit on a screen.
const SHOWN_OUTLIERS: usize = 20;
/// Rows that are named of those that carry the misfit.
const SHOWN_CARRIERS: usize = 3;
/// The file that holds them all.
const FILE: &str = "estimate.json";

/// How large the residual is against the declared noise.
pub(super) fn noise(problem: &Problem, found: &Identification) -> String {
    let of = &found.fitted.identification;
    match (found.noise, found.reduced_chi2) {
        (Noise::Estimated(sigma), _) => format!(
            "No σ is declared; the scatter about the fit gives {} per coordinate, model errors included.",
            with_unit(of, sigma)
        ),
        (Noise::Unknown, _) => {
            "No σ is declared, and the fit leaves nothing over to estimate it from: there are no standard errors."
                .to_owned()
        }
        (Noise::Declared, Some(_))
            if found.has(FindingCode::PriorsDecide) || found.has(FindingCode::TooFewEquations) =>
        {
            "There are not enough different poses to judge the declared σ, or the model.".to_owned()
        }
        (Noise::Declared, None) => "There are not enough measurements to judge the declared σ.".to_owned(),
        (Noise::Declared, Some(chi2)) if contradicted(found) => {
            let declared = problem.data.position_sigma.filter(|_| of.kind == "position");
            let declared =
                declared.map_or_else(String::new, |s| format!(" ({} mm)", mm(s, decimals(s * 1e3, 12).max(4))));
            let size = number(found.noise_factor.sqrt(), if found.noise_factor > 1.0 { 1 } else { 3 });
            // The σ of several kinds, which may have units of their own, are all multiplied by the
            // same.
            let taken = if found.kinds.is_empty() {
                format!("a σ of {} {}", brief(of, found.sigma_taken), unit(of))
            } else {
                format!("every declared σ times {size}")
            };
            let chance = found.chance.map_or_else(String::new, |(low, high)| {
                format!("; chance gives {} to {}", number(low, 2), number(high, 2))
            });
            let (size, cause) = if found.noise_factor > 1.0 {
                let cause = match &found.influential_rows {
                    Some(own) if own.rows.len() == 1 => {
                        format!("which 1 {} too far off to be noise carries", noun(found))
                    }
                    Some(own) => format!("which {} {}s too far off to be noise carry", own.rows.len(), noun(found)),
                    None => "so the model lacks something".to_owned(),
                };
                (format!("{size} times the declared σ{declared}"), cause)
            } else {
                (format!("{size} of the declared σ{declared}"), "which is too large".to_owned())
            };
            format!(
                "Reduced χ² is {}{chance}: the scatter is {size},\n\
                 {cause}. Fit and standard errors take {taken}, which residual and priors speak for.",
                short(chi2)
            )
        }
        (Noise::Declared, Some(chi2)) => {
            let of_chance = found.chance.filter(|&(low, high)| chi2 < low || chi2 > high);
            let Some((low, high)) = of_chance else {
                return format!("Reduced χ² is {}: the model explains the data to the declared σ.", number(chi2, 2));
            };
            let (than, what) = if chi2 > high { ("more", "explains") } else { ("less", "stands for") };
            format!(
                "Reduced χ² is {}; chance gives {} to {}: the fit leaves {than} than the declared σ {what}.\n\
                 Fit and standard errors take the declared σ: residual and priors together do not speak for another one.",
                short(chi2),
                number(low, 2),
                number(high, 2)
            )
        }
    }
}

/// Whether residual and priors contradict the declared σ.
fn contradicted(found: &Identification) -> bool {
    found.noise == Noise::Declared && (found.noise_factor - 1.0).abs() > 1e-9
}

/// Whether a fit leaves more than the declared noise explains.
pub fn lacks_something(found: &Identification) -> bool {
    let by_chi2 =
        || found.reduced_chi2.zip(found.chance).is_some_and(|(chi2, (_, high))| chi2 > high);
    found.noise == Noise::Declared
        && if contradicted(found) { found.noise_factor > 1.0 } else { by_chi2() }
}

/// A χ² / ν with two decimals, or two digits where it is small.
pub(super) fn short(chi2: f64) -> String {
    number(chi2, decimals(chi2, 6).clamp(2, 6))
}

/// Poses whose residual is too long to be noise; nothing to say without any.
pub(super) fn outliers<'a>(problem: &Problem, found: &Identification) -> Option<Block<'a>> {
    let treatment = if problem.robust.is_some() {
        "the robust loss keeps them from ruling the fit"
    } else {
        "they count in full; a section [robust] would limit them"
    };
    let known = found.outliers.iter().filter(|own| own.kind == "known distance").count();
    let (n, all) = (found.outliers.len(), rows_in(found, |errors| errors.identification) + known);
    let point = |own: &Outlier| {
        let known = if own.kind == "known distance" { " (known distance)" } else { "" };
        format!(
            "{}{known}: {}, {} σ of the scatter",
            own.location,
            size_of_kind(own.kind, own.error.norm(), 3),
            number(own.distance, 1)
        )
    };
    let points = first_of(found.outliers.iter().map(point), SHOWN_OUTLIERS, FILE);
    let are = if n == 1 { "is" } else { "are" };
    let words = format!(
        "{n} of {} {are} too far off to be noise ({treatment}):",
        counted(all, noun(found))
    );
    (n > 0).then_some(Block::Lines(words, points))
}

/// The rows that carry what the fit does not explain, and what it would leave without them; nothing
/// to say without any.
pub(super) fn carried<'a>(found: &Identification) -> Option<Block<'a>> {
    let own = found.influential_rows.as_ref()?;
    let row = |own: &Outlier| {
        format!("{} ({})", own.location, size_of_kind(own.kind, own.error.norm(), 3))
    };
    let (carry, them) = if own.rows.len() == 1 { ("carries", "it") } else { ("carry", "them") };
    let of = &found.fitted.identification;
    let left = match (own.reduced_chi2, found.reduced_chi2) {
        (Some(without), Some(all)) => {
            format!("χ²/ν is {} instead of {}", short(without), short(all))
        }
        _ => {
            format!(
                "the scatter is {} instead of {}",
                with_unit(of, own.sigma_taken),
                with_unit(of, found.sigma_taken)
            )
        }
    };
    Some(Block::Text(format!(
        "{} {carry} most of what the fit leaves: {}. Without {them} {left}.",
        counted(own.rows.len(), noun(found)),
        named(own.rows.iter().map(row), SHOWN_CARRIERS, ", ")
    )))
}

/// What to do about such rows, for a problem of that name, in one line.
pub fn show_influential_rows(found: &Identification, problem: &Path) -> Option<String> {
    let own = found.influential_rows.as_ref()?;
    let rows = named(own.rows.iter().map(|own| own.location.to_string()), SHOWN_CARRIERS, ", ");
    Some(format!(
        "look at {rows}; a section [robust] in {} limits what such rows do",
        problem.display()
    ))
}

/// How large the residual is, in brief.
pub(super) fn size(term: &'static str, found: &Identification) -> (&'static str, String) {
    let size = match (found.noise, found.reduced_chi2) {
        (Noise::Declared, Some(chi2)) => format!("χ²/ν {}", short(chi2)),
        (Noise::Estimated(sigma), _) => {
            let of = &found.fitted.identification;
            format!("{} {} per coordinate", brief(of, sigma), unit(of))
        }
        _ => "not to be judged".to_owned(),
    };
    (term, size)
}
