//! Text and table of `compensate`.

use std::fmt::Write as _;

use super::document::Block;
use super::quantity::{fixed, mm, number};
use super::remainder::{bounded, uncertainty};
use super::render::text;
use super::table;
use crate::files::csv;
use crate::fit::Command;
use crate::measurement::Measurements;
use crate::problem::Problem;
use crate::remainder::Bounds;
use crate::results::CompensationResult;

/// Returns the outcome as text, with file and line of the targets that cannot be reached.
pub fn commands_text(
    problem: &Problem,
    targets: &Measurements,
    commands: &[Command],
    bounds: Option<&Bounds>,
) -> String {
    let result = CompensationResult::new(problem, commands);
    let mut words = format!(
        "{}\n{} of {} targets can be reached",
        problem.title, result.reached, result.targets
    );
    if let (Some(before), Some(after)) = (result.mean_miss_before_mm, result.mean_miss_mm) {
        let _ = write!(
            words,
            ": {} mm from them on average with these commands, {} mm with those in the file, \
             as the identified arm predicts",
            number(after, 4),
            number(before, 4)
        );
    }
    if let (Some(before), Some(after)) = (result.mean_turn_before_deg, result.mean_turn_deg) {
        let _ = write!(
            words,
            "; turned by {}° on average, {}° before",
            number(after, 4),
            number(before, 4)
        );
    }
    if let Some(bounds) = bounds {
        let _ = write!(words, ".\n{}", bounded(bounds, None));
    }
    let point = |command: &Command| {
        let (place, miss) = (targets.location(command.row), command.miss.norm());
        if miss.is_finite() {
            format!("out of reach: {place}, nearest {} mm away", mm(miss, 2))
        } else {
            format!("out of reach: {place}, the identified arm does not come to rest there")
        }
    };
    let points = commands.iter().filter(|command| !command.is_reached()).map(point).collect();
    text(&[Block::Lines(words, points)])
}

/// Decimals of commands, to a nanometre or a nanoradian.
const DECIMALS: usize = 9;

/// Returns index, column name and factor from SI of each commanded joint, as in the table of
/// targets.
fn columns(problem: &Problem, targets: &Measurements) -> Vec<(usize, String, f64)> {
    if targets.command_columns.is_empty() {
        let columns = table::commands(problem).into_iter();
        return columns.map(|column| (column.joint, column.column(), column.factor())).collect();
    }
    targets
        .command_columns
        .iter()
        .map(|column| (column.joint, column.name.clone(), column.unit.recip()))
        .collect()
}

/// Formats an angle \[rad\] in degrees; empty for `None`.
fn degrees(angle: Option<f64>) -> String {
    angle.map_or_else(String::new, |angle| fixed(angle.to_degrees(), 6))
}

/// Returns commands as CSV: q of every moving joint (empty if the target is out of reach) with the
/// names and units of the table of targets, desired pose and conditions, and predicted distances.
pub fn commands_csv(
    problem: &Problem,
    targets: &Measurements,
    commands: &[Command],
    bounds: Option<&Bounds>,
) -> String {
    let (mut header, mut lines) = (Vec::new(), vec![Vec::new(); commands.len()]);
    let mut add = |name: &str, cell: &dyn Fn(&Command) -> String| {
        header.push(name.to_owned());
        lines.iter_mut().zip(commands).for_each(|(line, command)| line.push(cell(command)));
    };
    for (joint, name, factor) in columns(problem, targets) {
        // A controller must not receive a command that misses the target.
        let show = |command: &Command| {
            if command.is_reached() { command.configuration[joint] * factor } else { f64::NAN }
        };
        add(&name, &|command| fixed(show(command), DECIMALS));
    }
    for (axis, name) in ["x_mm", "y_mm", "z_mm"].into_iter().enumerate() {
        add(name, &|command| fixed(targets.positions[command.row][axis] * 1e3, 4));
    }
    let turned = commands.iter().any(|command| command.turn.is_some());
    for (axis, name) in ["rx_deg", "ry_deg", "rz_deg"].into_iter().enumerate().filter(|_| turned) {
        add(name, &|command| {
            degrees(targets.orientation(command.row).map(|desired| desired.scaled_axis()[axis]))
        });
    }
    for (name, labels) in
        [("session", table::sessions(targets)), ("target", targets.target.as_ref())]
    {
        if let Some(labels) = labels {
            add(name, &|command| table::word(labels, command.row));
        }
    }
    for (name, values) in [("payload_kg", &targets.payload), ("hoist_N", &targets.hoist)] {
        if let Some(values) = values {
            add(name, &|command| fixed(values[command.row], 4));
        }
    }
    add("miss_mm", &|command| fixed(command.miss.norm() * 1e3, 4));
    add("miss_before_mm", &|command| fixed(command.seed_miss * 1e3, 4));
    if turned {
        add("turn_deg", &|command| degrees(command.turn.map(|turn| turn.norm())));
        add("turn_before_deg", &|command| degrees(command.seed_turn));
    }
    add("reached", &|command| command.is_reached().to_string());
    for (name, column) in bounds.into_iter().flat_map(uncertainty) {
        header.push(name);
        for (row, line) in lines.iter_mut().enumerate() {
            line.push(column.cell(row));
        }
    }
    csv(header, lines)
}
