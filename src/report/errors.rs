//! Errors in words: names of arms, labels and units by kind of rows, counts of rows, and poses
//! without an equilibrium.

use crate::fit::{ErrorSummary, Errors, Identification};
use crate::observation::kind_named;
use crate::quantity::Unit;
use crate::quantity::format::{about_three_digits, counted, number};
use crate::results::measured_kinds;

/// Returns the table header for errors of a kind of rows, with the unit.
pub(super) fn error_label(of: &ErrorSummary) -> &'static str {
    kind_named(of.kind).error_label
}

/// Formats an error \[m\], \[rad\] or \[px\] with four decimals, in the unit of its kind of rows
/// (mm, ° or px).
pub(super) fn format_error(of: &ErrorSummary, value: f64) -> String {
    number(of.in_unit(value), 4)
}

/// Returns the number of axes along which errors of a kind of rows are listed; 0 for a kind with a
/// single number.
pub(super) fn axis_count(of: &ErrorSummary) -> usize {
    Some(kind_named(of.kind).numbers).filter(|numbers| *numbers > 1).unwrap_or(0)
}

/// Formats an error \[m\], \[rad\] or \[px\] with four decimals and its unit.
pub(super) fn with_unit(of: &ErrorSummary, value: f64) -> String {
    format!("{} {}", format_error(of, value), unit(of))
}

/// Formats an error \[m\], \[rad\] or \[px\] with about three significant digits, in the unit of
/// its kind of rows (mm, ° or px).
pub(super) fn brief(of: &ErrorSummary, value: f64) -> String {
    about_three_digits(of.in_unit(value))
}

/// Returns the unit in which errors of a kind of rows are shown: mm, ° or px.
pub(super) fn unit(of: &ErrorSummary) -> &'static str {
    of.unit().in_tables().symbol
}

/// Returns a table header with the unit of the errors after it.
pub(super) fn with_unit_of(of: &ErrorSummary, words: &str) -> String {
    format!("{words}, {}", unit(of))
}

/// Formats the mean, rms and largest error length.
pub(super) fn mean_rms_max(of: &ErrorSummary) -> [String; 3] {
    [of.mean.norm, of.rms.norm, of.max.norm].map(|value| format_error(of, value))
}

/// States the number of rows of each kind in one part of the data: "50 poses", "71 contacts with
/// points, 47 distances". Known distances between points are left out.
pub(super) fn rows_of(found: &Identification, part: fn(&Errors) -> ErrorSummary) -> String {
    let parts: Vec<String> = measured_kinds(found, part)
        .filter(|of| of.n > 0)
        .map(|of| counted_rows(found, &of, ""))
        .collect();
    if parts.is_empty() { counted_rows(found, &part(&found.fitted), "") } else { parts.join(", ") }
}

/// States the number of rows in both parts of the data: "50 poses to identify, 20 held out".
pub(super) fn both_parts(found: &Identification) -> String {
    if found.fitted.is_left_out {
        let rows = rows_of(found, |errors| errors.identification);
        return format!("{rows} to identify, none held out");
    }
    let held_out = if found.kinds.is_empty() {
        found.fitted.held_out.n.to_string()
    } else {
        rows_of(found, |errors| errors.held_out)
    };
    format!("{} to identify, {held_out} held out", rows_of(found, |errors| errors.identification))
}

/// Returns the word for the rows that test the fit: "held out" or "left out". They are left out if
/// no row is held out: each configuration is then predicted by a fit without it.
pub(super) fn test_rows_word(errors: &Errors) -> &'static str {
    if errors.is_left_out { "left out" } else { "held out" }
}

/// States the number of held-out (or left-out) rows of the leading kind (positions, if there are
/// any): "50 held-out poses".
pub(super) fn held_out_rows(found: &Identification) -> String {
    let adjective = if found.fitted.is_left_out { "left-out " } else { "held-out " };
    counted_rows(found, &found.fitted.held_out, adjective)
}

/// States the number of rows of a kind; `adjective` precedes the noun and ends in a space.
fn counted_rows(found: &Identification, of: &ErrorSummary, adjective: &str) -> String {
    let (one, many) = match kind_named(of.kind).row {
        words if words.0 != "pose" => words,
        _ if !found.kinds.is_empty() => ("position", "positions"),
        _ if found.several_targets => ("point", "points"),
        _ => ("pose", "poses"),
    };
    format!("{} {adjective}{}", of.n, if of.n == 1 { one } else { many })
}

/// Returns the noun for one row of the data: "pose" if all rows measure positions, "point" if poses
/// have several targets, else "row".
pub(super) fn row_noun(found: &Identification) -> &'static str {
    let positions = found.kinds.is_empty() && found.fitted.identification.kind == "position";
    match positions {
        true if found.several_targets => "point",
        true => "pose",
        false => "row",
    }
}

/// States for each arm how many poses have no equilibrium, because of which it has no mean errors.
/// Also says if errors overflow. `None` if all errors are finite.
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
    let errors_of_arms =
        arms.iter().flat_map(|(_, errors)| [&errors.held_out, &errors.identification]);
    match poses.as_str() {
        "" if errors_of_arms.into_iter().all(|of| of.rms.norm.is_finite()) => None,
        "" => Some("Some errors are too large for their squares to be numbers.".to_owned()),
        _ => Some(format!("{poses}. Over such poses there is no mean, rms or largest error.")),
    }
}

/// States the number of poses without an equilibrium (of images also: behind the camera): "3 of 50
/// held-out poses have no equilibrium".
pub(super) fn without_equilibrium(of: &ErrorSummary, poses: &str) -> String {
    let is_image = kind_named(of.kind).unit == Unit::Pixel;
    let have = match (is_image, of.unpredicted) {
        (true, 1) => "lies behind the camera or has",
        (true, _) => "lie behind the camera or have",
        (false, 1) => "has",
        (false, _) => "have",
    };
    format!(
        "{} of {} {have} no equilibrium",
        of.unpredicted,
        counted(of.n, &format!("{poses} pose"))
    )
}

/// Name of the nominal arm, with base and tool fitted if these are free.
pub(super) const NOMINAL_ARM: &str = "nominal arm";
/// Name of the fitted arm of the declared problem.
pub(super) const DECLARED_ARM: &str = "as declared, fitted";
/// Name of the arm of the extended problem.
pub(super) const EXTENDED_ARM: &str = "with what was added";
/// Name of the arm of the last fit, whose predictions a remainder corrects.
pub(super) const CORRECTED_ARM: &str = "with the remainder";
