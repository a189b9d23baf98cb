//! Rigid geometries that may replace a whole model, and their errors on the rows that judge them.

use nalgebra::DVector;

use super::error::ExportError;
use super::rigid::{RigidFit, best_rigid, rigid_errors};
use crate::design::Workspace;
use crate::fit::{self, ErrorSummary, Options, Placement, SavedEstimate, Strategy};
use crate::measurement::{Dataset, Split};
use crate::mechanics::Arm;
use crate::model::Model;
use crate::problem::{Constraint, Fixture, Joint, Observation, ParameterRule, Problem};
use crate::remainder::Correction;

/// Number of coordinates of a pose, with which the numbers of a camera or marker begin.
const POSE_COORDINATES: usize = 6;

/// Choice of the rigid geometry to export.
#[derive(Debug, Clone)]
pub enum GeometryChoice {
    /// Geometry of the identified arm, without the other parts of the model.
    Identified,
    /// Geometry that approximates the whole model best in a workspace.
    BestRigid(Workspace),
    /// Geometry of a rigid model without effects that is fitted to the same rows.
    FittedAlone,
}

/// Rigid geometry to export.
#[derive(Debug, Clone)]
pub struct Geometry {
    /// Arm with this geometry.
    pub arm: Arm<f64>,
    /// Approximation of the whole model, if that was chosen; else `None`.
    pub best_rigid: Option<RigidFit>,
    /// Fit of the rigid model with its bases and tools, if that was chosen; else `None`.
    pub fitted_alone: Option<fit::Identification>,
    /// Rigid model of `fitted_alone`, which has its cameras and markers too.
    pub(crate) rigid_model: Option<Model>,
    /// True if the exported file can hold a transform after the last moving joint.
    has_room: bool,
}

impl Geometry {
    /// Computes the chosen geometry from an estimate with the full parameter vector `x`. `data` are
    /// needed for a geometry fitted alone.
    ///
    /// # Errors
    /// Returns an error if too few poses reach the workspace, or if the rigid fit lacks data or
    /// fails.
    pub fn new(
        problem: &Problem,
        (estimate, correction): (&SavedEstimate, Option<&Correction>),
        (model, x): (&Model, &DVector<f64>),
        data: Option<&Dataset>,
        choice: &GeometryChoice,
    ) -> Result<Self, ExportError> {
        Self::for_file(problem, (estimate, correction), (model, x), data, (choice, true))
    }

    /// Computes the chosen geometry as [`new`](Self::new) does. If `has_room` is false, the file
    /// cannot hold a transform after the last moving joint, and the approximation of the whole model
    /// keeps the identified one.
    ///
    /// # Errors
    /// Returns the errors of [`new`](Self::new).
    #[doc(hidden)]
    pub fn for_file(
        problem: &Problem,
        (estimate, correction): (&SavedEstimate, Option<&Correction>),
        (model, x): (&Model, &DVector<f64>),
        data: Option<&Dataset>,
        (choice, has_room): (&GeometryChoice, bool),
    ) -> Result<Self, ExportError> {
        let arm = |model: &Model, x: &DVector<f64>| model.arm(|k| x.get(k).copied().unwrap_or(0.0));
        match choice {
            GeometryChoice::Identified => Ok(Self::of_arm(arm(model, x), has_room)),
            GeometryChoice::BestRigid(workspace) => {
                let is_mounted = |fixture: &Fixture| fixture.carrier.is_some();
                if !problem.is_chain() && problem.fixtures.iter().any(is_mounted) {
                    return Err(ExportError::MountedOnTree);
                }
                let best = best_rigid(problem, estimate, correction, (workspace, has_room))?;
                let whole = Self::of_arm(best.arm.clone(), has_room);
                Ok(Self { best_rigid: Some(best), ..whole })
            }
            GeometryChoice::FittedAlone => {
                let data = data.ok_or(ExportError::NeedsData)?;
                let (rigid, found) = fit_alone(problem, data)?;
                let placement = Placement::of(&data.measurements);
                let model = Model::new(&rigid, &placement.bases, &placement.targets)?;
                let model = found.strategy.model(model);
                let alone = Self::of_arm(arm(&model, &found.x), has_room);
                Ok(Self { fitted_alone: Some(found), rigid_model: Some(model), ..alone })
            }
        }
    }

    /// Returns the geometry of an arm, which neither approximates nor replaces the whole model.
    const fn of_arm(arm: Arm<f64>, has_room: bool) -> Self {
        Self { arm, best_rigid: None, fitted_alone: None, rigid_model: None, has_room }
    }

    /// Returns the rigid model with its full parameter vector, if it was fitted alone.
    #[doc(hidden)]
    pub fn rigid(&self) -> Option<(&Model, &DVector<f64>)> {
        self.rigid_model.as_ref().zip(self.fitted_alone.as_ref().map(|found| &found.x))
    }

