//! What `compensate` says and writes: commands as a table to run, and what they come to.

use std::fmt::Write as _;

use super::document::Block;
use super::json::{list, object, to_text};
use super::quantity::{fixed, mm, number};
use super::render::text;
use super::table;
use crate::files::csv;
use crate::fit::Command;
use crate::measurement::Measurements;
use crate::problem::Problem;

/// Over the targets that can be reached, as the model expects it: the mean miss \[mm\] with the
/// commands in the file and with those found, and the mean turn \[°\] likewise where orientations
/// are desired.
fn means(commands: &[Command]) -> [[Option<f64>; 2]; 2] {
    let mean = |of: &dyn Fn(&Command) -> Option<f64>| {
        let all: Vec<f64> =
            commands.iter().filter(|command| command.is_reached()).filter_map(of).collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    };
    let misses =
        [mean(&|command| Some(command.seed_miss)), mean(&|command| Some(command.miss.norm()))];
    let turns = [mean(&|command| command.seed_turn), mean(&|command| Some(command.turn?.norm()))];
    let finite = |all: [Option<f64>; 2], to: fn(f64) -> f64| {
        all.map(|mean| mean.map(to).filter(|mean| mean.is_finite()))
    };
    [finite(misses, |miss| miss * 1e3), finite(turns, f64::to_degrees)]
}

/// What came of it, as JSON text.
pub fn commands_json(problem: &Problem, commands: &[Command]) -> String {
    let [[miss_before, miss], [turn_before, turn]] = means(commands);
    let (reached, unreached): (Vec<&Command>, Vec<&Command>) =
        commands.iter().partition(|command| command.is_reached());
    to_text(&object! {
        problem: &problem.name,
        targets: commands.len(),
        reached: reached.len(),
        mean_miss_before_mm: miss_before,
        mean_miss_mm: miss,
        mean_turn_before_deg: turn_before,
        mean_turn_deg: turn,
        // Rows of the targets that cannot be reached, counted from 1.
        unreached: list(unreached, |command| command.row + 1),
    })
}

/// What came of it, in words; targets that cannot be reached are named by file and line.
pub fn commands_text(problem: &Problem, targets: &Measurements, commands: &[Command]) -> String {
    let reached = commands.iter().filter(|command| command.is_reached()).count();
    let mut words =
        format!("{}\n{reached} of {} targets can be reached", problem.title, commands.len());
    let [misses, turns] = means(commands);
    if let [Some(before), Some(after)] = misses {
        let _ = write!(
            words,
            ": {} mm from them on average with these commands, {} mm with those in the file, \
             as the identified arm predicts",
            number(after, 4),
            number(before, 4)
        );
    }
    if let [Some(before), Some(after)] = turns {
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
