//! Commands of an identified arm for a table of targets.

use nalgebra::{DVector, Vector3};

use super::apply::compensate;
use super::bounds::Bounds;
use super::correction::Correction;
use super::rivals::Rival;
use super::uncorrected::{Uncorrected, uncorrected, unknown_sides};
use crate::error::{InputError, InputErrorKind};
use crate::fit::{self, Command, Placement, SavedEstimate, SavedEstimateError, StageError};
use crate::measurement::Measurements;
use crate::model::Model;
use crate::problem::{LazyPast, Problem};

/// Largest probability that another effect acts than the declared one, with which bounds are
/// computed.
const MAX_SHARE: f64 = 0.99;

/// Frame in which the positions of targets are given.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TargetFrame {
    /// Measuring frame, in which measured positions are given, too.
    Measuring,
    /// Frame of the arm's base.
    Base,
}

/// Commands that bring the identified arm to targets.
#[derive(Debug, Clone)]
pub struct Compensation {
    /// Targets in the frame in which they were given.
    pub targets: Measurements,
    /// Command for each target.
    pub commands: Vec<Command>,
    /// Bounds of the errors with which the commands reach the targets; `None` if the estimate does
    /// not hold the uncertainty of predictions.
    pub bounds: Option<Bounds>,
    /// True if the targets depend on the pose of the base, which the estimate does not determine.
    pub is_base_open: bool,
    /// For each target, how far a wrong choice among effects that the loop did not decide would
    /// move the arm \[m\]; the bounds include it. Empty without such effects.
    pub differences: Vec<f64>,
    /// Declared effects of the instrument, by which the commands are not corrected. The bounds
    /// include that the arm or its base moves by them instead. Also effects that depend on
    /// directions of approach that the targets do not state, which the bounds include.
    pub uncorrected: Vec<Uncorrected>,
}

