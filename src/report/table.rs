//! Tables for other programs.

use std::f64::consts::PI;

use crate::measurement::{Labels, Measurements};
use crate::problem::{Joint, JointKind, Problem};

/// Names of columns.
pub(super) fn names(names: &str) -> Vec<String> {
    names.split(',').map(str::to_owned).collect()
}

/// Joints that take a command: index, name of the column, factor from SI.
pub(super) fn commands(problem: &Problem) -> Vec<(usize, String, f64)> {
    let column = |(index, kind)| match kind {
        JointKind::Revolute => Some((index, format!("q{}_deg", index + 1), 180.0 / PI)),
        JointKind::Prismatic => Some((index, format!("q{}_mm", index + 1), 1e3)),
        JointKind::Fixed => None,
    };
    problem.joints.iter().map(Joint::commanded).enumerate().filter_map(column).collect()
}

/// Sessions of some rows, where any has a name.
pub(super) fn sessions(rows: &Measurements) -> Option<&Labels> {
    Some(&rows.session).filter(|session| session.names.iter().any(|name| !name.is_empty()))
}

/// The word of a row.
pub(super) fn word(labels: &Labels, row: usize) -> String {
    labels.names[labels.of_row[row]].clone()
}
