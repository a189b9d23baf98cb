//! Text and page of the command `watch`.

use std::fmt::Write as _;

use super::document::{Block, Table, last_parts, opening};
use super::figures::{ACCENT, Curve, Drawing, Series};
use super::render::Story;
use crate::life::{CauseKind, Change, MIN_EXPECTED_P, Watch, WatchedCause};
use crate::measurement::Measurements;
use crate::problem::Problem;
use crate::quantity::format::{
    MAX_DECIMALS, counted, decimals, number, or_dash, p_value, two_digits,
};
use crate::quantity::{Display, Unit};

/// Header of the table of causes.
const HEADER: [&str; 5] = ["cause", "probability", "change ± 1 σ", "error left out", "more poses"];

/// Returns the verdict, with a figure of the evidence after each of the tested `rows`. `is_trusted`
/// is true if the estimate is to be trusted.
pub(crate) fn watch(
    problem: &Problem,
    (watch, is_trusted): (&Watch, bool),
    rows: &Measurements,
) -> Story {
    let unit = watch.unit.display(0.0);
    let in_unit = |error: f64| format!("{} {}", two_digits(error * unit.factor, 4), unit.symbol);
    let (chi2, coordinates, p) = watch.chi2;
    let mut head = format!(
        "{} against the estimate; probability of any false alarm over all rows: at most {} %\n\n{}",
        counted(watch.rows, "row"),
        two_digits(100.0 * watch.false_alarm_rate, 3),
        verdict(watch)
    );
    let _ = write!(
        head,
        "\nError of the rows{}: {} rms{}",
        if watch.leaves_remainder {
            " without the remainder of the estimate, which this test leaves out"
        } else {
            ""
        },
        in_unit(watch.error),
        explanation(watch, is_trusted)
    );
    if let Some(left) = watch.unexplained_error() {
        let hidden = if watch.days > 0.0 {
            format!(
                "; the drift of {} hides what else has changed, which watch without --drift may \
                 name",
                days(watch.days)
            )
        } else {
            String::new()
        };
        let _ = write!(
            head,
            "\nThis cause is not the whole change, or another one acts: with it updated, left-out rows still err by {} rms, where \
             noise, the known misfit and the uncertainty of the estimate give {}{hidden}",
            in_unit(left),
            in_unit(watch.expected_error)
        );
    }
    if watch.left_out > 0 {
        let rows = counted(watch.left_out, "row");
        let _ = write!(head, "\n{rows} left out, because the estimate was fitted to them");
    }
    let mut blocks = opening(&problem.title, head).to_vec();
    blocks.push(Block::Page(vec![Block::Text(format!(
        "σ of a coordinate, known misfit included: {}; χ² = {} with {coordinates:.0} degrees of \
         freedom, p {}. The covariance also contains the uncertainty of the estimate and, if the rows state temperatures, effects of temperature as large as the misfit, so a small χ² is usual.",
        in_unit(watch.sigma),
        number(chi2, 1),
        p_value(p)
    ))]));
    blocks.push(Block::figures([control_chart(watch, rows)]));
    if watch.is_changed() {
        let rows = watch.causes.iter().flat_map(|cause| lines(cause, &in_unit)).collect();
        let left = format!(
            "error left out: rms of the rows if only this is updated, each row predicted from the others; noise, the known misfit and \
             the uncertainty of the estimate give {}",
            in_unit(watch.expected_error)
        );
        let notes = [
            "probability: among all causes that were tried, given that something changed",
            left.as_str(),
            "more poses: number of further poses like these that would distinguish this cause \
             from the next one; – there: none would, or there is no other cause",
        ];
        let changes = || watch.causes.iter().flat_map(|cause| &cause.changes);
        let rough = (!changes().all(is_nearly_linear)).then_some(
            "roughly: the errors are not linear in so large a change; a fit to the rows alone tells \
             its size",
        );
        let notes: Vec<&str> = notes.into_iter().chain(rough).collect();
        blocks.push(Block::Table(Table::new(&HEADER, rows, &[0, 2]).noted(&notes)));
    }
    Story::new(&problem.title, "watch", blocks)
}

/// Returns a number of days with its noun.
fn days(days: f64) -> String {
    let noun = if (days - 1.0).abs() < f64::EPSILON { "day" } else { "days" };
    let digits = if days.fract() == 0.0 { 0 } else { 2 };
    format!("{} {noun}", number(days, digits))
}

