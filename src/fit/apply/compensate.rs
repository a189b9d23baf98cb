//! The purpose of it all: commands that bring the arm as it is to where it should be.

use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::error::{InputError, InputErrorKind};
use crate::fit::Placement;
use crate::least_squares::solver::{self, Bounds, Settings};
use crate::least_squares::{Fit, LinearRows};
use crate::measurement::Measurements;
use crate::model::{CommandResiduals, Model, Pose};
use crate::problem::{JointKind, LazyPast, Mimic, PoseView, Problem};
use crate::spatial::Frame;

use crate::fit::stages::stage::StageError;

/// 1 σ of the target position against 1 σ = 1 (rad or m) of the way from the seed: the position
/// decides, the seed breaks ties \[m\].
const POSITION_WEIGHT: f64 = 1e-6;
/// 1 σ of the target orientation, likewise \[rad\].
const ORIENTATION_WEIGHT: f64 = 1e-6;
/// A command has settled when a pass changes it by less [rad or m].
const SETTLED: f64 = 1e-10;
/// Passes after which a command that does not settle is taken as it is: its miss says how good it
/// is.
const MAX_PASSES: usize = 20;
/// A target counts as reached within this distance \[m\].
const REACHED: f64 = 1e-6;
/// … and turned by no more than this from it \[rad\].
const REACHED_TURN: f64 = 1e-6;
/// Coordinates of a pose: with as many moving joints an arm that is not at the edge of its reach
/// has a command for it.
const POSE: usize = 6;

/// A command for one target.
#[derive(Debug, Clone, PartialEq)]
pub struct Command {
    /// Row of the target.
    pub row: usize,
    /// Configuration, shape = (joints) \[rad\] or \[m\]; the seed's value at fixed joints.
    pub configuration: Vec<f64>,
    /// Desired − predicted position \[m\].
    pub miss: Vector3<f64>,
    /// Distance to the target before: with the seed as command \[m\].
    pub seed_miss: f64,
    /// Rotation vector from the predicted to the desired orientation, measuring frame \[rad\],
    /// where one is desired.
    pub turn: Option<Vector3<f64>>,
    /// Angle to the desired orientation before \[rad\], likewise.
    pub seed_turn: Option<f64>,
}

impl Command {
    /// Whether the arm gets there.
    pub fn is_reached(&self) -> bool {
        self.miss.norm() <= REACHED && self.turn.is_none_or(|turn| turn.norm() <= REACHED_TURN)
    }
}

/// Where targets without positions are: where the nominal arm would have been with the commands of
/// the rows, on the bases and with the tools of the full parameter vector `x`, measuring frame.
/// With its orientation each to which six moving joints and more lead; with fewer it could not have
/// both.
///
/// # Errors
/// The nominal arm has no equilibrium in one of the rows.
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
            .map(|(own, x)| if own.site.is_placement() { *x } else { 0.0 }),
    );
    let all: Vec<usize> = (0..rows.len()).collect();
    let poses = placement.poses(rows, &all, 1.0);
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
    let oriented: Vec<bool> = all.iter().map(|&row| commanded(row) >= POSE).collect();
    targets.orientations = oriented.contains(&true).then(|| {
        let none = Vector3::from_element(f64::NAN);
        let turns = model.orientations(&poses, nominal.as_slice()).into_iter().zip(&oriented);
        let all = turns.map(|(turn, is_kept)| if *is_kept { turn } else { none });
        all.map(UnitQuaternion::from_scaled_axis).collect()
    });
    targets.positions = model.predict(poses, &nominal);
    targets.position_measured = true;
    match targets.positions.iter().position(|position| !position.iter().all(|x| x.is_finite())) {
        Some(row) => Err(rows.location(row).error(InputErrorKind::NoEquilibrium)),
        None => Ok(targets),
    }
}

/// Targets that are given in the frame of the arm's base, as seen from the measuring frame.
pub fn seen_from_base(model: &Model, x: &DVector<f64>, targets: &Measurements) -> Measurements {
    moved(targets, &model.base_frames(x.as_slice()))
}

