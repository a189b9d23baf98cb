//! What the figures of a report show, as numbers: errors pose by pose, correlations, residuals
//! against their cause.

use std::path::PathBuf;

use nalgebra::Vector3;
use rayon::prelude::*;

use super::arm::{Arm, Poses};
use super::cause::{self, Cause, Closed};
use super::contribution::{self, Contribution};
use super::coverage::{self, Coverage};
use super::pose::{PoseError, weighted};
use crate::error::{Location, Warning};
use crate::fit::{
    Before, Comparison, Correlations, Identification, IdentifyError, Procedure, Strategy,
};
use crate::measurement::Dataset;
use crate::model::{CentreLine, Model, Pose};
use crate::problem::Problem;
use crate::report::table::{Command, commands};
use crate::residual_tests::Findings;
use crate::select::{ClosedLoop, Found, examine};

/// Poses that a page knows one by one at most.
const MOST: usize = 600;

/// What has been done for the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stage {
    /// Nothing but to find where base and target are, where these are free.
    Registered,
    /// Nothing: the nominal arm, without elasticity, in the measured frames; what the paper calls
    /// before.
    Before,
    /// Geometry identified, elasticity ignored: the model is rigid.
    Ignoring,
    /// Geometry and elasticity identified.
    Elastic,
    /// Identified, where there is nothing to say on elasticity.
    Identified,
    /// Identified with the effects that the loop found.
    Closed,
}

/// The errors of the arm at one stage.
#[derive(Debug, Clone, PartialEq)]
pub struct StageErrors {
    /// Which.
    pub stage: Stage,
    /// Errors measured − predicted of the held-out poses, measuring frame \[m\].
    pub errors: Vec<Vector3<f64>>,
}

/// Everything that the figures of one report show, and the tests of the residual.
#[derive(Debug, Clone)]
pub struct PlotData {
    /// The arm from nominal to best.
    pub stages: Vec<StageErrors>,
    /// What the best leaves, pose by pose, in the order of the rows.
    pub residuals: Vec<PoseError>,
    /// The rows among them that figures may draw, ascending: all in which the target has a place,
    /// or evenly many of these with the largest residuals among them.
    pub shown: Vec<usize>,
    /// How many rows each of `shown` stands for.
    pub stand_for: Vec<f64>,
    /// Joints that take a command.
    pub commands: Vec<Command>,
    /// What the change of each parameter, and each effect, does to the predicted positions, the
    /// largest first.
    pub contributions: Vec<Contribution>,
    /// What of the workspace was measured.
    pub coverage: Coverage,
    /// The best arm in the poses of `shown`; none where a pose has no equilibrium.
    pub arms: Vec<Option<CentreLine>>,
    /// Whether `time` of the residuals was measured.
    pub time_measured: bool,
    /// Tests of what it leaves of the fitted poses.
    pub findings: Findings,
    /// What was passed over in the measurement files.
    pub warnings: Vec<Warning>,
    /// Correlations of its parameters, as estimate.json has them.
    pub correlations: Correlations,
    /// The residual against the cause of each found effect, in the order in which they were found.
    pub causes: Vec<Cause>,
    /// The residual against what structure without a cause depends on.
    pub trend: Option<Cause>,
}

impl PlotData {
    /// Of one identification.
    ///
    /// # Errors
    /// Problem and data do not fit each other.
    pub fn of_identification(
        problem: &Problem,
        data: &Dataset,
        found: &Identification,
    ) -> Result<Self, IdentifyError> {
        let poses = Poses::new(data);
        let fitted = poses.arm(problem, found)?;
        let stages = vec![registered(&poses, &fitted, found), identified(&poses, &fitted, found)];
        Ok(Self::of(problem, &poses, stages, (&fitted, found), examine(problem, data, found)?))
    }

