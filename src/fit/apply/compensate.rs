//! Compensation: joint commands that bring the identified arm to desired poses.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::error::{InputError, InputErrorKind};
use crate::fit::Placement;
use crate::fit::apply::nearest_command::Goal;
use crate::least_squares::solver::{self, Bounds, Settings};
use crate::least_squares::{Fit, LinearRows, jacobian_and_residual};
use crate::measurement::Measurements;
use crate::model::{CommandResiduals, Model, Pose};
use crate::problem::{JointKind, LazyPast, Mimic, PoseView, Problem};
use crate::spatial::Frame;

use crate::fit::stages::stage::StageError;

/// Standard deviation (1 σ) of the desired position in the least-squares problem \[m\]. The
/// distance from the seed has 1 σ = 1 rad or 1 m, so that the seed only selects among the commands
/// that reach the position.
const POSITION_SIGMA: f64 = 1e-6;
/// Standard deviation (1 σ) of the desired orientation \[rad\], chosen like [`POSITION_SIGMA`].
const ORIENTATION_SIGMA: f64 = 1e-6;
/// Largest change of a command in a pass at which the command has converged \[rad\] or \[m\].
const MAX_CONVERGED_CHANGE: f64 = 1e-10;
/// Maximum number of passes of [`damped_search`]. A command that has not converged by then is
/// returned with its remaining error.
const MAX_PASSES: usize = 20;
/// Largest distance of the predicted from the desired position at which a target is reached \[m\].
const MAX_REACHED_DISTANCE: f64 = 1e-6;
/// Largest angle between predicted and desired orientation at which a target is reached \[rad\].
const MAX_REACHED_ANGLE: f64 = 1e-6;
/// Number of coordinates of a rigid-body pose, which is also the smallest number of moving joints
/// that can reach any pose in the workspace.
const POSE_COORDINATES: usize = 6;

/// Joint command for one target.
#[derive(Debug, Clone, PartialEq)]
pub struct Command {
    /// Index of the target's row in the table of targets.
    pub row: usize,
    /// Configuration, shape = (joints) \[rad\] or \[m\]; the seed's value at fixed joints.
    pub configuration: Vec<f64>,
    /// Remaining position error, desired − predicted, measuring frame \[m\].
    pub miss: Vector3<f64>,
    /// Length of the position error if the seed were commanded \[m\].
    pub seed_miss: f64,
    /// Remaining rotation vector from the predicted to the desired orientation, measuring frame
    /// \[rad\]; `None` if no orientation is desired.
    pub turn: Option<Vector3<f64>>,
    /// Angle between predicted and desired orientation if the seed were commanded \[rad\]; `None`
    /// if no orientation is desired.
    pub seed_orientation_error: Option<f64>,
}

impl Command {
    /// Returns true if the remaining position error is at most 1 µm and the remaining orientation
    /// error at most 1 µrad.
    pub fn is_reached(&self) -> bool {
        is_reached(&self.miss, self.turn.as_ref())
    }
}

fn is_reached(miss: &Vector3<f64>, turn: Option<&Vector3<f64>>) -> bool {
    miss.norm() <= MAX_REACHED_DISTANCE && turn.is_none_or(|turn| turn.norm() <= MAX_REACHED_ANGLE)
}

/// Returns `rows` with target poses: those that the nominal arm reaches by the commands of the
/// rows, measuring frame. Bases and tools are those of the full parameter vector `x`.
///
/// A target pose has an orientation if at least six moving joints lead to the target; with fewer,
/// position and orientation cannot both be reached.
///
/// # Errors
/// Returns an error if the nominal arm has no equilibrium in one of the rows.
pub fn waypoints(
    problem: &Problem,
    model: &Model,
    x: &DVector<f64>,
    rows: &Measurements,
) -> Result<Measurements, InputError> {
    let placement = Placement::of(rows);
    let nominal = DVector::from_iterator(
        x.len(),
        model
            .parameters
            .iter()
            .zip(x)
            .map(|(parameter, x)| if parameter.site.is_placement() { *x } else { 0.0 }),
    );
    let all_rows: Vec<usize> = (0..rows.len()).collect();
    let poses = placement.poses(rows, &all_rows, 1.0);
    let mut targets = rows.clone();
    let tree = problem.tree();
    let commanded = |row: usize| {
        let carrier = model.target_joint(placement.target_of(row));
        let leads = problem
            .joints
            .iter()
            .enumerate()
            .filter(|(joint, _)| tree.path_contains(*joint, carrier));
        leads.filter(|(_, joint)| joint.command_kind() != JointKind::Fixed).count()
    };
    let oriented: Vec<bool> =
        all_rows.iter().map(|&row| commanded(row) >= POSE_COORDINATES).collect();
    targets.orientations = oriented.contains(&true).then(|| {
        let none = Vector3::from_element(f64::NAN);
        let turns = model.orientations(&poses, nominal.as_slice()).into_iter().zip(&oriented);
        let rotations = turns.map(|(turn, is_kept)| if *is_kept { turn } else { none });
        rotations.map(UnitQuaternion::from_scaled_axis).collect()
    });
    targets.positions = model.predict(poses, &nominal);
    targets.position_measured = true;
    match targets.positions.iter().position(|position| !position.iter().all(|x| x.is_finite())) {
        Some(row) => {
            let error = rows.location(row).error(InputErrorKind::NoEquilibrium);
            Err(problem.with_cause_of_overload(error, rows.largest_payload(problem)))
        }
        None => Ok(targets),
    }
}

