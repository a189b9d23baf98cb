//! What `compensate` says and writes: commands as a table to run, and what they come to.

use std::fmt::Write as _;

use super::document::Block;
use super::quantity::{fixed, mm, number};
use super::render::text;
use super::table;
use crate::files::csv;
use crate::fit::Command;
use crate::measurement::Measurements;
use crate::problem::Problem;
use crate::results::CompensationResult;

/// What came of it, in words; targets that cannot be reached are named by file and line.
pub fn commands_text(problem: &Problem, targets: &Measurements, commands: &[Command]) -> String {
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

/// Decimals of commands: a nanometre, or a nanoradian.
const DECIMALS: usize = 9;

/// Joints that take a command, named and in the unit as the table of targets has them: index, name,
/// factor from SI.
fn columns(problem: &Problem, targets: &Measurements) -> Vec<(usize, String, f64)> {
    if targets.command_columns.is_empty() {
        let columns = table::commands(problem).into_iter();
        return columns.map(|own| (own.joint, own.column(), own.factor())).collect();
    }
    targets
        .command_columns
        .iter()
        .map(|own| (own.joint, own.name.clone(), own.unit.recip()))
        .collect()
}

/// The cell of an angle \[rad\] in degrees, empty where there is none.
fn degrees(angle: Option<f64>) -> String {
    angle.map_or_else(String::new, |angle| fixed(angle.to_degrees(), 6))
}

/// Commands as CSV: q of every moving joint (empty where the target is out of reach) with the names
/// and units of the table of targets, the desired position and orientation with what was set, and
/// how far from them the model expects the arm.
pub fn commands_csv(problem: &Problem, targets: &Measurements, commands: &[Command]) -> String {
    let (mut header, mut lines) = (Vec::new(), vec![Vec::new(); commands.len()]);
    let mut add = |name: &str, cell: &dyn Fn(&Command) -> String| {
        header.push(name.to_owned());
        lines.iter_mut().zip(commands).for_each(|(line, command)| line.push(cell(command)));
    };
    for (joint, name, factor) in columns(problem, targets) {
        // A controller must not be given a command that does not lead there.
        let show = |own: &Command| {
            if own.is_reached() { own.configuration[joint] * factor } else { f64::NAN }
        };
        add(&name, &|own| fixed(show(own), DECIMALS));
    }
    for (axis, name) in ["x_mm", "y_mm", "z_mm"].into_iter().enumerate() {
        add(name, &|own| fixed(targets.positions[own.row][axis] * 1e3, 4));
    }
    let turned = commands.iter().any(|command| command.turn.is_some());
    for (axis, name) in ["rx_deg", "ry_deg", "rz_deg"].into_iter().enumerate().filter(|_| turned) {
        add(name, &|own| {
            degrees(targets.orientation(own.row).map(|desired| desired.scaled_axis()[axis]))
        });
    }
    for (name, labels) in
        [("session", table::sessions(targets)), ("target", targets.target.as_ref())]
    {
        if let Some(labels) = labels {
            add(name, &|own| table::word(labels, own.row));
        }
    }
    for (name, values) in [("payload_kg", &targets.payload), ("hoist_N", &targets.hoist)] {
        if let Some(values) = values {
            add(name, &|own| fixed(values[own.row], 4));
        }
    }
    add("miss_mm", &|own| fixed(own.miss.norm() * 1e3, 4));
    add("miss_before_mm", &|own| fixed(own.seed_miss * 1e3, 4));
    if turned {
        add("turn_deg", &|own| degrees(own.turn.map(|turn| turn.norm())));
        add("turn_before_deg", &|own| degrees(own.seed_turn));
    }
    add("reached", &|own| own.is_reached().to_string());
    csv(header, lines)
}