/// Says what explains the errors of rows without a change; empty if the arm has changed. Without a
/// trusted estimate nothing does.
fn explanation(watch: &Watch, is_trusted: bool) -> String {
    let drift = format!("{} of drift", days(watch.days));
    match (watch.p_without_drift, watch.chi2.2) {
        _ if !is_trusted => {
            "; the estimate is not to be trusted, so neither is this verdict".to_owned()
        }
        _ if watch.is_changed() => String::new(),
        (None, p) if p < MIN_EXPECTED_P => {
            ", more than noise and the known misfit explain".to_owned()
        }
        (Some(_), p) if p < MIN_EXPECTED_P => {
            format!(", more than noise, the known misfit and {drift} explain")
        }
        (Some(p), _) if watch.has_drifted() => format!(
            ", as expected from noise, the known misfit and {drift}; more than noise and the \
             known misfit alone explain (p {})",
            p_value(p)
        ),
        _ => ", as expected from noise and the known misfit".to_owned(),
    }
}

/// Draws the evidence for a change after each row, with the level of an alarm; `None` for fewer
/// than two evaluations.
fn control_chart(watch: &Watch, rows: &Measurements) -> Option<Drawing> {
    let evidence = watch.looks.iter().map(|look| (look.0 as f64, look.1 / 10_f64.ln()));
    // If rows were left out, the row numbers of the curve differ from those of the table.
    let first_rows = if watch.left_out == 0 { first_rows(rows) } else { Vec::new() };
    Series {
        names: ("watch-evidence", "Evidence for a change after each row"),
        caption: format!(
            "Common logarithm of the evidence for a change: how many times as probable the rows are with a change as without one. \
             The curve of an arm that has not changed ever reaches the orange line with a probability of at most {} %. Vertical \
             lines: the first row of each session or file.",
            two_digits(100.0 * watch.false_alarm_rate, 3)
        ),
        labels: ("row", "log₁₀ of the evidence"),
        curves: vec![Curve::new("evidence", ACCENT, evidence)],
        levels: vec![("alarm".to_owned(), -watch.false_alarm_rate.log10())],
        starts: first_rows,
        ..Series::default()
    }
    .drawing()
}

/// Returns the name and the first row (from 1) of each session, or of each file if sessions have no
/// names. Empty if there is only one session or file.
fn first_rows(rows: &Measurements) -> Vec<(String, f64)> {
    let session = |row: usize| rows.session.names.get(*rows.session.of_row.get(row)?);
    let file =
        |row: usize| rows.files.get(rows.origin.get(row)?.0 as usize).map(|file| last_parts(file));
    let mut found: Vec<(String, f64)> = Vec::new();
    for row in 0..rows.len() {
        let session = session(row).filter(|name| !name.is_empty()).cloned();
        let name = session.or_else(|| file(row)).unwrap_or_default();
        if found.last().is_none_or(|last| last.0 != name) {
            found.push((name, (row + 1) as f64));
        }
    }
    if found.len() > 1 { found } else { Vec::new() }
}

/// States whether the arm has changed, and what has changed.
fn verdict(watch: &Watch) -> String {
    let Some(row) = watch.changed_at else {
        let evidence = watch.looks.last().map_or(0.0, |look| look.1.exp());
        let alarm = number(1.0 / watch.false_alarm_rate, 0);
        return if evidence < 1.0 {
            format!(
                "No change shown: these rows are {} times as probable without a change as with one",
                two_digits(evidence.recip(), 4)
            )
        } else {
            format!(
                "No change shown: the evidence for one is {0} to 1, below the {alarm} to 1 of an alarm; \
                 chance reaches {0} to 1 in at most one of {0} cases",
                two_digits(evidence, 4)
            )
        };
    };
    let what = match (watch.named(), watch.causes.first()) {
        (Some(cause), _) if cause.kind == CauseKind::Other => {
            return format!(
                "The rows do not fit this arm, seen after {}: another arm, or units, signs or columns that are read wrongly, or a change \
                 that none of the causes tried explains",
                counted(row, "row")
            );
        }
        (Some(cause), _) if cause.kind == CauseKind::Misread => {
            return format!(
                "Not judged: the rows agree with the estimate if they are read in another way, \
                 with {}",
                cause.label
            );
        }
        (Some(cause), _) if cause.kind == CauseKind::Row && watch.unexplained_error().is_none() => {
            return format!(
                "One row does not fit, seen after {}: {}",
                counted(row, "row"),
                named(cause)
            );
        }
        (Some(cause), _) if watch.unexplained_error().is_some() => {
            format!("most probable of what was tried, but not the whole: {}", named(cause))
        }
        (Some(cause), _) => named(cause),
        (None, Some(cause)) => format!("cause uncertain; most probable: {}", named(cause)),
        (None, None) => String::new(),
    };
    format!("Changed, seen after {}: {what}", counted(row, "row"))
}

