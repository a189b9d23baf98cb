//! The purpose of it all: commands that bring the arm as it is to where it should be.

use nalgebra::{DMatrix, DVector, Vector3};

use super::Placement;
use crate::least_squares::solver::{self, Bounds, Settings};
use crate::least_squares::{Fit, LinearRows};
use crate::measurement::Measurements;
use crate::model::{Model, Pose, PoseResiduals};
use crate::problem::PoseView;
use crate::problem::Problem;

use super::stage::StageError;

/// 1 σ of the target position against 1 σ = 1 (rad or m) of the way from the seed: the position decides, the seed breaks
/// ties \[m\].
const POSITION_WEIGHT: f64 = 1e-6;
/// A command has settled when a pass changes it by less [rad or m].
const SETTLED: f64 = 1e-10;
/// Passes after which a command that does not settle is taken as it is: its miss says how good it is.
const MAX_PASSES: usize = 20;
/// A target counts as reached within this distance \[m\].
const REACHED: f64 = 1e-6;

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
}

impl Command {
    /// Whether the arm gets there.
    pub fn is_reached(&self) -> bool {
        self.miss.norm() <= REACHED
    }
}

/// For each row of `targets`, the configuration nearest to the row's own that brings the arm with parameters `x` to the
/// row's position, within the joint limits of `problem`.
///
/// min over q of ‖(desired − predicted(q)) / 1 µm‖² + ‖q − seed‖²: Newton's method on the position by dual numbers, with
/// redundancy resolved towards the seed. Where effects follow the command (a transmission ratio, harmonics), they are
/// taken at the command found so far, until it settles.
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
    let arm = model.commanded(problem, x);
    let rows: Vec<usize> = (0..targets.len()).collect();
    let unknowns: Vec<usize> = (0..arm.parameters.len()).collect();
    let moving = arm.moving_joints();
    let mut commands = Vec::with_capacity(rows.len());
    for (row, mut pose) in placement.poses(targets, &rows, POSITION_WEIGHT).into_iter().enumerate() {
        pose.sigma = POSITION_WEIGHT;
        let seed = targets.configuration(row);
        let n = moving.len();
        let at = |configuration: &[f64]| {
            let pose = Pose { setup: PoseView { configuration, ..pose.setup }, ..pose };
            arm.residuals(vec![pose], &DVector::zeros(n))[0]
        };
        let mut configuration = seed.to_vec();
        for _ in 0..MAX_PASSES {
            let bound = |pick: fn((f64, f64)) -> f64| {
                let room = moving.iter().map(|&j| pick(problem.joints[j].limits) - configuration[j]);
                DVector::from_iterator(n, room)
            };
            let bounds = Bounds::new(bound(|limits| limits.0), bound(|limits| limits.1))?;
            let away = DVector::from_iterator(n, moving.iter().map(|&j| configuration[j] - seed[j]));
            let pose = Pose { setup: PoseView { configuration: &configuration, ..pose.setup }, ..pose };
            let residuals = PoseResiduals::new(&arm, vec![pose], unknowns.clone(), DVector::zeros(n));
            let near = LinearRows { matrix: DMatrix::identity(n, n), constant: away };
            let fit = Fit::new(&residuals).with_rows(near)?;
            let step = solver::minimise_bounded(fit, DVector::zeros(n), &bounds, &Settings::default()).x;
            for (&joint, step) in moving.iter().zip(step.iter()) {
                let (min, max) = problem.joints[joint].limits;
                configuration[joint] = (configuration[joint] + step).clamp(min, max);
            }
            if !arm.follows_commands() || step.amax() <= SETTLED {
                break;
            }
        }
        let (miss, seed_miss) = (at(&configuration), at(seed).norm());
        commands.push(Command { row, configuration, miss, seed_miss });
    }
    Ok(commands)
}
