//! Check of a fit that is far off: a column that stands still, was filled down by a spreadsheet, was
//! sorted by itself, or holds something else than the coordinate of its joint.

use nalgebra::{Matrix3, Vector3};
use serde_json::{Value, json};

use super::checked_fit::CheckedFit;
use super::contradicted_entry::rounded;
use super::finding::{Finding, FindingCode};
use super::followed_commands::{Unrelated, unrelated};
use super::misfit::misfit;
use super::row_kind::{AXES, format_error};
use super::row_relation::{OtherRows, other_rows};
use crate::measurement::Measurements;
use crate::problem::JointKind;

/// Largest range of the commands of a joint that stands still: 0.1° \[rad\], or 0.1 mm \[m\].
const MAX_STILL_TURN: f64 = 0.1 * std::f64::consts::PI / 180.0;
const MAX_STILL_TRAVEL: f64 = 1e-4;
/// Minimum number of rows at the end of a table that show a column filled down or frozen, and
/// minimum number of rows before them.
const MIN_ROWS: usize = 8;
/// Largest difference between two steps of a column that was filled down, relative to the step.
const MAX_UNEQUAL: f64 = 1e-6;
/// Largest share of the squared spread of predicted points along one direction at which they lie in
/// a plane.
const MAX_PLANAR_SHARE: f64 = 1e-4;
/// Largest ratio of the error without the doubted rows to the error with them at which these rows
/// are the cause.
const MAX_RATIO: f64 = 0.2;

/// Checks, if the fit is far off, that no joint stands still in all rows or from a row on while the
/// rows before fit, that no column rises by the same step from a row on, that the positions follow
/// each joint column, and that no coordinate is sorted by itself.
pub(super) fn columns_hold_measurements(fit: &CheckedFit) -> Option<Finding> {
    let positions = fit.table().leading().is_position();
    let missed = misfit(fit).into_iter().next();
    let before = missed.filter(|_| positions).and_then(|found| found.number("rms"))?;
    repeated_coordinate(fit, before)
        .or_else(|| filled_or_frozen(fit, before))
        .or_else(|| unrelated_to_positions(fit, before))
        .or_else(|| standing_still(fit, before))
        .or_else(|| sorted_by_itself(fit, before))
        .or_else(|| of_other_rows(fit, before))
}

/// Returns the name of the column of a joint.
pub(super) fn column_name(rows: &Measurements, joint: usize) -> String {
    let column = rows.command_columns.iter().find(|column| column.joint == joint);
    column.map_or_else(|| format!("q{}", joint + 1), |column| column.name.clone())
}

/// Returns the joints with commands.
pub(super) fn moving<'f>(fit: &'f CheckedFit) -> impl Iterator<Item = usize> + 'f {
    let joints = fit.problem.joints.iter().enumerate();
    let moving = joints.filter(|(_, joint)| joint.command_kind() != JointKind::Fixed);
    moving.map(|(joint, _)| joint).filter(|joint| *joint < fit.table().joints)
}

/// Returns the commands of a joint in all rows.
fn commands(rows: &Measurements, joint: usize) -> Vec<f64> {
    (0..rows.len()).map(|row| rows.configuration(row)[joint]).collect()
}

/// Returns those of the `joints` whose commands stay within 0.1° or 0.1 mm in the `rows`.
pub(super) fn still_joints(fit: &CheckedFit, rows: &[usize], joints: &[usize]) -> Vec<usize> {
    let table = fit.table();
    let is_still = |joint: &usize| {
        let (least, most) =
            crate::numeric::range(rows.iter().map(|&row| table.configuration(row)[*joint]));
        let is_turning = fit.turns(*joint);
        most - least < if is_turning { MAX_STILL_TURN } else { MAX_STILL_TRAVEL }
    };
    joints.iter().copied().filter(is_still).collect()
}