/// Transforms target positions and orientations from the base frame of the arm to the measuring
/// frame.
pub fn seen_from_base(model: &Model, x: &DVector<f64>, targets: &Measurements) -> Measurements {
    transformed_by_bases(targets, &model.base_frames(x.as_slice()))
}

/// Transforms target positions and orientations from the measuring frame to the base frame of the
/// arm.
pub fn seen_in_base(model: &Model, x: &DVector<f64>, targets: &Measurements) -> Measurements {
    let bases: Vec<Frame<f64>> =
        model.base_frames(x.as_slice()).iter().map(Frame::inverse).collect();
    transformed_by_bases(targets, &bases)
}

/// Transforms the position and orientation of each row by the frame in `bases` that belongs to the
/// row's base.
fn transformed_by_bases(targets: &Measurements, bases: &[Frame<f64>]) -> Measurements {
    let placement = Placement::of(targets);
    let base = |row: usize| &bases[placement.base_of(row)];
    let mut moved = targets.clone();
    for (row, position) in moved.positions.iter_mut().enumerate() {
        *position = base(row).point(position);
    }
    for (row, orientation) in moved.orientations.iter_mut().flatten().enumerate() {
        let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&base(row).axes));
        *orientation = UnitQuaternion::from(turn) * *orientation;
    }
    moved
}

