//! Data of all figures of a report, collected from an identification, a comparison or a loop.

use std::path::PathBuf;

use nalgebra::Vector3;

use super::arm::{Arm, Poses};
use super::cause::{self, Cause, EffectFit};
use super::contribution::{self, Contribution};
use super::coverage::{self, Coverage};
use super::pose::{PoseError, weighted_sample};
use super::uncertainty::Uncertainty;
use crate::error::{Location, Warning};
use crate::fit::{
    Comparison, Correlations, ErrorsBefore, Identification, IdentifyError, Procedure,
};
use crate::measurement::Dataset;
use crate::model::{CentreLine, Pose};
use crate::numeric::parallel;
use crate::problem::Problem;
use crate::remainder::Fitted;
use crate::residual_tests::ResidualTests;
use crate::results::tables::{CommandedJoint, commanded_joints};
use crate::select::{ClosedLoop, examine};

/// Maximum number of poses that a report page contains individually.
const MAX_SHOWN_POSES: usize = 600;

/// Stage of the calibration of an arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Stage {
    /// Nominal arm, with base and target fitted if these are free.
    Registered,
    /// Nominal rigid arm, with base and target fitted if these are free; \[Chen2021\] calls it
    /// before calibration.
    Before,
    /// Arm with identified geometry, identified with elasticity ignored.
    Ignoring,
    /// Arm with identified geometry and elasticity.
    Elastic,
    /// Identified arm, if the report does not distinguish elasticity.
    Identified,
    /// Arm of the declared problem, identified before the loop adds effects.
    Declared,
    /// Arm identified with the effects that the loop found.
    Closed,
    /// Arm of the last fit, whose predictions a remainder corrects.
    Corrected,
}

/// Errors of the arm at one stage.
#[derive(Debug, Clone, PartialEq)]
pub struct StageErrors {
    /// Stage of the calibration.
    pub stage: Stage,
    /// Errors measured − predicted of the held-out rows, measuring frame: positions \[m\], tilts
    /// \[rad\], images [px].
    pub errors: Vec<Vector3<f64>>,
}

/// Data of all figures of one report, with the residual tests.
#[derive(Debug, Clone)]
pub struct PlotData {
    /// Errors at each stage, from nominal to best.
    #[doc(hidden)]
    pub stages: Vec<StageErrors>,
    /// Residual of each row, with the arm of the last stage (the best arm).
    #[doc(hidden)]
    pub residuals: Vec<PoseError>,
    /// Rows that figures may draw, in ascending order: the rows whose residual is a length. If
    /// there are too many, a sample of them that includes the largest residuals.
    pub shown: Vec<usize>,
    /// Number of rows that each row of `shown` represents: its weight in the sample.
    pub stand_for: Vec<f64>,
    /// Joints that take a command.
    pub commands: Vec<CommandedJoint>,
    /// Contribution of each parameter and effect to the predicted positions, in descending order.
    #[doc(hidden)]
    pub contributions: Vec<Contribution>,
    /// Coverage of the workspace by fitted poses.
    pub(crate) coverage: Coverage,
    /// Centre line of the best arm in the pose of each row of `shown`; `None` for a pose without
    /// equilibrium.
    #[doc(hidden)]
    pub arms: Vec<Option<CentreLine>>,
    /// True if the `time` of the residuals was measured.
    pub time_measured: bool,
    /// Tests of the best arm's residual in the fitted poses.
    #[doc(hidden)]
    pub residual_tests: ResidualTests,
    /// Warnings on ignored contents of the measurement files.
    pub warnings: Vec<Warning>,
    /// Correlations of the parameters, as in estimate.json.
    pub correlations: Correlations,
    /// Partial residuals of each effect found, in the order of discovery.
    #[doc(hidden)]
    pub causes: Vec<Cause>,
    /// Partial residuals of structure without a known cause; `None` if there is no such structure,
    /// or if it depends on several quantities.
    pub(crate) trend: Option<Cause>,
    /// Error bounds over the workspace, and the joint errors that a remainder corrects; `None` if
    /// they were not computed.
    pub(crate) uncertainty: Option<Uncertainty>,
}

impl PlotData {
    /// Collects the data of one identification.
    ///
    /// # Errors
    /// Returns an error if problem and data do not match.
    pub fn of_identification(
        problem: &Problem,
        data: &Dataset,
        identification: &Identification,
    ) -> Result<Self, IdentifyError> {
        let poses = Poses::new(data);
        let fitted = poses.arm(problem, identification)?;
        let stages = vec![
            registered_errors(&poses, &fitted, identification),
            stage_errors(&poses, Stage::Identified, &fitted),
        ];
        let residual_tests = examine(problem, data, identification)?;
        Ok(Self::new(problem, &poses, stages, (&fitted, identification), residual_tests))
    }