/// Reports joints that stand still in all rows.
fn standing_still(fit: &CheckedFit, before: f64) -> Option<Finding> {
    let rows = fit.table();
    let every_row: Vec<usize> = (0..rows.len()).collect();
    let still = still_joints(fit, &every_row, &moving(fit).collect::<Vec<_>>());
    if still.is_empty() || rows.len() < MIN_ROWS {
        return None;
    }
    let names: Vec<String> = still.iter().map(|&joint| column_name(rows, joint)).collect();
    let (noun, verb) = if names.len() == 1 { ("column", "stays") } else { ("columns", "stay") };
    let text = format!(
        "{noun} {} {verb} within 0.1° or 0.1 mm in all rows, and the fitted arm misses the measurements \
         by {}: if the arm moved there, the table does not hold these commands",
        names.join(", "),
        format_error("position", before, 1)
    );
    Some(finding(&names, before, None, text))
}

/// Reports a column that keeps its value, or rises by the same step, from a row to the end of the
/// table, if the rows before that fit far better by themselves.
fn filled_or_frozen(fit: &CheckedFit, before: f64) -> Option<Finding> {
    let rows = fit.table();
    moving(fit).find_map(|joint| {
        let values = commands(rows, joint);
        let steps: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
        let &last = steps.last()?;
        let is_equal = |step: &&f64| (**step - last).abs() <= MAX_UNEQUAL * last.abs() + 1e-12;
        let equal = steps.iter().rev().take_while(is_equal).count();
        let from = rows.len() - 1 - equal;
        if equal + 1 < MIN_ROWS || from < MIN_ROWS {
            return None;
        }
        // The row at which the column freezes may be right.
        let after = error_before(fit, from + 1)?;
        if after > MAX_RATIO * before {
            return None;
        }
        let (name, place) = (column_name(rows, joint), rows.location(from + 1));
        let is_turning = fit.turns(joint);
        let shown = |value: f64| {
            let (size, unit) =
                if is_turning { (value.to_degrees(), "°") } else { (value * 1e3, " mm") };
            format!("{}{unit}", rounded(size))
        };
        let how = if last.abs() <= 1e-12 {
            format!("stays at {} from {place} on, as if the log had frozen", shown(values[from]))
        } else {
            format!("rises by {} a row from {place} on, as a spreadsheet fills cells", shown(last))
        };
        let text = format!(
            "column {name} {how}; the rows before that fit by themselves (the nominal arm misses them by \
             {}, the fitted arm misses all rows by {})",
            format_error("position", after, 3),
            format_error("position", before, 1)
        );
        Some(finding(&[name], before, Some(after), text))
    })
}

/// Reports a column that does not hold the coordinate of its joint, although the positions fit with
/// another coordinate in each row.
fn unrelated_to_positions(fit: &CheckedFit, before: f64) -> Option<Finding> {
    if !fit.has_further_fits || !fit.explanations().fitted.is_empty() {
        return None;
    }
    let joints: Vec<usize> = moving(fit).collect();
    let Unrelated { joint, after, with, what } = unrelated(fit, before, &joints)?;
    let name = column_name(fit.table(), joint);
    let text = format!(
        "the positions do not follow the column {name}: with {with}, the nominal arm misses by {} \
         instead of {}; {what}",
        format_error("position", after, 1),
        format_error("position", fit.registered.identification.rms.norm, 1)
    );
    Some(finding(&[name], before, Some(after), text))
}

/// Returns true if values rise, or fall, from the first to the last.
fn is_sorted(values: &[f64]) -> bool {
    let mut steps = values.windows(2).map(|pair| pair[1] - pair[0]);
    let is_constant = values.first() == values.last();
    !is_constant && (steps.clone().all(|step| step >= 0.0) || steps.all(|step| step <= 0.0))
}

