//! Errors of arms in words: before and after, and poses whose errors nobody knows.

use super::quantity::{about_three_digits, counted, number};
use crate::fit::{ErrorSummary, Errors, Identification};
use crate::observation::kind_named;

/// The arm before anything was identified.
pub(super) const NOMINAL: &str = "nominal arm, base and tool fitted";

/// What errors of a kind of rows are, and in which unit they are shown.
pub(super) fn measure(of: &ErrorSummary) -> &'static str {
    kind_named(of.kind).error_label
}

/// An error, or the difference of two, of the kind of rows of `of` in the unit in which it is
/// shown: mm, of tilts °.
pub(super) fn in_unit(of: &ErrorSummary, value: f64) -> f64 {
    if of.is_angle() { value.to_degrees() } else { value * 1e3 }
}

/// The same with four decimals.
pub(super) fn shown(of: &ErrorSummary, value: f64) -> String {
    number(in_unit(of, value), 4)
}

/// The axes along which errors of a kind of rows are told.
pub(super) fn axes(of: &ErrorSummary) -> usize {
    Some(kind_named(of.kind).numbers).filter(|numbers| *numbers > 1).unwrap_or(0)
}

/// The same with its unit.
pub(super) fn with_unit(of: &ErrorSummary, value: f64) -> String {
    format!("{} {}", shown(of, value), unit(of))
}

/// The same with about three digits.
pub(super) fn brief(of: &ErrorSummary, value: f64) -> String {
    about_three_digits(in_unit(of, value))
}

/// The unit in which errors of a kind of rows are shown.
pub(super) fn unit(of: &ErrorSummary) -> &'static str {
    if of.is_angle() { "°" } else { "mm" }
}

/// Cells of a table of errors: whose, on which poses, mean, rms and largest.
pub(super) fn row(poses: &str, arm: &str, of: &ErrorSummary) -> Vec<String> {
    [vec![poses.to_owned(), arm.to_owned()], sizes(of).to_vec()].concat()
}

/// Mean, rms and largest.
pub(super) fn sizes(of: &ErrorSummary) -> [String; 3] {
    [of.mean.norm, of.rms.norm, of.max.norm].map(|value| shown(of, value))
}

/// "mean 0.1 mm, rms 0.2 mm".
pub(super) fn mean_and_rms(of: &ErrorSummary) -> String {
    format!("mean {}, rms {}", with_unit(of, of.mean.norm), with_unit(of, of.rms.norm))
}

/// How many rows of each kind there are on one part of the data: "50 poses", "71 contacts with
/// points, 47 distances". Known distances between points are none of the arm's.
pub(super) fn rows_of(found: &Identification, part: fn(&Errors) -> ErrorSummary) -> String {
    let parts: Vec<String> = measured_kinds(found, part)
        .filter(|of| of.n > 0)
        .map(|of| counted_rows(found, &of, ""))
        .collect();
    if parts.is_empty() { counted_rows(found, &part(&found.fitted), "") } else { parts.join(", ") }
}

/// "50 poses to identify, 20 held out", the latter of the kind of rows that errors are told of.
pub(super) fn both_parts(found: &Identification) -> String {
    let held_out = if found.kinds.is_empty() {
        found.fitted.held_out.n.to_string()
    } else {
        rows_of(found, |errors| errors.held_out)
    };
    format!("{} to identify, {held_out} held out", rows_of(found, |errors| errors.identification))
}

/// How many held-out rows the errors speak of: "50 held-out poses", "16 held-out contacts with
/// points".
pub(super) fn held_out_rows(found: &Identification) -> String {
    counted_rows(found, &found.fitted.held_out, "held-out ")
}

/// How many rows of a kind there are, with an adjective that ends in a space.
fn counted_rows(found: &Identification, of: &ErrorSummary, adjective: &str) -> String {
    let (one, many) = match kind_named(of.kind).row {
        words if words.0 != "pose" => words,
        _ if !found.kinds.is_empty() => ("position", "positions"),
        _ if found.several_targets && adjective.is_empty() => ("point", "points"),
        _ => ("pose", "poses"),
    };
    format!("{} {adjective}{}", of.n, if of.n == 1 { one } else { many })
}

/// What rows are called where they may be of any kind.
pub(super) fn noun(found: &Identification) -> &'static str {
    let positions = found.kinds.is_empty() && found.fitted.identification.kind == "position";
    if positions { "pose" } else { "row" }
}

/// How many rows there are of all kinds on one part of the data.
pub(super) fn rows_in(found: &Identification, part: fn(&Errors) -> ErrorSummary) -> usize {
    measured_kinds(found, part).map(|of| of.n).sum()
}

/// One part of the data kind by kind, known distances between points left out.
fn measured_kinds(
    found: &Identification,
    part: fn(&Errors) -> ErrorSummary,
) -> impl Iterator<Item = ErrorSummary> + use<'_> {
    let alone = found.kinds.is_empty().then(|| part(&found.fitted));
    let each = found
        .kinds
        .iter()
        .map(move |(_, fitted)| part(fitted))
        .filter(|of| of.kind != "known distance");
    alone.into_iter().chain(each)
}

/// For each arm by name the poses that have no equilibrium with it, so that no mean over their
/// errors exists; `None` where all errors are known.
pub(super) fn unpredicted(arms: &[(&str, &Errors)]) -> Option<String> {
    let mut parts = Vec::new();
    for (arm, errors) in arms {
        for (poses, of) in
            [("held-out", &errors.held_out), ("identification", &errors.identification)]
        {
            if of.unpredicted > 0 {
                parts.push(format!("{} with {arm}", without_equilibrium(of, poses)));
            }
        }
    }
    let poses = parts.join("; ");
    let all = arms.iter().flat_map(|(_, errors)| [&errors.held_out, &errors.identification]);
    match poses.as_str() {
        "" if all.into_iter().all(|of| of.rms.norm.is_finite()) => None,
        "" => Some("Some errors are too large for their squares to be numbers.".to_owned()),
        _ => Some(format!("{poses}. Over such poses there is no mean, rms or largest error.")),
    }
}

/// "3 of 50 held-out poses have no equilibrium".
pub(super) fn without_equilibrium(of: &ErrorSummary, poses: &str) -> String {
    let have = if of.unpredicted == 1 { "has" } else { "have" };
    format!(
        "{} of {} {have} no equilibrium",
        of.unpredicted,
        counted(of.n, &format!("{poses} pose"))
    )
}