    /// Of a comparison: of its joint fit, beside what the paper calls before and ignoring
    /// elasticity.
    ///
    /// # Errors
    /// Problem and data do not fit each other.
    pub fn of_comparison(
        problem: &Problem,
        data: &Dataset,
        comparison: &Comparison,
    ) -> Result<Self, IdentifyError> {
        let (poses, joint) = (Poses::new(data), &comparison.joint);
        let fitted = poses.arm(problem, joint)?;
        let stages = comparison.procedures.first().map(|own| own_stages(&comparison.before, own));
        let stages = stages.unwrap_or_default();
        Ok(Self::of(problem, &poses, stages, (&fitted, joint), examine(problem, data, joint)?))
    }

    /// Of a closed loop, with the cause of every effect that it found.
    ///
    /// # Errors
    /// Problem and data do not fit each other.
    pub fn of_loop(
        problem: &Problem,
        data: &Dataset,
        closure: &ClosedLoop,
    ) -> Result<Self, IdentifyError> {
        let (poses, fit) = (Poses::new(data), &closure.before.fit);
        // Loops fit positions alone.
        let (before, after) = (
            poses.arm(&problem.positions_alone(), fit)?,
            poses.arm(&closure.closed, &closure.after)?,
        );
        let stages = vec![
            registered(&poses, &before, fit),
            identified(&poses, &before, fit),
            stage(&poses, Stage::Closed, &after),
        ];
        let left = poses.errors(&after, &poses.rows());
        let coordinates = if closure.effects.is_empty() {
            Vec::new()
        } else {
            cause::coordinates(&closure.closed)
        };
        let closed =
            Closed { arm: &after, left: &left, levers: &poses.levers(&after, &coordinates) };
        let cause = |found: &Found| cause::of(&found.effect, &closure.closed, closed, &poses);
        let causes: Vec<Option<Cause>> = closure.effects.par_iter().map(cause).collect();
        Ok(Self {
            causes: causes.into_iter().flatten().collect(),
            trend: closure
                .unexplained
                .iter()
                .find_map(|left| cause::unexplained(left, &closure.closed, poses.split)),
            ..Self::of(
                &closure.closed,
                &poses,
                stages,
                (&after, &closure.after),
                closure.findings.clone(),
            )
        })
    }

    fn of(
        problem: &Problem,
        poses: &Poses,
        stages: Vec<StageErrors>,
        (best, found): (&Arm, &Identification),
        findings: Findings,
    ) -> Self {
        let measurements = poses.measurements;
        let rows = poses.rows();
        let before = poses.errors(&untouched(best, found), &rows);
        let names: Vec<_> = measurements.files.iter().map(|file| file.file_name()).collect();
        let distinct =
            names.iter().enumerate().all(|(k, name)| name.is_some() && !names[..k].contains(name));
        let place = |row: usize| {
            let whole = measurements.location(row);
            let name = whole.file.file_name().filter(|_| distinct).map(PathBuf::from);
            Location { file: name.unwrap_or_else(|| whole.file.clone()), ..whole }.to_string()
        };
        let all = poses.all(found.sigma);
        let places = Poses::places(best, &all);
        let bases = best.model.base_frames(best.x.as_slice());
        // What is missing to a point is told along the axes of the arm's base.
        let turned = |pose: &Pose, error: Vector3<f64>| match bases.get(pose.base) {
            Some(base) if pose.observation.is_point() => base.point(&error) - base.origin,
            _ => error,
        };
        let residual =
            |((row, pose), (error, before)): ((usize, Pose), (Vector3<f64>, Vector3<f64>))| {
                PoseError {
                    place: place(row),
                    configuration: pose.setup.configuration.to_vec(),
                    held_out: poses.split.held_out.binary_search(&row).is_ok(),
                    observation: pose.observation,
                    position: places[row],
                    error: turned(&pose, error),
                    before: turned(&pose, before),
                    sigma: pose.sigma,
                    time: if measurements.time_measured {
                        pose.setup.time
                    } else {
                        (row + 1) as f64
                    },
                }
            };
        let errors = poses.errors(best, &rows).into_iter().zip(before);
        let residuals: Vec<PoseError> =
            all.iter().copied().enumerate().zip(errors).map(residual).collect();
        // The few of one kind are not crowded out by the many of the other.
        let placed = rows.iter().filter(|&&row| residuals[row].has_place());
        let (held_out, fitted): (Vec<usize>, Vec<usize>) =
            placed.partition(|&&row| residuals[row].held_out);
        let few = held_out.len().min(fitted.len()).min(MOST / 2);
        let room = |kind: &[usize]| if kind.len() <= few { few } else { MOST - few };
        let size = |row: usize| residuals[row].error.norm();
        let mut drawn =
            [weighted(&fitted, room(&fitted), size), weighted(&held_out, room(&held_out), size)]
                .concat();
        drawn.sort_unstable_by_key(|own| own.0);
        let (shown, stand_for): (Vec<usize>, Vec<f64>) = drawn.into_iter().unzip();
        let drawn: Vec<Pose> = shown.iter().map(|&row| all[row]).collect();
        Self {
            stages,
            arms: best.model.centre_lines(&drawn, best.x.as_slice()),
            contributions: contribution::of(problem, poses, best, (found, &shown)),
            commands: commands(problem),
            coverage: coverage::of(problem, poses, best),
            shown,
            stand_for,
            residuals,
            time_measured: measurements.time_measured,
            findings,
            warnings: measurements.warnings.clone(),
            correlations: found.correlations(),
            causes: Vec::new(),
            trend: None,
        }
    }