/// Reports a coordinate that is the same in all rows although the nominal arm does not move in a
/// plane, or two coordinates that are equal in all rows.
fn repeated_coordinate(fit: &CheckedFit, before: f64) -> Option<Finding> {
    let kind = fit.leading();
    let points = &fit.table().positions;
    let (first, n) = (points[*kind.rows.first()?], kind.rows.len());
    let is_in_all =
        |holds: &dyn Fn(&Vector3<f64>) -> bool| kind.rows.iter().all(|&row| holds(&points[row]));
    let is_same = |axis: &usize| is_in_all(&|point| point[*axis].total_cmp(&first[*axis]).is_eq());
    let is_copied =
        |(a, b): &(usize, usize)| is_in_all(&|point| point[*a].total_cmp(&point[*b]).is_eq());
    let name = |axis: usize| AXES[axis].to_owned();
    let (names, what) = if let Some(axis) = (0..3).find(is_same) {
        let poses = fit.fitting.poses(&kind.rows);
        let nominal = fit.fitting.located();
        let predicted = fit.model().predicted_targets(&poses, nominal.as_slice());
        let centre = predicted.iter().sum::<Vector3<f64>>() / n as f64;
        let squares: Matrix3<f64> =
            predicted.iter().map(|at| (at - centre) * (at - centre).transpose()).sum();
        let values = squares.symmetric_eigenvalues();
        if values.min() <= MAX_PLANAR_SHARE * values.sum() {
            return None;
        }
        (vec![name(axis)], "holds the same number")
    } else {
        let (a, b) = [(0, 1), (0, 2), (1, 2)].into_iter().find(is_copied)?;
        (vec![name(a), name(b)], "equals the other")
    };
    if n < MIN_ROWS {
        return None;
    }
    let text = format!(
        "{} {} {what} in all {n} rows: the positions were not copied whole",
        if names.len() == 1 { "the coordinate" } else { "each of the coordinates" },
        names.join(" and ")
    );
    let remedy = format!("copy {} from the measurements again", names.join(" and "));
    Some(finding(&names, before, None, text).with_remedy(remedy))
}

/// Reports a coordinate that rises or falls from row to row in the whole table while no other does.
fn sorted_by_itself(fit: &CheckedFit, before: f64) -> Option<Finding> {
    let rows = fit.table();
    let axis = |axis: usize| rows.positions.iter().map(|x| x[axis]).collect::<Vec<f64>>();
    let sorted: Vec<usize> = (0..3).filter(|&k| is_sorted(&axis(k))).collect();
    let &[only] = sorted.as_slice() else { return None };
    if rows.len() < 2 * MIN_ROWS || moving(fit).any(|joint| is_sorted(&commands(rows, joint))) {
        return None;
    }
    let name = AXES[only].to_owned();
    let text = format!(
        "the coordinate {name} is sorted from the first row to the last, no other column of positions \
         and joints is, and the fitted arm misses the measurements by {}: this column was probably \
         sorted by itself, or the positions by it without their joint angles",
        format_error("position", before, 1)
    );
    Some(finding(&[name], before, None, text))
}

/// Reports joint columns on which the positions do not depend at all.
fn of_other_rows(fit: &CheckedFit, before: f64) -> Option<Finding> {
    if !fit.has_further_fits || !fit.explanations().fitted.is_empty() {
        return None;
    }
    let joints: Vec<usize> = moving(fit).collect();
    let OtherRows { joints: found, determination: [measured, predicted] } =
        other_rows(fit, &joints)?;
    let rows = fit.table();
    let names: Vec<String> = found.iter().map(|&joint| column_name(rows, joint)).collect();
    let (text, remedy) = if names.len() == joints.len() {
        let text = format!(
            "the positions do not depend on the joint angles of their rows (R² of their distances is \
             {measured:.2}, with the positions of the nominal arm {predicted:.2}): the rows of the \
             positions are in another order than those of the joint angles, or of other poses"
        );
        (text, "join positions and joint angles again, by the name or the time of each row")
    } else {
        let text = format!(
            "the positions do not depend on the column {}, but those of the nominal arm do: the column \
             is in another order than the other columns{}, or of other poses",
            names.join(", "),
            if found.iter().all(|&joint| is_sorted(&commands(rows, joint))) {
                ", as one that was sorted by itself"
            } else {
                ""
            }
        );
        (text, "copy the column again, with all columns of a row together")
    };
    Some(finding(&names, before, None, text).with_remedy(remedy))
}

/// Creates the finding about doubted columns.
fn finding(columns: &[String], before: f64, after: Option<f64>, text: String) -> Finding {
    let numbers = [json!(columns), before.into(), after.map_or(Value::Null, Value::from)];
    Finding::new(FindingCode::ColumnDoubted, numbers, text)
}

/// Returns the error of the registered nominal arm in the identification rows before `row` \[m\];
/// `None` if too few are left.
fn error_before(fit: &CheckedFit, row: usize) -> Option<f64> {
    let chosen: Vec<usize> = fit.rows().iter().copied().filter(|&k| k < row).collect();
    if chosen.len() < MIN_ROWS { None } else { fit.registration_error(fit.table(), &chosen) }
}
