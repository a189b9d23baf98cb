//! Columns that are named after several joints.

use super::meaning::{Numbering, unit_of};
use super::table::Table;
use crate::error::{InputError, Location, TableErrorKind};
use crate::problem::{Joint, JointSource, Problem};

/// Returns the error of an `unknown` column that is named after several joints, one of which is the
/// joint `index`; `None` if no column is.
pub(super) fn shared_name(
    index: usize,
    (table, problem, numbering): (&Table, &Problem, &Numbering),
    unknown: &[&str],
) -> Option<InputError> {
    let joint = problem.joints.get(index)?;
    let namesakes: Vec<(usize, &Joint)> =
        problem.joints.iter().enumerate().filter(|(_, other)| other.name == joint.name).collect();
    let of_it =
        |name: &&&str| name.strip_prefix(&joint.name).is_some_and(|rest| rest.starts_with('_'));
    let column = unknown.iter().find(of_it).filter(|_| namesakes.len() > 1)?;
    let suffix = if problem.data.joints == JointSource::Read { "_read" } else { "" };
    let write = namesakes.iter().filter_map(|(index, joint)| {
        let name = format!("q{}{suffix}", numbering.number(*index));
        Some(unit_of(joint.command_kind())?.alternatives(&name))
    });
    let place = |of: &Location| Location { key: None, ..of.clone() }.to_string();
    let places = namesakes.iter().map(|(_, joint)| place(&joint.location)).collect();
    let kind = TableErrorKind::SharedJointName {
        name: joint.name.clone(),
        places,
        write: write.collect(),
    };
    Some(table.column(column).error(kind))
}
