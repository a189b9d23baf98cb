//! Commands of `compensate`, as a table to run and as JSON.

use std::fmt::Write as _;

use serde::Serialize;

use super::cells::quoted;
use super::json::to_text;
use super::quantity::{fixed, number};
use crate::identify::Command;
use crate::measurement::{Labels, Measurements};
use crate::problem::{JointKind, Problem};

#[derive(Debug, Serialize)]
struct Document<'a> {
    problem: &'a str,
    targets: usize,
    reached: usize,
    /// Over the targets that can be reached, as the model expects it.
    mean_miss_before_mm: Option<f64>,
    mean_miss_mm: Option<f64>,
    /// Rows of the targets that cannot be reached, counted from 1.
    unreached: Vec<usize>,
}

/// Commands as CSV: q of every moving joint (empty where the target is out of reach), the desired position with what was
/// set, and how far from it the model expects the arm.
pub fn commands_csv(problem: &Problem, targets: &Measurements, commands: &[Command]) -> String {
    let joints: Vec<(usize, &str, f64)> = problem
        .joints
        .iter()
        .enumerate()
        .filter_map(|(j, joint)| match joint.kind {
            JointKind::Revolute => Some((j, "deg", 180.0 / std::f64::consts::PI)),
            JointKind::Prismatic => Some((j, "mm", 1e3)),
            JointKind::Fixed => None,
        })
        .collect();
    let mut lines: Vec<String> = Vec::with_capacity(commands.len() + 1);
    let value = |column: &Option<Vec<f64>>, row: usize| column.as_ref().map(|values| fixed(values[row], 4));
    let word = |labels: &Labels, row: usize| quoted(&labels.names[labels.of_row[row]]);
    let has_sessions = targets.session.names.iter().any(|name| !name.is_empty());
    let mut header: Vec<String> = joints.iter().map(|(j, unit, _)| format!("q{}_{unit}", j + 1)).collect();
    let optional = [
        ("session", has_sessions),
        ("target", targets.target.is_some()),
        ("payload_kg", targets.payload.is_some()),
        ("hoist_N", targets.hoist.is_some()),
    ];
    header.extend(["x_mm", "y_mm", "z_mm"].map(str::to_owned));
    header.extend(optional.iter().filter(|(_, there)| *there).map(|(name, _)| (*name).to_owned()));
    header.extend(["miss_mm", "miss_before_mm", "reached"].map(str::to_owned));
    lines.push(header.join(","));
    for command in commands {
        let row = command.row;
        // A controller must not be given a command that does not lead there.
        let show = |value: String| if command.is_reached() { value } else { String::new() };
        let mut cells: Vec<String> =
            joints.iter().map(|&(j, _, factor)| show(fixed(command.configuration[j] * factor, 7))).collect();
        cells.extend(targets.positions[row].iter().map(|x| fixed(x * 1e3, 4)));
        cells.extend(has_sessions.then(|| word(&targets.session, row)));
        cells.extend(targets.target.as_ref().map(|labels| word(labels, row)));
        cells.extend(value(&targets.payload, row));
        cells.extend(value(&targets.hoist, row));
        cells.push(fixed(command.miss.norm() * 1e3, 4));
        cells.push(fixed(command.seed_miss * 1e3, 4));
        cells.push(command.is_reached().to_string());
        lines.push(cells.join(","));
    }
    lines.join("\n") + "\n"
}

/// What came of it, as JSON text.
pub fn commands_json(problem: &Problem, commands: &[Command]) -> String {
    to_text(&document(problem, commands))
}

/// What came of it, in words; targets that cannot be reached are named by file and line.
pub fn commands_text(problem: &Problem, targets: &Measurements, commands: &[Command]) -> String {
    let document = document(problem, commands);
    let mut text = format!("{}\n{} of {} targets can be reached", problem.title, document.reached, document.targets);
    if let (Some(after), Some(before)) = (document.mean_miss_mm, document.mean_miss_before_mm) {
        let _ = write!(
            text,
            ": {after:.4} mm from them on average with these commands, {before:.4} mm with those in the file,\n\
             as the identified arm predicts"
        );
    }
    text.push('\n');
    for command in commands.iter().filter(|command| !command.is_reached()) {
        let place = targets.location(command.row);
        text.push_str("  out of reach: ");
        text.push_str(&place.to_string());
        text.push_str(", nearest ");
        text.push_str(&number(command.miss.norm() * 1e3, 2));
        text.push_str(" mm away\n");
    }
    text
}

fn document<'a>(problem: &'a Problem, commands: &[Command]) -> Document<'a> {
    let reached: Vec<&Command> = commands.iter().filter(|command| command.is_reached()).collect();
    let mean = |of: &dyn Fn(&Command) -> f64| {
        let sum: f64 = reached.iter().map(|command| of(command)).sum();
        (!reached.is_empty()).then(|| sum / reached.len() as f64 * 1e3)
    };
    Document {
        problem: &problem.name,
        targets: commands.len(),
        reached: reached.len(),
        mean_miss_before_mm: mean(&|command| command.seed_miss),
        mean_miss_mm: mean(&|command| command.miss.norm()),
        unreached: commands.iter().filter(|command| !command.is_reached()).map(|command| command.row + 1).collect(),
    }
}