    /// Collects the data of a comparison: its joint fit, and the stages that the paper calls
    /// "before" and "ignoring elasticity".
    ///
    /// # Errors
    /// Returns an error if problem and data do not match.
    #[doc(hidden)]
    pub fn of_comparison(
        problem: &Problem,
        data: &Dataset,
        comparison: &Comparison,
    ) -> Result<Self, IdentifyError> {
        let (poses, joint) = (Poses::new(data), &comparison.joint);
        let fitted = poses.arm(problem, joint)?;
        let procedure = comparison.procedures.first();
        let stages = procedure.map(|procedure| procedure_stages(&comparison.before, procedure));
        let stages = stages.unwrap_or_default();
        Ok(Self::new(problem, &poses, stages, (&fitted, joint), examine(problem, data, joint)?))
    }

    /// Collects the data of a finished loop, with the partial residuals of every effect found.
    ///
    /// # Errors
    /// Returns an error if problem and data do not match.
    pub fn of_loop(
        problem: &Problem,
        data: &Dataset,
        closure: &ClosedLoop,
    ) -> Result<Self, IdentifyError> {
        let (poses, fit) = (Poses::new(data), &closure.before.fit);
        // A loop fits no orientations.
        let (before, after) = (
            poses.arm(&problem.positions_alone(), fit)?,
            poses.arm(&closure.closed, &closure.after)?,
        );
        let mut stages = vec![
            registered_errors(&poses, &before, fit),
            stage_errors(&poses, Stage::Declared, &before),
        ];
        if !closure.effects.is_empty() {
            stages.push(stage_errors(&poses, Stage::Closed, &after));
        }
        let residuals = poses.errors(&after, &poses.row_indices());
        let coordinates = if closure.effects.is_empty() {
            Vec::new()
        } else {
            cause::coordinates(&closure.closed)
        };
        let levers = poses.levers(&after, &coordinates);
        let fit = EffectFit { arm: &after, residuals: &residuals, levers: &levers };
        let cause = |k: usize| {
            let cause = cause::of(&closure.effects[k].effect, &closure.closed, fit, &poses)?;
            Some(Cause { found: Some(k), ..cause })
        };
        let causes = parallel::map(closure.effects.len(), cause);
        Ok(Self {
            causes: causes.into_iter().flatten().collect(),
            trend: closure
                .unexplained
                .iter()
                .find_map(|structure| cause::unexplained(structure, &closure.closed, poses.split)),
            ..Self::new(
                &closure.closed,
                &poses,
                stages,
                (&after, &closure.after),
                closure.residual_tests.clone(),
            )
        })
    }

