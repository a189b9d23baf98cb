//! Rigid geometry that approximates a whole model best in a workspace.

use nalgebra::{DMatrix, DVector, Vector3};

use super::answers::random_rows;
use super::error::ExportError;
use crate::design::Workspace;
use crate::fit::{ErrorSummary, Placement, SavedEstimate};
use crate::mechanics::{Angle, Arm};
use crate::model::{Model, Pose};
use crate::problem::{Joint, JointKind, PoseView, Problem};
use crate::remainder::Correction;
use crate::spatial::Frame;

/// Number of poses to which the geometry is fitted, and of other poses in which its errors are
/// computed.
const POSES_PER_SET: usize = 300;
/// Number of poses that are drawn for each fitted one, to have enough inside the workspace.
const MAX_DRAWS_PER_POSE: usize = 40;
/// Distance of two additional fitted points from the target \[m\], which make the fit include the
/// orientation.
const ORIENTATION_LEVER: f64 = 0.1;
/// Step of numerical derivatives with respect to a geometric parameter \[rad\] or \[m\].
const DIFFERENCE_STEP: f64 = 1e-6;
/// Number of Gauss–Newton passes. Few suffice, because the problem is nearly linear.
const GAUSS_NEWTON_PASSES: usize = 5;
/// Index of β in the order of the fitted parameters of a joint.
const BETA: usize = 4;
/// Number added to the diagonal of the normal matrix, relative to its largest diagonal entry.
/// Directions with much smaller eigenvalues keep their identified values.
const RIDGE: f64 = 1e-10;

/// Rigid arm that approximates a whole model best in a workspace.
#[derive(Debug, Clone)]
pub struct RigidFit {
    /// Arm with the fitted geometry.
    pub arm: Arm<f64>,
    /// Position errors of the identified geometry alone relative to the whole model, in poses that
    /// were not fitted.
    pub identified: ErrorSummary,
    /// Position errors of the fitted geometry relative to the whole model, in the same poses.
    pub best: ErrorSummary,
}

