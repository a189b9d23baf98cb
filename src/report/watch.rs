//! Text of the command `watch`.

use std::fmt::Write as _;

use super::document::{Block, Table};
use super::render::text;
use crate::life::{Change, NAMED, Watch, WatchedCause};
use crate::problem::Problem;
use crate::quantity::format::{counted, decimals, number, or_dash, p_value, two_digits};

/// Header of the table of causes.
const HEADER: [&str; 5] = ["cause", "probability", "change ± 1 σ", "error left out", "more poses"];
/// Maximum number of decimals of a change.
const MAX_DECIMALS: usize = 6;

/// Returns the verdict as text, ending in a line break.
pub fn watch_text(problem: &Problem, watch: &Watch) -> String {
    let unit = watch.unit.display(0.0);
    let in_unit = |error: f64| format!("{} {}", two_digits(error * unit.factor, 4), unit.symbol);
    let (chi2, coordinates, p) = watch.chi2;
    let mut head = format!(
        "{}\n{} against the estimate; false alarms of all looks together: at most {} %\n\n{}",
        problem.title,
        counted(watch.rows, "row"),
        two_digits(100.0 * watch.false_alarm_rate, 3),
        verdict(watch)
    );
    let _ = write!(
        head,
        "\nError of the rows: {} rms; σ of a coordinate, known misfit included: {}; χ² {} of {coordinates:.0}, p {}",
        in_unit(watch.error),
        in_unit(watch.sigma),
        number(chi2, 1),
        p_value(p)
    );
    if watch.left_out > 0 {
        let rows = counted(watch.left_out, "row");
        let _ = write!(head, "\n{rows} left out, because the estimate was fitted to them");
    }
    let mut blocks = vec![Block::lines(head)];
    if watch.is_changed() {
        let rows = watch.causes.iter().map(|cause| row(cause, &in_unit)).collect();
        let notes = [
            "probability: among all causes that were tried, given that something changed",
            "error left out: rms of the rows if only this is updated, each row predicted from the others",
            "more poses: number of further poses like these that would tell this cause from the next one; –: none would",
        ];
        blocks.push(Block::Table(Table::new(&HEADER, rows, &[0, 2]).noted(&notes)));
    }
    text(&blocks)
}

/// States whether the arm has changed, and what.
fn verdict(watch: &Watch) -> String {
    let evidence = watch.looks.last().map_or(0.0, |look| look.1 / 10_f64.ln());
    let Some(row) = watch.changed_at else {
        return format!("Unchanged: the evidence for a change is 10^{}", number(evidence, 1));
    };
    let what = match watch.causes.first() {
        Some(cause) if cause.probability >= NAMED => cause.label.clone(),
        Some(cause) => format!("not certain what; first {}", cause.label),
        None => String::new(),
    };
    format!("Changed, seen after {}: {what}", counted(row, "row"))
}

fn row(cause: &WatchedCause, in_unit: &impl Fn(f64) -> String) -> Vec<String> {
    let changes: Vec<String> = cause.changes.iter().map(change).collect();
    vec![
        cause.label.clone(),
        format!("{:.3}", cause.probability),
        if changes.is_empty() { "–".to_owned() } else { changes.join(", ") },
        or_dash(cause.left_out_error, in_unit),
        or_dash(cause.poses_to_tell_apart, |poses| poses.to_string()),
    ]
}

/// Formats a change with its standard error, without the word before the last dot of the name.
fn change(change: &Change) -> String {
    let (factor, symbol) = if change.unit.is_relative() {
        (100.0, "%".to_owned())
    } else {
        let unit = change.unit.display(change.change);
        (unit.factor, unit.symbol)
    };
    let name = change.parameter.rsplit('.').next().unwrap_or_default();
    if !change.std_error.is_finite() {
        return format!("{name} {}", number(change.change, 1));
    }
    let digits = decimals(change.std_error * factor, MAX_DECIMALS);
    let show = |value: f64| number(value * factor, digits);
    format!("{name} {} ± {} {symbol}", show(change.change), show(change.std_error))
}
