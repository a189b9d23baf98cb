//! What `compensate` says and writes: commands as a table to run, and what they come to.

use std::fmt::Write as _;

use super::document::Block;
use super::json::{object, to_text};
use super::quantity::{fixed, mm, number};
use super::render::text;
use super::table;
use crate::files::csv;
use crate::identify::Command;
use crate::measurement::Measurements;
use crate::problem::Problem;

object! {
    Document<'a>(problem: &'a Problem, commands: &[Command], reached: &[&Command]) {
        problem: &'a str = &problem.name,
        targets: usize = commands.len(),
        reached: usize = reached.len(),
        /// Over the targets that can be reached, as the model expects it.
        mean_miss_before_mm: Option<f64> = mean_mm(reached, |command| command.seed_miss),
        mean_miss_mm: Option<f64> = mean_mm(reached, |command| command.miss.norm()),
        /// The same of orientations, where these are desired.
        mean_turn_before_deg: Option<f64> = mean_turn(reached, |command| command.seed_turn),
        mean_turn_deg: Option<f64> = mean_turn(reached, |command| Some(command.turn?.norm())),
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
    (!commands.is_empty()).then(|| sum / commands.len() as f64 * 1e3).filter(|mean| mean.is_finite())
}

fn mean_turn(commands: &[&Command], of: impl Fn(&Command) -> Option<f64>) -> Option<f64> {
    let all: Vec<f64> = commands.iter().filter_map(|command| of(command)).collect();
    (!all.is_empty()).then(|| (all.iter().sum::<f64>() / all.len() as f64).to_degrees()).filter(|mean| mean.is_finite())
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
            ": {} mm from them on average with these commands, {} mm with those in the file, \
             as the identified arm predicts",
            number(after, 4),
            number(before, 4)
        );
    }
    if let (Some(after), Some(before)) = (document.mean_turn_deg, document.mean_turn_before_deg) {
        let _ = write!(words, "; turned by {}° on average, {}° before", number(after, 4), number(before, 4));
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

/// Joints that take a command, named and in the unit as the table of targets has them: index, name, factor from SI.
fn columns(problem: &Problem, targets: &Measurements) -> Vec<(usize, String, f64)> {
    if targets.command_columns.is_empty() {
        return table::commands(problem);
    }
    targets.command_columns.iter().map(|own| (own.joint, own.name.clone(), own.unit.recip())).collect()
}

/// The cell of an angle \[rad\] in degrees, empty where there is none.
fn degrees(angle: Option<f64>) -> String {
    angle.map_or_else(String::new, |angle| fixed(angle.to_degrees(), 6))
}

/// Commands as CSV: q of every moving joint (empty where the target is out of reach) with the names and units of the table of
/// targets, the desired position and orientation with what was set, and how far from them the model expects the arm.
pub fn commands_csv(problem: &Problem, targets: &Measurements, commands: &[Command]) -> String {
    let (joints, session) = (columns(problem, targets), table::sessions(targets));
    let turned = commands.iter().any(|command| command.turn.is_some());
    let mut header: Vec<String> = joints.iter().map(|(_, name, _)| name.clone()).collect();
    header.extend(table::names("x_mm,y_mm,z_mm"));
    header.extend(turned.then(|| table::names("rx_deg,ry_deg,rz_deg")).into_iter().flatten());
    header.extend(session.map(|_| "session".to_owned()));
    header.extend(targets.target.as_ref().map(|_| "target".to_owned()));
    header.extend(targets.payload.as_ref().map(|_| "payload_kg".to_owned()));
    header.extend(targets.hoist.as_ref().map(|_| "hoist_N".to_owned()));
    header.extend(table::names("miss_mm,miss_before_mm"));
    header.extend(turned.then(|| table::names("turn_deg,turn_before_deg")).into_iter().flatten());
    header.push("reached".to_owned());
    let line = |command: &Command| {
        let row = command.row;
        // A controller must not be given a command that does not lead there.
        let show = |value: String| if command.is_reached() { value } else { String::new() };
        let mut cells: Vec<String> =
            joints.iter().map(|&(j, _, factor)| show(fixed(command.configuration[j] * factor, DECIMALS))).collect();
        cells.extend(targets.positions[row].iter().map(|x| fixed(x * 1e3, 4)));
        if turned {
            let desired = targets.orientation(row).map(|own| own.scaled_axis());
            cells.extend((0..3).map(|axis| degrees(desired.map(|own| own[axis]))));
        }
        cells.extend([session, targets.target.as_ref()].into_iter().flatten().map(|labels| table::word(labels, row)));
        cells.extend([&targets.payload, &targets.hoist].into_iter().flatten().map(|values| fixed(values[row], 4)));
        cells.extend(
            [command.miss.norm(), command.seed_miss]
                .map(|miss| if miss.is_finite() { fixed(miss * 1e3, 4) } else { String::new() }),
        );
        if turned {
            cells.extend([command.turn.map(|turn| turn.norm()), command.seed_turn].map(degrees));
        }
        cells.push(command.is_reached().to_string());
        cells
    };
    csv(header, commands.iter().map(line))
}
