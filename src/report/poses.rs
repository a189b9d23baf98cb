//! Poses to measure, as a table.

use super::quantity::{fixed, quoted};
use crate::measurement::{Labels, Measurements};
use crate::problem::{HeldOut, JointKind, Problem};

/// Poses as CSV: the columns of measurements but for the positions; ready to be measured and completed.
///
/// Where the problem names a column that marks held-out rows, every pose is one to identify with.
pub fn poses_csv(problem: &Problem, poses: &Measurements) -> String {
    let moving: Vec<(usize, JointKind)> = problem.joints.iter().map(|joint| joint.kind).enumerate().collect();
    let moving: Vec<(usize, JointKind)> = moving.into_iter().filter(|(_, kind)| *kind != JointKind::Fixed).collect();
    let split = match &problem.data.held_out {
        Some(HeldOut::Column(name)) => Some(quoted(name)),
        _ => None,
    };
    let sessions = poses.session.names.iter().any(|name| !name.is_empty());
    let mut header = vec!["pose".to_owned()];
    header.extend(split.clone());
    let unit = |kind| if kind == JointKind::Prismatic { "mm" } else { "deg" };
    header.extend(moving.iter().map(|&(joint, kind)| format!("q{}_{}", joint + 1, unit(kind))));
    let optional = [
        ("session", sessions),
        ("target", poses.target.is_some()),
        ("payload_kg", poses.payload.is_some()),
        ("hoist_N", poses.hoist.is_some()),
        ("temperature_C", poses.temperature.is_some()),
        ("time_s", poses.time_measured),
        ("sigma_mm", poses.sigma.is_some()),
    ];
    header.extend(optional.iter().filter(|(_, there)| *there).map(|(name, _)| (*name).to_owned()));
    if poses.approach.is_some() {
        header.extend(moving.iter().map(|(joint, _)| format!("approach{}", joint + 1)));
    }
    let mut lines = vec![header.join(",")];
    for row in 0..poses.len() {
        let value = |column: &Option<Vec<f64>>, factor: f64| column.as_ref().map(|values| plain(values[row] * factor));
        let word = |labels: &Labels| quoted(&labels.names[labels.of_row[row]]);
        let q = poses.configuration(row);
        let mut cells = vec![(row + 1).to_string()];
        cells.extend(split.as_ref().map(|_| "identification".to_owned()));
        cells.extend(moving.iter().map(|&(joint, kind)| match kind {
            JointKind::Prismatic => plain(q[joint] * 1e3),
            _ => plain(q[joint].to_degrees()),
        }));
        cells.extend(sessions.then(|| word(&poses.session)));
        cells.extend(poses.target.as_ref().map(word));
        cells.extend(value(&poses.payload, 1.0));
        cells.extend(value(&poses.hoist, 1.0));
        cells.extend(value(&poses.temperature, 1.0));
        cells.extend(poses.time_measured.then(|| plain(poses.time[row])));
        cells.extend(value(&poses.sigma, 1e3));
        if let Some(approach) = &poses.approach {
            cells.extend(moving.iter().map(|(joint, _)| plain(approach[row * poses.joints + joint])));
        }
        lines.push(cells.join(","));
    }
    lines.join("\n") + "\n"
}

/// Six decimals, without zeros at the end.
fn plain(value: f64) -> String {
    let text = fixed(value, 6);
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
