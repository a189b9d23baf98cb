//! Corrected commands, carried out by the arm of matrices.

use flexcal::measurement::Measurements;
use flexcal::remainder::{Compensation, TargetFrame};
use nalgebra::{Rotation3, UnitQuaternion, Vector3};

use super::arm::point;
use super::case::Case;
use super::checks::{SAME_PLACE, ensure};
use super::fitted::Fitted;
use super::row::Row;
use super::world::World;

/// Distance \[m\] and angle \[rad\] at which a target counts as reached.
const REACHED: f64 = 1e-6;

/// Checks that the commands for the measured positions bring the identified arm there, within the
/// ranges of its joints. Returns how many targets are reached.
pub fn commands_reach(case: &Case, fit: &Fitted, world: &World) -> Result<usize, String> {
    let mut problem = fit.problem.clone();
    problem.data.held_out = None;
    let read = Measurements::read_poses(&problem.data.files, &problem);
    let targets = read.map_err(|error| format!("targets are not read: {error}"))?.0;
    let few: Vec<usize> = (0..targets.len()).step_by(4).collect();
    let fitted = (&fit.saved, fit.correction.as_ref(), &[][..]);
    let found =
        Compensation::new(&problem, fitted, targets.select(&few), TargetFrame::Measuring, 0.95);
    let found = found.map_err(|error| format!("no commands: {error}"))?;
    let mut reached = 0;
    for command in &found.commands {
        let target = &case.rows[few[command.row]];
        let mut q = command.configuration.clone();
        for (k, joint) in world.arm.joints.iter().enumerate() {
            if let Some((leader, ratio)) = joint.mimic {
                q[k] = ratio * q[leader];
            }
        }
        let row = Row { q, ..target.clone() };
        // Errors of the instrument are none of the arm, so commands leave them alone.
        let pose = world.true_pose(&row).ok_or("the commanded arm does not come to rest")?;
        let miss = target.position - point(&pose, &Vector3::zeros());
        let off = (miss - command.miss).norm();
        ensure!(off < SAME_PLACE, "row {}: the miss is {off} m off the matrices", few[command.row]);
        if let Some((turn, desired)) = command.turn.zip(target.orientation) {
            let turned =
                Rotation3::from_matrix_unchecked(pose.fixed_view::<3, 3>(0, 0).into_owned());
            let left = UnitQuaternion::from_rotation_matrix(&(desired * turned.inverse()));
            let off = left.angle_to(&UnitQuaternion::from_scaled_axis(turn));
            ensure!(
                off < SAME_PLACE,
                "row {}: the turn is {off} rad off the matrices",
                few[command.row]
            );
        }
        let is_near = miss.norm() <= REACHED + SAME_PLACE
            && command.turn.is_none_or(|turn| turn.norm() <= REACHED);
        ensure!(
            !command.is_reached() || is_near,
            "row {} is not reached as stated",
            few[command.row]
        );
        for (joint, &q) in world.arm.joints.iter().zip(&command.configuration) {
            let [low, high] = joint.limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]);
            let is_within = (low - 1e-9..=high + 1e-9).contains(&q);
            ensure!(
                !command.is_reached() || is_within,
                "row {}: a command of {q} leaves its range",
                few[command.row]
            );
        }
        reached += usize::from(command.is_reached());
    }
    Ok(reached)
}