/// Fits α, a, θ, d and β of all joints to the positions and orientations that the whole model
/// predicts, in poses drawn within the joint limits and a workspace.
///
/// Minimises Σ ‖p − p̂(x)‖² over the target and two points near it. Directions that no pose
/// determines keep their identified values; base and target are fixed. `has_room` is false if the
/// exported file cannot hold a transform after the last moving joint, whose β is then fixed too.
///
/// # Errors
/// Returns an error if the estimate belongs to another problem, or if too few poses reach the
/// workspace.
pub fn best_rigid(
    problem: &Problem,
    estimate: &SavedEstimate,
    correction: Option<&Correction>,
    (workspace, has_room): (&Workspace, bool),
) -> Result<RigidFit, ExportError> {
    let rows = random_rows(problem, estimate, MAX_DRAWS_PER_POSE * POSES_PER_SET)?;
    let placement = Placement::of(&rows);
    let model = estimate.model(Model::new(problem, &placement.bases, &placement.targets)?);
    let x = estimate.vector(problem, &model)?;
    let all_rows: Vec<usize> = (0..rows.len()).collect();
    let mut poses = placement.poses(&rows, &all_rows, 1.0);
    estimate.count_time_in(&placement, &mut poses);
    let targets = model.target_positions(x.as_slice());
    let frames = model.frames(&poses, x.as_slice());
    let inside = poses.into_iter().zip(frames).filter_map(|(pose, frame)| {
        let frame = frame?;
        workspace.contains(&frame.point(&targets[pose.target])).then_some((pose, frame))
    });
    let (poses, frames): (Vec<Pose>, Vec<Frame<f64>>) = inside.take(2 * POSES_PER_SET).unzip();
    if poses.len() < 2 * POSES_PER_SET {
        return Err(ExportError::Unreachable {
            found: poses.len(),
            draws: MAX_DRAWS_PER_POSE * POSES_PER_SET,
        });
    }
    let bases = model.base_frames(x.as_slice());
    let shifts: Vec<Vector3<f64>> = match correction.filter(|of| of.has_remainder()) {
        Some(correction) => {
            let corrected = correction.at((problem, &model, &x), &[], &poses);
            let in_base = |(pose, shift): (&Pose, Vector3<f64>)| bases[pose.base].resolve(&shift);
            poses.iter().zip(corrected.iter().map(|pose| pose.shift)).map(in_base).collect()
        }
        None => vec![Vector3::zeros(); poses.len()],
    };
    let points = |frame: &Frame<f64>, target: usize| {
        let at = targets[target];
        [Vector3::zeros(), Vector3::x() * ORIENTATION_LEVER, Vector3::y() * ORIENTATION_LEVER]
            .map(|p| frame.point(&(at + p)))
    };
    let rigid =
        |arm: &Arm<f64>, pose: &Pose| points(&rigid_frame(problem, &model, arm, pose), pose.target);
    let wanted: Vec<[Vector3<f64>; 3]> = (poses.iter().zip(&frames).zip(&shifts))
        .map(|((pose, frame), shift)| points(frame, pose.target).map(|point| point + shift))
        .collect();
    let residual = |arm: &Arm<f64>| {
        let each = poses[..POSES_PER_SET].iter().zip(&wanted);
        let of_pose = |(pose, wanted): (&Pose, &[Vector3<f64>; 3])| {
            rigid(arm, pose)
                .iter()
                .zip(wanted)
                .flat_map(|(a, b)| (b - a).data.0[0])
                .collect::<Vec<_>>()
        };
        DVector::from_vec(each.flat_map(of_pose).collect())
    };
    let identified = model.arm(|k| x[k]);
    let moves = |&joint: &usize| identified.joints[joint].kind != JointKind::Fixed;
    let last = (0..identified.joints.len()).rfind(moves);
    let free: Vec<(usize, usize)> = (0..identified.joints.len())
        .filter(moves)
        .flat_map(|joint| (0..5).map(move |field| (joint, field)))
        .filter(|&(joint, field)| has_room || Some(joint) != last || field != BETA)
        .collect();
    let mut arm = identified.clone();
    for _ in 0..GAUSS_NEWTON_PASSES {
        let here = residual(&arm);
        let mut slopes = DMatrix::zeros(here.len(), free.len());
        for (mut column, &(joint, field)) in slopes.column_iter_mut().zip(&free) {
            let mut moved = arm.clone();
            change(&mut moved, joint, field, DIFFERENCE_STEP);
            column.copy_from(&((&here - residual(&moved)) / DIFFERENCE_STEP));
        }
        let mut normal = slopes.tr_mul(&slopes);
        let ridge = RIDGE * normal.diagonal().max();
        (0..free.len()).for_each(|k| normal[(k, k)] += ridge);
        let Some(factor) = normal.cholesky() else { break };
        let step = factor.solve(&slopes.tr_mul(&here));
        free.iter()
            .zip(step.iter())
            .for_each(|(&(joint, field), &by)| change(&mut arm, joint, field, by));
    }
    let judged = |arm: &Arm<f64>| {
        let of_pose = |(pose, wanted): (&Pose, &[Vector3<f64>; 3])| wanted[0] - rigid(arm, pose)[0];
        let errors: Vec<Vector3<f64>> =
            poses[POSES_PER_SET..].iter().zip(&wanted[POSES_PER_SET..]).map(of_pose).collect();
        ErrorSummary::of(&errors)
    };
    Ok(RigidFit { identified: judged(&identified), best: judged(&arm), arm })
}

/// Returns measured − predicted of the positions in `poses`, measuring frame \[m\], predicted by a
/// rigid arm. Bases and targets are those of `model` at the full parameter vector `x`.
pub fn rigid_errors(
    problem: &Problem,
    (model, x): (&Model, &DVector<f64>),
    arm: &Arm<f64>,
    poses: &[Pose],
) -> Vec<Vector3<f64>> {
    let (bases, targets) = (model.base_frames(x.as_slice()), model.target_positions(x.as_slice()));
    let of_pose = |pose: &Pose| {
        let frame = rigid_frame(problem, model, arm, pose);
        pose.measured - bases[pose.base].point(&frame.point(&targets[pose.target]))
    };
    poses.iter().map(of_pose).collect()
}

/// Returns the frame of the joint that a pose's target is mounted on, for a rigid arm, base frame.
/// The commands of mimic joints are computed from their leaders.
fn rigid_frame(problem: &Problem, model: &Model, arm: &Arm<f64>, pose: &Pose) -> Frame<f64> {
    let commands = pose.setup.configuration;
    let led = |(joint, q): (&Joint, &f64)| {
        joint.mimic.map_or(*q, |mimic| q + mimic.ratio * commands[mimic.joint])
    };
    let configuration: Vec<f64> = problem.joints.iter().zip(commands).map(led).collect();
    let setup = PoseView { configuration: &configuration, ..pose.setup };
    arm.rigid_frame(&setup, model.target_joint(pose.target))
}

/// Adds `by` to the geometric parameter `field` of a joint: 0 to 4 for α, a, θ, d, β.
fn change(arm: &mut Arm<f64>, joint: usize, field: usize, by: f64) {
    let joint = &mut arm.joints[joint];
    match field {
        0 => joint.alpha = Angle::new(joint.alpha.value + by),
        1 => joint.a += by,
        2 => joint.theta += by,
        3 => joint.d += by,
        _ => joint.beta = Angle::new(joint.beta.value + by),
    }
}
