//! Check that the fitted poses move the joints far enough for a statement about other poses.

use std::collections::BTreeSet;

use serde_json::json;

use super::checked_fit::CheckedFit;
use super::doubted_columns::{column_name, moving, still_joints};
use super::finding::{Finding, FindingCode};
use super::misfit::misfit;
use crate::observation::Needs;

/// Largest range of the commands of every turning joint at which all poses are alike: 10° \[rad\].
const MAX_ALIKE_TURN: f64 = 10.0 * std::f64::consts::PI / 180.0;
/// Largest range of the commands of a sliding joint at which all poses are alike, relative to the
/// reach of the arm.
const MAX_ALIKE_TRAVEL: f64 = 0.05;
/// Largest distance from the axis of the last joint at which a target stays where it is \[m\].
const MAX_OFF_AXIS: f64 = 1e-3;
/// Minimum number of rows from which the range is judged.
const MIN_ROWS: usize = 3;

/// Checks that every joint moves in the fitted rows, and that not all poses are alike.
pub(super) fn poses_spread(fit: &CheckedFit) -> Option<Finding> {
    let table = fit.table();
    let is_of_arm = |row: &&usize| table.observation(**row).is_of_arm();
    let rows: Vec<usize> = fit.rows().iter().filter(is_of_arm).copied().collect();
    // If the fit is far off, a joint that stands still is a column in doubt.
    if rows.len() < MIN_ROWS || !misfit(fit).is_empty() {
        return None;
    }
    let range = |joint: usize| {
        let values = rows.iter().map(|&row| table.configuration(row)[joint]);
        let (low, high) = crate::numeric::range(values);
        high - low
    };
    let is_turning = |joint: usize| fit.turns(joint);
    let is_narrow = |joint: usize| {
        let reach = fit.model().reach();
        range(joint) < if is_turning(joint) { MAX_ALIKE_TURN } else { MAX_ALIKE_TRAVEL * reach }
    };
    let mut joints: Vec<usize> = moving(fit).collect();
    let widest = |turning: bool| {
        let alike = joints.iter().filter(|joint| is_turning(**joint) == turning);
        alike.map(|&joint| range(joint)).reduce(f64::max)
    };
    let turns = widest(true).map(|most| format!("turns by more than {:.1}°", most.to_degrees()));
    let slides = widest(false).map(|most| format!("slides by more than {:.1} mm", most * 1e3));
    let least: Vec<String> = turns.into_iter().chain(slides).collect();
    let measure = "measure poses over the whole range of the joints (flexcal plan chooses them)";
    if joints.iter().all(|&joint| is_narrow(joint)) && !joints.is_empty() {
        let names: Vec<String> = joints.iter().map(|&joint| column_name(table, joint)).collect();
        let text = format!(
            "the fitted poses are alike: no joint {}, so that parameters and predictions hold near \
             these poses only",
            least.join(" or ")
        );
        let finding = Finding::new(FindingCode::NarrowPoses, [json!(names), true.into()], text);
        return Some(finding.with_remedy(measure));
    }
    // A target on the axis of the last joint stays where it is.
    if joints.last().is_some_and(|&joint| !moves_target(fit, &rows, joint)) {
        joints.pop();
    }
    let still = still_joints(fit, &rows, &joints);
    let &first = still.first()?;
    let names: Vec<String> = still.iter().map(|&joint| column_name(table, joint)).collect();
    let at = table.configuration(rows[0])[first];
    let place = match still.len() {
        1 if is_turning(first) => format!(" at {:.1}°", at.to_degrees()),
        1 => format!(" at {:.1} mm", at * 1e3),
        _ => " where they are".to_owned(),
    };
    let verb = if still.len() == 1 { "stays" } else { "stay" };
    let text = format!(
        "{} {verb}{place} in all fitted rows, so that the fit says little about predictions \
         with other values",
        names.join(", ")
    );
    Some(Finding::new(FindingCode::NarrowPoses, [json!(names), false.into()], text))
}

/// Returns true if the joint at index `joint` moves what one of the `rows` measures: a target that
/// is not on its axis, or a marker in the image of a camera.
fn moves_target(fit: &CheckedFit, rows: &[usize], joint: usize) -> bool {
    let table = fit.table();
    let model = fit.model();
    // Frame i is behind joint i, counted from 1; frame 0 is the base.
    let is_behind = |carrier: Option<usize>| carrier.is_some_and(|frame| frame > joint);
    let moves_view = |row: &usize| {
        let observation = table.observation(*row);
        let [one, other] = model.carriers(observation).map(is_behind);
        observation.description().needs == Needs::Carriers && one != other
    };
    if rows.iter().any(moves_view) {
        return true;
    }
    let measures_length = |row: &&usize| table.observation(**row).measures_length();
    let measured: Vec<usize> = rows.iter().filter(measures_length).copied().collect();
    let mut poses = fit.fitting.poses(&measured);
    let mut seen = BTreeSet::new();
    poses.retain(|pose| seen.insert(pose.target));
    let jacobians = model.command_jacobian(fit.problem, poses, &fit.end.x);
    jacobians.iter().any(|by_command| by_command.column(joint).norm() > MAX_OFF_AXIS)
}
