//! Table of poses to measure.

use super::columns::reference_cell;
use super::commanded::{CommandedJoint, commanded_joints, label, sessions};
use crate::files::csv;
use crate::measurement::Measurements;
use crate::observation::fields;
use crate::problem::{HeldOut, Problem};
use crate::quantity::Unit;
use crate::quantity::format::fixed;

/// Returns poses to measure as CSV with the columns of a measurement table, except the measured
/// values.
///
/// If the problem names a column that marks held-out rows, that column marks every pose as
/// identification.
pub fn poses_csv(problem: &Problem, poses: &Measurements) -> String {
    let columns = pose_columns(problem, poses);
    let lines =
        (0..poses.len()).map(|row| columns.iter().map(|(_, cells)| cells[row].clone()).collect());
    csv(columns.iter().map(|(name, _)| name.clone()).collect(), lines)
}

/// Returns the names and cells of the columns of [`poses_csv`]; the first is `pose`, the number of
/// the pose.
pub(crate) fn pose_columns(problem: &Problem, poses: &Measurements) -> Vec<(String, Vec<String>)> {
    let (joints, session) = (commanded_joints(problem), sessions(poses));
    let split = match &problem.data.held_out {
        Some(HeldOut::Column(name)) => Some(name.clone()),
        _ => None,
    };
    let values = |values: &Option<Vec<f64>>, factor: f64| {
        values.as_ref().map(|values| {
            values.iter().map(|value| format_trimmed(value * factor)).collect::<Vec<String>>()
        })
    };
    let words = |labels| (0..poses.len()).map(|row| label(labels, row)).collect::<Vec<String>>();
    let mut columns = vec![(
        "pose".to_owned(),
        (1..=poses.len()).map(|row| row.to_string()).collect::<Vec<String>>(),
    )];
    columns.extend(split.map(|name| (name, vec!["identification".to_owned(); poses.len()])));
    columns.extend(reference_columns(problem, poses));
    columns.extend(joints.iter().map(|joint| {
        let commands = (0..poses.len())
            .map(|row| format_trimmed(poses.configuration(row)[joint.joint] * joint.factor()));
        (joint.column(), commands.collect())
    }));
    let optional = [
        ("session", session.map(words)),
        ("target", poses.target.as_ref().map(words)),
        ("payload_kg", values(&poses.payload, 1.0)),
        ("hoist_N", values(&poses.hoist, 1.0)),
        ("temperature_C", values(&poses.temperature, 1.0)),
        (
            "time_s",
            poses
                .time_measured
                .then(|| poses.time.iter().map(|&time| format_trimmed(time)).collect()),
        ),
        ("sigma_mm", sigmas(poses)),
    ];
    columns
        .extend(optional.into_iter().filter_map(|(name, column)| Some((name.to_owned(), column?))));
    let has_covariates = poses.covariates.len() == problem.data.covariates.len() * poses.len();
    columns.extend(problem.data.covariates.iter().enumerate().filter(|_| has_covariates).map(
        |(which, covariate)| {
            let values =
                (0..poses.len()).map(|row| format_trimmed(poses.covariates_of(row)[which]));
            (covariate.name.clone(), values.collect())
        },
    ));
    if let Some(approach) = &poses.approach {
        columns.extend(joints.iter().map(|CommandedJoint { joint, .. }| {
            let sides =
                (0..poses.len()).map(|row| format_trimmed(approach[row * poses.joints + joint]));
            (format!("approach{}", joint + 1), sides.collect())
        }));
    }
    columns
}

/// Returns the declared 1 σ of each row \[mm\], empty for rows that measure no length; `None` if no
/// row declares one.
fn sigmas(poses: &Measurements) -> Option<Vec<String>> {
    let cell = |(row, sigma): (usize, &f64)| {
        let is_length = poses.observation(row).description().unit == Unit::Length;
        if is_length { format_trimmed(sigma * 1e3) } else { String::new() }
    };
    poses.sigma.as_ref().map(|sigmas| sigmas.iter().enumerate().map(cell).collect())
}

/// Returns the columns that name the fixtures and frames of each row, such as `point`, `anchor`,
/// `surface` or `frame`. Columns without any entry are left out.
fn reference_columns(problem: &Problem, poses: &Measurements) -> Vec<(String, Vec<String>)> {
    let mut columns: Vec<(String, Vec<String>)> = Vec::new();
    for field in fields().filter(|field| field.unit().is_none()) {
        let cell = |row| reference_cell(problem, poses, (row, field.name));
        let cells: Vec<String> = (0..poses.len()).map(cell).collect();
        let is_new = columns.iter().all(|(name, _)| name != field.name);
        if is_new && cells.iter().any(|cell| !cell.is_empty()) {
            columns.push((field.name.to_owned(), cells));
        }
    }
    columns
}

/// Formats a value with at most six decimals, without trailing zeros.
fn format_trimmed(value: f64) -> String {
    let text = fixed(value, 6);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
