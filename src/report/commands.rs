//! Commands of `compensate`, as a table to run and as JSON.

use serde::Serialize;

use super::json::to_text;
use super::quantity::number;
use crate::measurement::Measurements;
use crate::problem::{JointKind, Problem};
use crate::study::Command;

#[derive(Debug, Serialize)]
struct Document<'a> {
    problem: &'a str,
    targets: usize,
    reached: usize,
    /// Over the targets that can be reached, as the model expects it.
    mean_miss_before_mm: f64,
    mean_miss_mm: f64,
    /// Rows of the targets that cannot be reached, counted from 1.
    unreached: Vec<usize>,
}

/// Commands as CSV: q of every moving joint, the desired position, and how far from it the model expects the arm.
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
    let header = joints.iter().map(|(j, unit, _)| format!("q{}_{unit}", j + 1));
    let rest = ["x_mm", "y_mm", "z_mm", "miss_mm", "miss_before_mm", "reached"].map(str::to_owned);
    lines.push(header.chain(rest).collect::<Vec<_>>().join(","));
    for command in commands {
        let q = joints.iter().map(|&(j, _, factor)| number(command.configuration[j] * factor, 7));
        let at = targets.positions[command.row].iter().map(|x| number(x * 1e3, 4)).collect::<Vec<_>>();
        let end = [
            number(command.miss.norm() * 1e3, 4),
            number(command.seed_miss * 1e3, 4),
            command.is_reached().to_string(),
        ];
        lines.push(q.chain(at).chain(end).collect::<Vec<_>>().join(","));
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
    let mut text = format!(
        "{}\n{} of {} targets can be reached: {:.4} mm from them on average with these commands, {:.4} mm with those in the file,\nas the identified arm predicts\n",
        problem.title, document.reached, document.targets, document.mean_miss_mm, document.mean_miss_before_mm
    );
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
        reached.iter().map(|command| of(command)).sum::<f64>() / reached.len().max(1) as f64 * 1e3
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
