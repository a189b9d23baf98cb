//! Joints that take a command, and labels of rows, for tables that other programs read.

use crate::measurement::{Labels, Measurements};
use crate::problem::{Joint, JointKind, Problem};
use crate::quantity::Unit;

/// Joint that takes a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CommandedJoint {
    /// Index of the joint, from 0.
    pub joint: usize,
    /// Unit of the command, an angle or a length.
    pub unit: Unit,
}

impl CommandedJoint {
    /// Returns the name, for example `q2`.
    pub fn name(self) -> String {
        format!("q{}", self.joint + 1)
    }

    /// Returns the unit in which the command is displayed, ° or mm.
    pub(crate) fn symbol(self) -> String {
        self.unit.display(1.0).symbol
    }

    /// Returns the name of the command's column in tables, for example `q2_deg` or `q3_mm`.
    pub(crate) fn column(self) -> String {
        format!("{}_{}", self.name(), if self.unit == Unit::Angle { "deg" } else { "mm" })
    }

    /// Returns the factor that converts a command from rad or m to ° or mm.
    pub(crate) fn factor(self) -> f64 {
        self.unit.display(1.0).factor
    }
}

/// Lists the joints that take a command, from the base to the tip.
pub(crate) fn commanded_joints(problem: &Problem) -> Vec<CommandedJoint> {
    let command = |(joint, kind)| match kind {
        JointKind::Revolute => Some(CommandedJoint { joint, unit: Unit::Angle }),
        JointKind::Prismatic => Some(CommandedJoint { joint, unit: Unit::Length }),
        JointKind::Fixed => None,
    };
    problem.joints.iter().map(Joint::command_kind).enumerate().filter_map(command).collect()
}

/// Returns the labels of the rows' sessions; `None` if no session has a name.
pub(crate) fn sessions(rows: &Measurements) -> Option<&Labels> {
    Some(&rows.session).filter(|session| session.names.iter().any(|name| !name.is_empty()))
}

/// Returns the word that `labels` gives the row with this index, such as its session.
pub(crate) fn label(labels: &Labels, row: usize) -> String {
    labels.names[labels.of_row[row]].clone()
}
