//! Tables of predictions, and of commands that compensate the errors of the arm.

use nalgebra::Vector3;

use super::columns::{self, COMMAND_DECIMALS, Column, Columns, columns_of_kinds};
use super::commanded::{commanded_joints, label, sessions};
use crate::files::{csv, csv_with_semicolons};
use crate::fit::{Command, Prediction};
use crate::measurement::Measurements;
use crate::problem::Problem;
use crate::quantity::format::fixed;
use crate::remainder::Bounds;

/// Returns predictions as CSV: columns that name the row, commands, the predicted pose, and the
/// predicted numbers of rows that measure no position.
///
/// `errors` are the standard errors of the predicted numbers of each row \[SI or px\]; `None`
/// without an estimate. If `bounds` are given, the uncertainty of positions is taken from them.
pub fn predictions_csv(
    problem: &Problem,
    rows: &Measurements,
    prediction: &Prediction,
    (bounds, errors): (Option<&Bounds>, Option<&[Vector3<f64>]>),
) -> String {
    let all_rows: Vec<usize> = (0..prediction.positions.len()).collect();
    let mut columns = columns::identifying_columns(problem, rows, &all_rows);
    let mut add = |name: String, decimals, of: &dyn Fn(usize) -> f64| {
        columns.push((
            name,
            Column::Numbers(all_rows.iter().map(|&row| of(row)).collect(), Some(decimals)),
        ));
    };
    for joint in commanded_joints(problem) {
        add(joint.column(), COMMAND_DECIMALS, &|row| {
            rows.configuration(row)[joint.joint] * joint.factor()
        });
    }
    for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
        add(format!("predicted_{axis}_mm"), 6, &|row| prediction.positions[row][k] * 1e3);
    }
    if let Some(turns) = &prediction.orientations {
        for (k, axis) in ["rx", "ry", "rz"].into_iter().enumerate() {
            add(format!("predicted_{axis}_deg"), 7, &|row| turns[row][k].to_degrees());
        }
    }
    columns.extend(columns_of_kinds(rows, "predicted", 6, &prediction.numbers));
    columns.extend(bounds.into_iter().flat_map(uncertainty_columns));
    if let Some(errors) = errors {
        let of_position = |row: usize, k: usize| {
            let is_position = rows.observation(row).is_position();
            if is_position { errors[row][k] * 1e3 } else { f64::NAN }
        };
        let has_error =
            |&row: &usize| rows.observation(row).is_position() && !errors[row].x.is_nan();
        if bounds.is_none() && all_rows.iter().any(has_error) {
            for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
                let cells = all_rows.iter().map(|&row| of_position(row, k)).collect();
                columns.push((format!("sigma_{axis}_mm"), Column::Numbers(cells, Some(4))));
            }
        }
        columns.extend(columns_of_kinds(rows, "sigma", 6, errors));
    }
    columns::to_csv(&columns, all_rows.len())
}

/// Returns the columns of the uncertainty of predictions: 1 σ along each axis, the bound of the
/// error length, and whether the pose is outside the measured range.
fn uncertainty_columns(bounds: &Bounds) -> Columns {
    let numbers = |of: &dyn Fn(usize) -> f64| {
        Column::Numbers((0..bounds.poses.len()).map(|pose| of(pose) * 1e3).collect(), Some(4))
    };
    let mut columns: Columns = ["x", "y", "z"]
        .into_iter()
        .enumerate()
        .map(|(k, axis)| {
            (format!("sigma_{axis}_mm"), numbers(&|pose| bounds.poses[pose].error_sigma()[k]))
        })
        .collect();
    columns.push((bounds.column(), numbers(&|pose| bounds.bound(pose))));
    let flags = bounds.poses.iter().map(|pose| pose.is_extrapolated).collect();
    columns.push(("extrapolated".to_owned(), Column::Flags(flags)));
    columns
}

/// Number of decimals of compensated commands, in the units of the table of targets.
const COMPENSATED_DECIMALS: usize = 9;