/// The inverse: positions and orientations in the measuring frame, as seen from the arm's base.
pub fn seen_in_base(model: &Model, x: &DVector<f64>, targets: &Measurements) -> Measurements {
    let bases: Vec<Frame<f64>> =
        model.base_frames(x.as_slice()).iter().map(Frame::inverse).collect();
    moved(targets, &bases)
}

/// Positions and orientations moved by the frame of each row's base.
fn moved(targets: &Measurements, bases: &[Frame<f64>]) -> Measurements {
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

/// For each row of `targets`, the configuration nearest to the row's own that brings the arm with
/// parameters `x` to the row's position, and to its orientation where it has one, within the joint
/// limits of `problem`.
///
/// Joints of other branches than the one that carries the row's target keep to the row's commands.
///
/// What effects do to the measurement (an instrument that drifts or has a scale) is left out:
/// targets are where the arm shall be.
///
/// min over q of ‖(desired − predicted(q)) / 1 µm‖² + ‖log(desired predicted(q)ᵀ) / 1 µrad‖² + ‖q −
/// seed‖²: Newton's method by dual numbers, with redundancy resolved towards the seed. Where
/// effects follow the command (a transmission ratio, harmonics), they are taken at the command
/// found so far, until it settles.
///
/// # Errors
/// The limits of a joint exclude each other.
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
    let led = arm.clone().with_mimic_joints(problem);
    let tree = problem.tree();
    let mut commands = Vec::with_capacity(rows.len());
    let weights = (POSITION_WEIGHT, Some(ORIENTATION_WEIGHT));
    for (row, mut pose) in placement.oriented_poses(targets, &rows, weights).into_iter().enumerate()
    {
        pose.sigma = POSITION_WEIGHT;
        // Nobody knows what is measured or done before a target.
        pose.setup.past = LazyPast::default();
        let seed = targets.configuration(row);
        let n = moving.len();
        let carrier = model.target_joint(pose.target);
        let leads = |joint: usize| tree.path_contains(joint, carrier);
        let serves = |joint: usize| {
            let moved = |(own, follows): (usize, Option<Mimic>)| {
                leads(own) && (own == joint || follows.is_some_and(|own| own.joint == joint))
            };
            problem.joints.iter().map(|own| own.mimic).enumerate().any(moved)
        };
        let at = |configuration: &[f64]| {
            let pose = Pose { setup: PoseView { configuration, ..pose.setup }, ..pose };
            let turn = pose
                .orientation
                .map(|_| arm.orientation_residuals(vec![pose], &DVector::zeros(n))[0]);
            (arm.residuals(vec![pose], &DVector::zeros(n))[0], turn)
        };
        let mut configuration = seed.to_vec();
        for _ in 0..MAX_PASSES {
            let bound = |pick: fn((f64, f64)) -> f64| {
                let own = |j: usize| pick(problem.joints[j].limits) - configuration[j];
                let room = moving.iter().map(|&j| if serves(j) { own(j) } else { 0.0 });
                DVector::from_iterator(n, room)
            };
            let bounds = Bounds::new(bound(|limits| limits.0), bound(|limits| limits.1))?;
            let away =
                DVector::from_iterator(n, moving.iter().map(|&j| configuration[j] - seed[j]));
            let pose =
                Pose { setup: PoseView { configuration: &configuration, ..pose.setup }, ..pose };
            let residuals = CommandResiduals::new(problem, &led, n, vec![pose]);
            let near = LinearRows { matrix: DMatrix::identity(n, n), constant: away };
            let fit = Fit::new(&residuals).with_rows(near)?;
            let step =
                solver::minimise_bounded(fit, DVector::zeros(n), &bounds, &Settings::default()).x;
            for (&joint, step) in
                moving.iter().zip(step.iter()).filter(|(joint, _)| serves(**joint))
            {
                let (min, max) = problem.joints[joint].limits;
                configuration[joint] = (configuration[joint] + step).clamp(min, max);
            }
            if !arm.follows_commands() || step.amax() <= SETTLED {
                break;
            }
        }
        let ((miss, turn), (before, turn_before)) = (at(&configuration), at(seed));
        let (seed_miss, seed_turn) = (before.norm(), turn_before.map(|turn| turn.norm()));
        commands.push(Command { row, configuration, miss, seed_miss, turn, seed_turn });
    }
    Ok(commands)
}