    /// Collects the data that all kinds of reports share; `best` is the arm of the last stage.
    fn new(
        problem: &Problem,
        poses: &Poses,
        stages: Vec<StageErrors>,
        (best, identification): (&Arm, &Identification),
        residual_tests: ResidualTests,
    ) -> Self {
        let measurements = poses.measurements;
        let rows = poses.row_indices();
        let before = poses.errors(&nominal_arm(best, identification), &rows);
        let names: Vec<_> = measurements.files.iter().map(|file| file.file_name()).collect();
        let are_distinct =
            names.iter().enumerate().all(|(k, name)| name.is_some() && !names[..k].contains(name));
        let location_text = |row: usize| {
            let location = measurements.location(row);
            let name = location.file.file_name().filter(|_| are_distinct).map(PathBuf::from);
            Location { file: name.unwrap_or_else(|| location.file.clone()), ..location }.to_string()
        };
        let all_poses = poses.all(identification.sigma);
        let positions = Poses::positions(best, &all_poses);
        let bases = best.model.base_frames(best.x.as_slice());
        // The residual of a touched point is along the axes of the arm's base.
        let in_measuring_frame = |pose: &Pose, error: Vector3<f64>| match bases.get(pose.base) {
            Some(base) if pose.observation.is_point() => base.point(&error) - base.origin,
            _ => error,
        };
        let residual =
            |((row, pose), (error, before)): ((usize, Pose), (Vector3<f64>, Vector3<f64>))| {
                PoseError {
                    place: location_text(row),
                    configuration: pose.setup.configuration.to_vec(),
                    held_out: poses.split.held_out.binary_search(&row).is_ok(),
                    observation: pose.observation,
                    position: positions[row],
                    error: in_measuring_frame(&pose, error),
                    before: in_measuring_frame(&pose, before),
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
            all_poses.iter().copied().enumerate().zip(errors).map(residual).collect();
        // Fitted and held-out poses share the sample, so that neither crowds out the other.
        let placed = rows.iter().filter(|&&row| residuals[row].has_place());
        let (held_out, fitted): (Vec<usize>, Vec<usize>) =
            placed.partition(|&&row| residuals[row].held_out);
        let smaller = held_out.len().min(fitted.len()).min(MAX_SHOWN_POSES / 2);
        let room = |kind: &[usize]| {
            if kind.len() <= smaller { smaller } else { MAX_SHOWN_POSES - smaller }
        };
        let size = |row: usize| residuals[row].error.norm();
        let mut drawn = [
            weighted_sample(&fitted, room(&fitted), size),
            weighted_sample(&held_out, room(&held_out), size),
        ]
        .concat();
        drawn.sort_unstable_by_key(|(row, _)| *row);
        let (shown, stand_for): (Vec<usize>, Vec<f64>) = drawn.into_iter().unzip();
        let drawn: Vec<Pose> = shown.iter().map(|&row| all_poses[row]).collect();
        Self {
            stages,
            arms: best.model.centre_lines(&drawn, best.x.as_slice()),
            contributions: contribution::of(problem, poses, best, (identification, &shown)),
            commands: commanded_joints(problem),
            coverage: coverage::of(problem, poses, best),
            shown,
            stand_for,
            residuals,
            time_measured: measurements.time_measured,
            residual_tests,
            warnings: measurements.warnings.clone(),
            correlations: identification.correlations(),
            causes: Vec::new(),
            trend: None,
            uncertainty: None,
        }
    }

    /// Adds the error bounds of predictions over the workspace, and with a remainder the joint errors
    /// that it corrects and the held-out errors with it.
    ///
    /// # Errors
    /// Returns an error if problem and data do not match.
    #[doc(hidden)]
    pub fn with_uncertainty(
        self,
        (identification, problem): (&Identification, &Problem),
        data: &Dataset,
        fitted: &Fitted,
    ) -> Result<Self, IdentifyError> {
        let uncertainty = Uncertainty::of((identification, problem), data, fitted)?;
        let corrected = fitted.residuals.as_ref().map(|corrected| StageErrors {
            stage: Stage::Corrected,
            errors: self.held_out().iter().map(|&row| corrected.rows[row].position).collect(),
        });
        let stages = self.stages.iter().cloned().chain(corrected).collect();
        Ok(Self { uncertainty: Some(uncertainty), stages, ..self })
    }

    /// Returns the number of rows whose residual is a length.
    pub(crate) fn length_count(&self) -> usize {
        self.residuals.iter().filter(|residual| residual.has_place()).count()
    }

    /// Returns true if a row measures a position. Its residual is along the axes of the measuring
    /// frame.
    pub(crate) fn is_position(&self, row: usize) -> bool {
        self.residuals[row].observation.is_position()
    }

    /// Returns true if any row measures a position.
    pub(crate) fn has_positions(&self) -> bool {
        self.residuals.iter().any(|residual| residual.observation.is_position())
    }

    /// Returns the indices of the held-out rows, in the order of the errors of `stages`.
    pub(crate) fn held_out(&self) -> Vec<usize> {
        (0..self.residuals.len()).filter(|&row| self.residuals[row].held_out).collect()
    }

    /// Returns the length of the residual of the best arm in a row \[m\].
    pub(crate) fn residual_length(&self, row: usize) -> f64 {
        self.residuals[row].error.norm()
    }
}

/// Returns the registered nominal arm: nominal parameters, with base and target fitted if they are
/// free.
fn nominal_arm(best: &Arm, identification: &Identification) -> Arm {
    Arm { model: best.model.clone(), x: identification.registered_x.clone() }
}

/// Returns the held-out errors before and after a procedure, and those with elasticity ignored if
/// the procedure has them [Chen2021, fig. 13].
pub(crate) fn procedure_stages(before: &ErrorsBefore, procedure: &Procedure) -> Vec<StageErrors> {
    let of = |stage, errors: &Vec<Vector3<f64>>| StageErrors { stage, errors: errors.clone() };
    let mut stages = vec![of(Stage::Before, &before.errors)];
    stages.extend(procedure.ignoring.iter().map(|errors| of(Stage::Ignoring, errors)));
    let last = if procedure.ignoring.is_some() { Stage::Elastic } else { Stage::Identified };
    stages.push(of(last, &procedure.after));
    stages
}

/// Returns the held-out errors of `arm`, as those of one stage.
fn stage_errors(poses: &Poses, stage: Stage, arm: &Arm) -> StageErrors {
    StageErrors { stage, errors: poses.errors(arm, &poses.split.held_out) }
}

/// Returns the held-out errors of the registered nominal arm.
fn registered_errors(poses: &Poses, fitted: &Arm, identification: &Identification) -> StageErrors {
    stage_errors(poses, Stage::Registered, &nominal_arm(fitted, identification))
}