/// Returns the index, the column name, and the factor from SI to the unit of the column, of each
/// commanded joint. Names and units are those of the table of targets, if it has commands.
fn command_columns(problem: &Problem, targets: &Measurements) -> Vec<(usize, String, f64)> {
    if targets.command_columns.is_empty() {
        let columns = commanded_joints(problem).into_iter();
        return columns.map(|column| (column.joint, column.column(), column.factor())).collect();
    }
    targets
        .command_columns
        .iter()
        .map(|column| (column.joint, column.name.clone(), column.unit.recip()))
        .collect()
}

/// Formats an angle, given in rad, in degrees; empty for `None`.
fn degrees(angle: Option<f64>) -> String {
    angle.map_or_else(String::new, |angle| fixed(angle.to_degrees(), 6))
}

/// Returns commands that compensate the arm's errors as CSV, with the names and units of the table
/// of targets.
///
/// Columns are the name of the pose if the targets have one, the command of every moving joint, the
/// desired pose, the conditions, and the predicted distances to the target. Commands are empty if
/// the target is out of reach.
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
    if let Some(pose) = &targets.pose {
        add("pose", &|command| pose[command.row].to_string());
    }
    if let Some(names) = &targets.pose_names {
        add("pose", &|command| label(names, command.row));
    }
    for (joint, name, factor) in command_columns(problem, targets) {
        // A controller must not receive a command that misses the target.
        let sent = |command: &Command| {
            if command.is_reached() { command.configuration[joint] * factor } else { f64::NAN }
        };
        add(&name, &|command| fixed(sent(command), COMPENSATED_DECIMALS));
    }
    for (axis, name) in ["x_mm", "y_mm", "z_mm"].into_iter().enumerate() {
        add(name, &|command| fixed(targets.positions[command.row][axis] * 1e3, 4));
    }
    let has_orientations = commands.iter().any(|command| command.turn.is_some());
    for (axis, name) in
        ["rx_deg", "ry_deg", "rz_deg"].into_iter().enumerate().filter(|_| has_orientations)
    {
        add(name, &|command| {
            degrees(targets.orientation(command.row).map(|desired| desired.scaled_axis()[axis]))
        });
    }
    for (name, labels) in [("session", sessions(targets)), ("target", targets.target.as_ref())] {
        if let Some(labels) = labels {
            add(name, &|command| label(labels, command.row));
        }
    }
    let conditions = [
        ("payload_kg", targets.payload.as_ref()),
        ("hoist_N", targets.hoist.as_ref()),
        ("temperature_C", targets.temperature.as_ref()),
        ("time_s", targets.time_measured.then_some(&targets.time)),
    ];
    for (name, values) in conditions {
        if let Some(values) = values {
            add(name, &|command| fixed(values[command.row], 4));
        }
    }
    let covariates = problem.data.covariates.iter().enumerate();
    let has_covariates = targets.covariates.len() == problem.data.covariates.len() * targets.len();
    for (which, covariate) in covariates.filter(|_| has_covariates) {
        add(&covariate.name, &|command| fixed(targets.covariates_of(command.row)[which], 6));
    }
    add("miss_mm", &|command| fixed(command.miss.norm() * 1e3, 4));
    add("miss_before_mm", &|command| fixed(command.seed_miss * 1e3, 4));
    if has_orientations {
        add("turn_deg", &|command| degrees(command.turn.map(|turn| turn.norm())));
        add("turn_before_deg", &|command| degrees(command.seed_orientation_error));
    }
    add("reached", &|command| command.is_reached().to_string());
    for (name, column) in bounds.into_iter().flat_map(uncertainty_columns) {
        header.push(name);
        for (row, line) in lines.iter_mut().enumerate() {
            line.push(column.cell(row));
        }
    }
    if targets.has_decimal_commas { with_decimal_commas(header, lines) } else { csv(header, lines) }
}

/// Columns of words, in which a point is no decimal point.
const WORD_COLUMNS: [&str; 3] = ["pose", "session", "target"];

/// Formats a table with semicolons between the cells and commas as decimal marks.
fn with_decimal_commas(header: Vec<String>, mut lines: Vec<Vec<String>>) -> String {
    for line in &mut lines {
        for (cell, name) in line.iter_mut().zip(&header) {
            if !WORD_COLUMNS.contains(&name.as_str()) {
                *cell = cell.replace('.', ",");
            }
        }
    }
    csv_with_semicolons(header, lines)
}
