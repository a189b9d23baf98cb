//! Lengths that have one factor in common if no row measures a length.

use crate::measurement::Measurements;
use crate::problem::{Joint, JointKind, Observation, Problem};

/// Returns the lengths that change in proportion with the scale if no row measures a length: contacts with points at unknown places remain contacts if all lengths have one factor. `None` if
/// a length is known.
///
/// Lengths that other unknowns make up for may be held: those of the first joint, which move all
/// points, and those from d of the last joint on, which move the target. Priors give the scale, but
/// do not measure it. The commands of a sliding joint are known lengths.
pub(super) fn scaled_lengths(
    problem: &Problem,
    table: &Measurements,
    unknowns: &[&str],
) -> Option<Vec<String>> {
    let is_free = |name: &str| unknowns.contains(&name);
    let has_axes = |group: &str| "xyz".chars().all(|axis| is_free(&format!("{group}.{axis}")));
    let is_unknown = |observation: &Observation| match *observation {
        Observation::Point(point) => (problem.fixtures.get(point))
            .is_some_and(|point| has_axes(&format!("point[{}]", point.name))),
        Observation::Tilt(_) => true,
        _ => false,
    };
    let rows: Vec<Observation> = (0..table.len()).map(|row| table.observation(row)).collect();
    if !rows.iter().any(|row| row.is_point())
        || !rows.iter().all(is_unknown)
        || !problem.distances.is_empty()
    {
        return None;
    }
    let has_other_lengths =
        |joint: &Joint| joint.beam.is_some() || joint.command_kind() == JointKind::Prismatic;
    if problem.is_elastic()
        || problem.joints.iter().any(has_other_lengths)
        || !problem.targets.is_empty()
        || !has_axes("tool")
    {
        return None;
    }
    let moves = |joint: &Joint| joint.command_kind() != JointKind::Fixed;
    let last = problem.joints.iter().rposition(moves)?;
    let mut lengths = Vec::new();
    for (index, joint) in problem.joints.iter().enumerate().take(last + 1).skip(1) {
        let placed = joint.placement.as_ref().map_or([0.0; 3], |placed| placed.xyz.into());
        let d = if index == last { 0.0 } else { joint.d };
        let entries =
            [("a", joint.a), ("d", d), ("x", placed[0]), ("y", placed[1]), ("z", placed[2])];
        for (field, _) in entries.into_iter().filter(|(_, length)| *length != 0.0) {
            lengths.push(format!("joint{}.{field}", index + 1));
        }
    }
    let are_free = lengths.iter().all(|name| is_free(name));
    (are_free && !lengths.is_empty()).then_some(lengths)
}