/// Computes a command for each row of `targets`. It is the configuration nearest to that of the row
/// (the seed) with which the arm reaches the row's position, and its orientation if it has one. The
/// arm has the full parameter vector `x`; commands stay within the joint limits of `problem`.
///
/// Joints that do not lead to the target of a row keep the row's values. Effects on the
/// measurement, such as instrument drift, are left out, because targets are desired positions of
/// the arm.
///
/// Minimises ‖(desired − predicted(q)) / 1 µm‖² + ‖log(desired predicted(q)ᵀ) / 1 µrad‖² + ‖q −
/// seed‖² over q by damped Newton steps with dual numbers. The derivatives neglect that effects
/// such as harmonics depend on the command.
///
/// # Errors
/// Returns an error if the limits of a joint exclude each other.
pub fn compensate(
    problem: &Problem,
    model: &Model,
    x: &DVector<f64>,
    targets: &Measurements,
) -> Result<Vec<Command>, StageError> {
    let placement = Placement::of(targets);
    let arm = model.with_free_commands(problem, x).without_instrument_errors();
    let rows: Vec<usize> = (0..targets.len()).collect();
    let moving = arm.moving_joints();
    let arm_with_mimics = arm.clone().with_mimic_joints(problem);
    let tree = problem.tree();
    let mut commands = Vec::with_capacity(rows.len());
    let sigmas = (POSITION_SIGMA, Some(ORIENTATION_SIGMA));
    for (row, mut pose) in placement.oriented_poses(targets, &rows, sigmas).into_iter().enumerate()
    {
        pose.sigma = POSITION_SIGMA;
        // The poses before a target are not known.
        pose.setup.past = LazyPast::default();
        let seed = targets.configuration(row);
        let n = moving.len();
        let carrier = model.target_joint(pose.target);
        let leads = |joint: usize| tree.path_contains(joint, carrier);
        let serves = |joint: usize| {
            let moves_target = |(index, mimic): (usize, Option<Mimic>)| {
                let follows = mimic.is_some_and(|mimic| mimic.joint == joint);
                leads(index) && (index == joint || follows)
            };
            problem.joints.iter().map(|other| other.mimic).enumerate().any(moves_target)
        };
        let at = |configuration: &[f64]| {
            let pose = Pose { setup: PoseView { configuration, ..pose.setup }, ..pose };
            let turn = pose
                .orientation
                .map(|_| arm.orientation_residuals(vec![pose], &DVector::zeros(n))[0]);
            (arm.residuals(vec![pose], &DVector::zeros(n))[0], turn)
        };
        let serving: Vec<usize> = moving.iter().copied().filter(|&joint| serves(joint)).collect();
        let full = |q: &DVector<f64>| {
            let mut configuration = seed.to_vec();
            serving.iter().zip(q.iter()).for_each(|(&joint, &q)| configuration[joint] = q);
            configuration
        };
        let limits: Vec<(f64, f64)> =
            serving.iter().map(|&joint| problem.joints[joint].limits).collect();
        let goal = Goal {
            misfit: &|q| {
                let (miss, turn) = at(&full(q));
                let turn = turn.as_ref().map(Vector3::iter).into_iter().flatten();
                DVector::from_vec(miss.iter().chain(turn).copied().collect())
            },
            slopes: &|q| {
                let configuration = full(q);
                let setup = PoseView { configuration: &configuration, ..pose.setup };
                let residuals = CommandResiduals::new(
                    problem,
                    &arm_with_mimics,
                    n,
                    vec![Pose { setup, ..pose }],
                );
                let (slopes, _) = jacobian_and_residual(&residuals, &DVector::zeros(n));
                let columns = moving.iter().enumerate().filter(|(_, joint)| serves(**joint));
                slopes.select_columns(&columns.map(|(k, _)| k).collect::<Vec<_>>())
                    * -POSITION_SIGMA
            },
            limits: &limits,
        };
        let start = DVector::from_iterator(serving.len(), serving.iter().map(|&joint| seed[joint]));
        let mut configuration = full(&goal.nearest(&start));
        let (miss, turn) = at(&configuration);
        if !is_reached(&miss, turn.as_ref()) {
            configuration = damped_search(problem, (&arm, &arm_with_mimics), &serving, pose)?;
        }
        let ((miss, turn), (before, turn_before)) = (at(&configuration), at(seed));
        let (seed_miss, seed_orientation_error) =
            (before.norm(), turn_before.map(|turn| turn.norm()));
        commands.push(Command {
            row,
            configuration,
            miss,
            seed_miss,
            turn,
            seed_orientation_error,
        });
    }
    Ok(commands)
}

/// Computes the configuration for one target by Levenberg–Marquardt steps, for targets that Newton
/// steps do not reach. Effects that depend on the command are evaluated at the command of the
/// previous pass. Only the joints `serving`, which lead to the target, move.
fn damped_search(
    problem: &Problem,
    (arm, arm_with_mimics): (&Model, &Model),
    serving: &[usize],
    pose: Pose,
) -> Result<Vec<f64>, StageError> {
    let (seed, moving) = (pose.setup.configuration, arm.moving_joints());
    let n = moving.len();
    let mut configuration = seed.to_vec();
    for _ in 0..MAX_PASSES {
        let bound = |pick: fn((f64, f64)) -> f64| {
            let room = |j: usize| pick(problem.joints[j].limits) - configuration[j];
            let room = moving.iter().map(|j| if serving.contains(j) { room(*j) } else { 0.0 });
            DVector::from_iterator(n, room)
        };
        let bounds = Bounds::new(bound(|limits| limits.0), bound(|limits| limits.1))?;
        let away = DVector::from_iterator(n, moving.iter().map(|&j| configuration[j] - seed[j]));
        let pose = Pose { setup: PoseView { configuration: &configuration, ..pose.setup }, ..pose };
        let residuals = CommandResiduals::new(problem, arm_with_mimics, n, vec![pose]);
        let near = LinearRows { matrix: DMatrix::identity(n, n), constant: away };
        let fit = Fit::new(&residuals).with_rows(near)?;
        let step =
            solver::minimise_bounded(fit, DVector::zeros(n), &bounds, &Settings::default()).x;
        for (&joint, step) in
            moving.iter().zip(step.iter()).filter(|(joint, _)| serving.contains(joint))
        {
            let (min, max) = problem.joints[joint].limits;
            configuration[joint] = (configuration[joint] + step).clamp(min, max);
        }
        if !arm.follows_commands() || step.amax() <= MAX_CONVERGED_CHANGE {
            break;
        }
    }
    Ok(configuration)
}
