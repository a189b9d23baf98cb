//! What `compensate` says and writes: commands as a table to run, and what they come to.

use std::fmt::Write as _;

use super::document::Block;
use super::json::{object, to_text};
use super::quantity::{fixed, mm, quoted};
use super::render::text;
use crate::identify::Command;
use crate::measurement::{Labels, Measurements};
use crate::problem::{JointKind, Problem};

object! {
    Document<'a>(problem: &'a Problem, commands: &[Command], reached: &[&Command]) {
        problem: &'a str = &problem.name,
        targets: usize = commands.len(),
        reached: usize = reached.len(),
        /// Over the targets that can be reached, as the model expects it.
        mean_miss_before_mm: Option<f64> = mean_mm(reached, |command| command.seed_miss),
        mean_miss_mm: Option<f64> = mean_mm(reached, |command| command.miss.norm()),
        /// Rows of the targets that cannot be reached, counted from 1.
        unreached: Vec<usize> =
            commands.iter().filter(|command| !command.is_reached()).map(|command| command.row + 1).collect(),
    }
}

fn document<'a>(problem: &'a Problem, commands: &[Command]) -> Document<'a> {
    let reached: Vec<&Command> = commands.iter().filter(|command| command.is_reached()).collect();
    Document::of(problem, commands, &reached)
}

fn mean_mm(commands: &[&Command], of: impl Fn(&Command) -> f64) -> Option<f64> {
    let sum: f64 = commands.iter().map(|command| of(command)).sum();
    (!commands.is_empty()).then(|| sum / commands.len() as f64 * 1e3)
}

/// What came of it, as JSON text.
pub fn commands_json(problem: &Problem, commands: &[Command]) -> String {
    to_text(&document(problem, commands))
}

/// What came of it, in words; targets that cannot be reached are named by file and line.
pub fn commands_text(problem: &Problem, targets: &Measurements, commands: &[Command]) -> String {
    let document = document(problem, commands);
    let mut words = format!("{}\n{} of {} targets can be reached", problem.title, document.reached, document.targets);
    if let (Some(after), Some(before)) = (document.mean_miss_mm, document.mean_miss_before_mm) {
        let _ = write!(
            words,
            ": {after:.4} mm from them on average with these commands, {before:.4} mm with those in the file,\n\
             as the identified arm predicts"
        );
    }
    let point = |command: &Command| {
        format!("out of reach: {}, nearest {} mm away", targets.location(command.row), mm(command.miss.norm(), 2))
    };
    let points = commands.iter().filter(|command| !command.is_reached()).map(point).collect();
    text(&[Block::Lines(words, points)])
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
