//! Tables for other programs.

use crate::measurement::{Labels, Measurements};
use crate::problem::{Joint, JointKind, Problem};
use crate::quantity::Unit;

/// A joint that takes a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Command {
    /// Counted from 0.
    pub joint: usize,
    /// Of an angle or a length.
    pub unit: Unit,
}

impl Command {
    /// `q2`
    pub fn name(self) -> String {
        format!("q{}", self.joint + 1)
    }

    /// The unit in which people read it: ° or mm.
    pub(super) fn symbol(self) -> String {
        self.unit.display(1.0).symbol
    }

    /// Its column in a table: `q2_deg`, `q3_mm`.
    pub(super) fn column(self) -> String {
        format!("{}_{}", self.name(), if self.unit == Unit::Angle { "deg" } else { "mm" })
    }

    /// From \[rad\] or \[m\] to ° or mm.
    pub(super) fn factor(self) -> f64 {
        self.unit.display(1.0).factor
    }
}

/// Joints that take a command.
pub(super) fn commands(problem: &Problem) -> Vec<Command> {
    let command = |(joint, kind)| match kind {
        JointKind::Revolute => Some(Command { joint, unit: Unit::Angle }),
        JointKind::Prismatic => Some(Command { joint, unit: Unit::Length }),
        JointKind::Fixed => None,
    };
    problem.joints.iter().map(Joint::command_kind).enumerate().filter_map(command).collect()
}

/// Sessions of some rows, where any has a name.
pub(super) fn sessions(rows: &Measurements) -> Option<&Labels> {
    Some(&rows.session).filter(|session| session.names.iter().any(|name| !name.is_empty()))
}

/// The word of a row.
pub(super) fn word(labels: &Labels, row: usize) -> String {
    labels.names[labels.of_row[row]].clone()
}