/// Returns the name of a cause, with the placement that moves the rows in the same way.
fn named(cause: &WatchedCause) -> String {
    match &cause.alike {
        Some(alike) => format!("{} (or {alike}, whose move looks the same)", cause.label),
        None => cause.label.clone(),
    }
}

/// Returns the lines of a cause in the table of causes. Each change of two causes together has a
/// separate line.
fn lines(cause: &WatchedCause, in_unit: &impl Fn(f64) -> String) -> Vec<Vec<String>> {
    let largest = cause.kind.largest_ratio().zip(cause.changes.last());
    let is_at_end = largest.is_some_and(|(largest, last)| last.change >= largest);
    let changes: Vec<String> =
        cause.changes.iter().map(|changed| change(cause.kind, changed, is_at_end)).collect();
    let (first, others) = match (cause.kind, changes.split_first()) {
        (_, None) => ("–".to_owned(), &[][..]),
        (CauseKind::Two, Some((first, others))) => (first.clone(), others),
        _ => (changes.join(", "), &[][..]),
    };
    let line = vec![
        named(cause),
        format!("{:.3}", cause.probability),
        first,
        or_dash(cause.left_out_error, in_unit),
        or_dash(cause.poses_to_tell_apart, |poses| poses.to_string()),
    ];
    let other = |change: &String| {
        let mut line = vec![String::new(); HEADER.len()];
        line[2].clone_from(change);
        line
    };
    std::iter::once(line).chain(others.iter().map(other)).collect()
}

/// Largest change of the logarithm of a stiffness that is stated with a standard error. Rows are
/// predicted as linear in this logarithm, which is wrong by a tenth of the change at this size.
const MAX_LINEAR_CHANGE: f64 = 0.2;

/// Returns false if a stiffness changes by so much that its size and its standard error are not known
/// well.
fn is_nearly_linear(change: &Change) -> bool {
    !change.unit.is_relative() || change.change.abs() <= MAX_LINEAR_CHANGE
}

/// Formats a change with its standard error; the name is the part of the parameter's name after the
/// last dot, or the whole name where two causes changed. A turn has no standard error. Neither has a
/// ratio of the noise: it is the best of some trial values, the largest one if `is_largest`.
fn change(kind: CauseKind, change: &Change, is_largest: bool) -> String {
    let Display { factor, symbol } = change.unit.display(change.change);
    let name = match kind {
        CauseKind::Two => &change.parameter,
        _ => change.parameter.rsplit('.').next().unwrap_or_default(),
    };
    if change.unit.is_relative() {
        let ratio = change.change.exp();
        let percent = 100.0 * (ratio - 1.0);
        if !is_nearly_linear(change) {
            return format!("{name} roughly {} %", number(percent, 0));
        }
        let error = 100.0 * ratio * change.std_error;
        let digits = decimals(error, MAX_DECIMALS);
        return format!("{name} {} ± {} %", number(percent, digits), number(error, digits));
    }
    if !change.std_error.is_finite() && change.unit != Unit::Number {
        return format!("{name} {} {symbol}", number(change.change * factor, 2));
    }
    if !change.std_error.is_finite() {
        let ratio = two_digits(change.change, 2);
        return if is_largest {
            format!("noise {ratio} times the known σ, or more")
        } else {
            format!("noise about {ratio} times the known σ")
        };
    }
    let digits = decimals(change.std_error * factor, MAX_DECIMALS);
    let show = |value: f64| number(value * factor, digits);
    format!("{name} {} ± {} {symbol}", show(change.change), show(change.std_error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stiffness_changes_by_the_exponential_of_its_logarithm() {
        let words = |change_of_ln| {
            let parameter = "joint2.stiffness".to_owned();
            let unit = Unit::TorsionalStiffness;
            let changed = Change { parameter, unit, change: change_of_ln, std_error: 0.002 };
            change(CauseKind::Stiffness, &changed, false)
        };
        assert_eq!(words(-0.1), "stiffness -9.52 ± 0.18 %");
        assert_eq!(words(-0.7404), "stiffness roughly -52 %");
    }
}