    /// Computes errors of five geometries: this one, the approximation of the whole model, the fit of
    /// a rigid model, the identified one, and the nominal arm. They are errors on the held-out rows,
    /// or on the fitted rows if none is held out.
    ///
    /// The first is `None` if this is the identified geometry, or if the rows do not determine its
    /// bases, cameras and markers. The others are `None` if they are this one, cannot be computed, or
    /// if the whole model is rigid without effects. Bases and tools are those of the whole model where
    /// all rows measure positions. Otherwise, and for the nominal arm, bases, tools, cameras and
    /// markers are fitted to each geometry. The identified one is computed of images alone.
    ///
    /// # Errors
    /// Returns an error if the estimate does not match the data.
    pub fn errors(
        &self,
        problem: &Problem,
        (estimate, correction): (&SavedEstimate, Option<&Correction>),
        data: &Dataset,
    ) -> Result<[Option<ErrorSummary>; 5], ExportError> {
        let placement = Placement::of(&data.measurements);
        let model = estimate.model(Model::new(problem, &placement.bases, &placement.targets)?);
        let x = estimate.vector(problem, &model)?;
        let Split { identification, held_out } = &data.split;
        let rows = if held_out.is_empty() { identification } else { held_out };
        let poses = placement.poses(&data.measurements, rows, 1.0);
        let of_fit = |alone: &fit::Identification| {
            let fit::Errors { identification, held_out, .. } = alone.fitted;
            if data.split.held_out.is_empty() { identification } else { held_out }
        };
        let pixel = Observation::Pixel(0, 0, 0).kind();
        let are_positions = poses.iter().all(|pose| pose.observation.is_position());
        let refit = |arm: &Arm<f64>| refitted(problem, (&model, &x), arm, (data, rows));
        let of_arm = |best: &RigidFit| {
            if !are_positions {
                return refit(&best.arm);
            }
            let rigid = rigid_errors(problem, (&model, &x), &best.arm, &poses);
            Some(ErrorSummary::of_rows(&data.measurements, rows.iter().copied(), &rigid))
        };
        let alone = self.fitted_alone.as_ref().map(of_fit);
        let exported = self.best_rigid.as_ref().and_then(of_arm).or(alone);
        let is_elastic = |joint: &Joint| joint.stiffness.is_some() || joint.beam.is_some();
        if problem.effects.is_empty() && !problem.joints.iter().any(is_elastic) {
            return Ok([exported, None, None, None, None]);
        }
        // The alternatives are only shown for comparison, so a failure is no error.
        let best = self.best_rigid.is_none().then(|| {
            let workspace = Workspace { corners: None, planes: Vec::new() };
            best_rigid(problem, estimate, correction, (&workspace, self.has_room)).ok()
        });
        let alone = self.fitted_alone.is_none().then(|| fit_alone(problem, data).ok());
        let is_of_images = poses.iter().all(|pose| pose.observation.kind() == pixel);
        let identified = is_of_images.then(|| refit(&model.arm(|k| x[k]))).flatten();
        Ok([
            exported,
            best.flatten().as_ref().and_then(of_arm),
            alone.flatten().as_ref().map(|(_, alone)| of_fit(alone)),
            identified,
            refit(&Arm::nominal(problem)),
        ])
    }
}

/// Returns the errors on some `rows` of `data` for a rigid arm without effects, to which bases,
/// tools, cameras and markers are fitted; the search begins with the lenses of `model` at `x`. `None`
/// if the rows do not determine them.
fn refitted(
    problem: &Problem,
    (model, x): (&Model, &DVector<f64>),
    arm: &Arm<f64>,
    (data, rows): (&Dataset, &[usize]),
) -> Option<ErrorSummary> {
    let mut rigid = Problem { effects: Vec::new(), ..problem.clone() };
    for (joint, fitted) in rigid.joints.iter_mut().zip(&arm.joints) {
        (joint.stiffness, joint.beam) = (None, None);
        if joint.placement.is_none() {
            (joint.alpha, joint.a, joint.theta) = (fitted.alpha.value, fitted.a, fitted.theta);
            (joint.d, joint.beta) = (fitted.d, fitted.beta.value);
        }
    }
    for (fixture, fitted) in rigid.fixtures.iter_mut().zip(model.fixtures(x.as_slice())) {
        let lens = fixture.known.iter_mut().zip(fitted.numbers).skip(POSE_COORDINATES);
        lens.filter(|(known, _)| known.is_some()).for_each(|(known, number)| *known = Some(number));
    }
    let rigid = with_its_rules(rigid, data);
    let found = fit::predict(&rigid, None, &data.measurements, Some(&data.split)).ok()?;
    let residuals = found.residuals?;
    let errors: Vec<_> = rows.iter().map(|&row| residuals[row].position).collect();
    let summary = ErrorSummary::of_rows(&data.measurements, rows.iter().copied(), &errors);
    summary.mean.norm.is_finite().then_some(summary)
}

/// Returns the problem without rules and constraints that match nothing in it, which would be
/// errors.
fn with_its_rules(mut rigid: Problem, data: &Dataset) -> Problem {
    let placement = Placement::of(&data.measurements);
    let is_valid =
        |alone: &Problem| Model::new(alone, &placement.bases, &placement.targets).is_ok();
    let (parameters, constraints) =
        (std::mem::take(&mut rigid.parameters), std::mem::take(&mut rigid.constraints));
    let matches_some = |rule: &ParameterRule| {
        is_valid(&Problem { parameters: vec![rule.clone()], ..rigid.clone() })
    };
    let parameters = parameters.into_iter().filter(matches_some).collect();
    rigid = Problem { parameters, ..rigid };
    let holds_without = |constraint: &Constraint| {
        is_valid(&Problem { constraints: vec![constraint.clone()], ..rigid.clone() })
    };
    let constraints = constraints.into_iter().filter(holds_without).collect();
    Problem { constraints, ..rigid }
}

/// Fits a rigid model without effects; returns its problem and the fit.
fn fit_alone(
    problem: &Problem,
    data: &Dataset,
) -> Result<(Problem, fit::Identification), ExportError> {
    let rigid = Problem { effects: Vec::new(), ..problem.clone() };
    let rigid = with_its_rules(rigid, data);
    let options = Options::default().with_strategy(Strategy::Rigid);
    let found = fit::identify(&rigid, data, &options)?;
    Ok((rigid, found))
}