    /// How many rows could be drawn.
    pub fn placed(&self) -> usize {
        self.residuals.iter().filter(|own| own.has_place()).count()
    }

    /// Whether a row measures a position, along the axes of the measuring frame.
    pub fn is_position(&self, row: usize) -> bool {
        self.residuals[row].observation.is_position()
    }

    /// Whether any row does.
    pub fn has_positions(&self) -> bool {
        self.residuals.iter().any(|own| own.observation.is_position())
    }

    /// Rows of held-out poses, in the order of the errors of `stages`.
    pub fn held_out(&self) -> Vec<usize> {
        (0..self.residuals.len()).filter(|&row| self.residuals[row].held_out).collect()
    }

    /// Length of what the best arm leaves of a row \[m\].
    pub fn size(&self, row: usize) -> f64 {
        self.residuals[row].error.norm()
    }
}

/// The arm with nothing but base and target fitted.
fn untouched(best: &Arm, found: &Identification) -> Arm {
    Arm { model: best.model.clone(), x: found.registered_x.clone() }
}

/// Errors before and after a procedure, and with elasticity ignored: figure 13 of the paper.
pub(super) fn own_stages(before: &Before, own: &Procedure) -> Vec<StageErrors> {
    let of = |stage, errors: &Vec<Vector3<f64>>| StageErrors { stage, errors: errors.clone() };
    let mut stages = vec![of(Stage::Before, &before.errors)];
    stages.extend(own.ignoring.iter().map(|errors| of(Stage::Ignoring, errors)));
    stages.push(of(
        if own.ignoring.is_some() { Stage::Elastic } else { Stage::Identified },
        &own.after,
    ));
    stages
}

fn stage(poses: &Poses, stage: Stage, arm: &Arm) -> StageErrors {
    StageErrors { stage, errors: poses.errors(arm, &poses.split.held_out) }
}

fn registered(poses: &Poses, fitted: &Arm, found: &Identification) -> StageErrors {
    stage(poses, Stage::Registered, &untouched(fitted, found))
}

fn identified(poses: &Poses, fitted: &Arm, found: &Identification) -> StageErrors {
    let elastic = is_elastic(&fitted.model) && found.strategy != Strategy::GeometryOnly;
    stage(poses, if elastic { Stage::Elastic } else { Stage::Identified }, fitted)
}

/// Whether stiffnesses or rigidities are free.
fn is_elastic(model: &Model) -> bool {
    model.parameters.iter().any(|parameter| parameter.site.is_elastic())
}