/// Error of targets for which no commands can be found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CompensationError {
    /// The targets and the problem do not fit each other.
    #[error(transparent)]
    Input(#[from] InputError),
    /// The estimate is of another problem, or lacks a base or tool that the targets name.
    #[error(transparent)]
    Estimate(#[from] SavedEstimateError),
    /// The search for a command cannot be set up.
    #[error(transparent)]
    Stage(#[from] StageError),
}

impl Compensation {
    /// Finds the commands for `targets`. Targets without positions are waypoints: the identified
    /// arm is brought to where the nominal arm would be with the same commands. `correction`
    /// corrects predictions and bounds errors with probability `level`. The bounds include what the
    /// errors of the instrument differ by if `rivals` of declared effects act.
    ///
    /// # Errors
    /// Returns an error if a row is no position, the estimate is of another problem or lacks a base
    /// or tool of the targets, or the nominal arm has no equilibrium at a waypoint.
    pub fn new(
        problem: &Problem,
        (estimate, correction, rivals): (&SavedEstimate, Option<&Correction>, &[Rival]),
        targets: Measurements,
        frame: TargetFrame,
        level: f64,
    ) -> Result<Self, CompensationError> {
        let targets = targets.arm_rows().with_sides(estimate.has_approach).into_owned();
        if let Some(row) = (0..targets.len()).find(|&row| !targets.observation(row).is_position()) {
            return Err(targets.location(row).error(InputErrorKind::NoTarget).into());
        }
        let placement = Placement::of(&targets);
        let model = estimate.model(Model::new(problem, &placement.bases, &placement.targets)?);
        let x = estimate.vector(problem, &model)?;
        // Waypoints are relative to the arm, so they do not depend on the pose of the base.
        let is_seen = targets.position_measured && frame == TargetFrame::Measuring;
        // The targets are kept in the frame in which they are shown, and sought in the measuring
        // frame.
        let (targets, sought) = match (targets.position_measured, frame) {
            (false, _) => {
                let waypoints = fit::waypoints(problem, &model, &x, &targets)?;
                let shown = match frame {
                    TargetFrame::Measuring => waypoints.clone(),
                    TargetFrame::Base => fit::seen_in_base(&model, &x, &waypoints),
                };
                (shown, waypoints)
            }
            (true, TargetFrame::Measuring) => (targets.clone(), targets),
            (true, TargetFrame::Base) => {
                let sought = fit::seen_from_base(&model, &x, &targets);
                (targets, sought)
            }
        };
        let (commands, bounds) = match correction {
            Some(correction) => {
                let fitted = (estimate, &x);
                let found = compensate(problem, &model, fitted, &sought, correction)?;
                let (commands, poses) = found.into_iter().unzip();
                (commands, Some(Bounds::new(correction, poses, level)))
            }
            None => (fit::compensate(problem, &model, &x, &sought)?, None),
        };
        // Where the arm is meant to be is told by the instrument, or relative to the base.
        let placed = if is_seen { targets.clone() } else { fit::seen_in_base(&model, &x, &sought) };
        let fitted = (estimate, &x);
        let mut uncorrected = uncorrected((problem, &model), fitted, (&placed, is_seen));
        uncorrected.extend(sides_of_commands((problem, &model), &x, (&sought, &commands)));
        let mut differences = vec![0.0_f64; if rivals.is_empty() { 0 } else { placed.len() }];
        for rival in rivals {
            let rival = rival.differences(problem, &placed)?;
            differences.iter_mut().zip(&rival).for_each(|(most, of)| *most = most.max(*of));
        }
        // What the bounds include whole is not included once more with a share.
        let is_whole = |rival: &&Rival| {
            let is_it = |of: &Uncorrected| of.effect.is_same_as(&rival.declared.effect.effect);
            uncorrected.iter().any(|of| of.is_bounded && is_it(of))
        };
        let shared = || rivals.iter().filter(|rival| !is_whole(rival));
        let share = shared().map(|rival| rival.share).sum::<f64>().min(MAX_SHARE);
        let bounds = match (bounds, correction) {
            (Some(bounds), Some(correction)) if shared().next().is_some() => {
                let quantile = |level: f64| correction.scores.quantile(level);
                Some(bounds.with_differences(quantile, share, &differences))
            }
            (bounds, _) => bounds,
        };
        let bounds = bounds.map(|bounds| {
            let whole = |target: usize| {
                let bounded = uncorrected.iter().filter(|of| of.is_bounded);
                let (sides, others): (Vec<_>, Vec<_>) = bounded.partition(|of| of.side.is_some());
                let sides = sides.iter().map(|of| of.differences[target].norm()).sum::<f64>();
                sides + others.iter().map(|of| of.differences[target]).sum::<Vector3<f64>>().norm()
            };
            let whole: Vec<f64> = (0..placed.len()).map(whole).collect();
            bounds.with_uncorrected(&whole).with_misfit(estimate.misfit)
        });
        let is_base_open = is_seen && estimate.leaves_base_open();
        Ok(Self { targets, commands, bounds, is_base_open, differences, uncorrected })
    }

    /// Returns true if every target is reached.
    pub fn reaches_all(&self) -> bool {
        self.commands.iter().all(Command::is_reached)
    }
}

/// Returns the effects of unknown directions of approach at the commands for `targets`, which have
/// no earlier poses.
fn sides_of_commands(
    (problem, model): (&Problem, &Model),
    x: &DVector<f64>,
    (targets, commands): (&Measurements, &[Command]),
) -> Vec<Uncorrected> {
    let every_row: Vec<usize> = (0..targets.len()).collect();
    let mut poses = Placement::of(targets).poses(targets, &every_row, 1.0);
    for (pose, command) in poses.iter_mut().zip(commands) {
        pose.setup.past = LazyPast::default();
        pose.setup.configuration = &command.configuration;
    }
    unknown_sides((problem, model), x.as_slice(), &poses)
}
