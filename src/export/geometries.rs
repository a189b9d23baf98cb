//! Rigid geometries that may replace a whole model, and their errors on the rows that judge them.

use nalgebra::DVector;

use super::error::ExportError;
use super::rigid::{RigidFit, best_rigid, rigid_errors};
use crate::design::Workspace;
use crate::fit::{self, ErrorSummary, Options, Placement, SavedEstimate, Strategy};
use crate::measurement::{Dataset, Split};
use crate::mechanics::Arm;
use crate::model::Model;
use crate::problem::{Constraint, Fixture, Joint, ParameterRule, Problem};
use crate::remainder::Correction;

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

    /// Returns true if the rows of `data` that judge it show the errors of this geometry. Only
    /// positions show those of an approximation of the whole model.
    #[doc(hidden)]
    pub fn can_be_judged(&self, data: &Dataset) -> bool {
        let rows = &data.measurements;
        self.best_rigid.is_none() || (0..rows.len()).all(|row| rows.observation(row).is_position())
    }

    /// Computes errors of three geometries: this one, the approximation of the whole model, and the
    /// fit of a rigid model. They are errors on the held-out rows, or on the fitted rows if none is
    /// held out. The first is `None` if this is the identified geometry. The others are `None` if
    /// they are this one or cannot be computed. They are also `None` if the whole model is rigid
    /// without effects, or if one of the rows measures no position.
    ///
    /// # Errors
    /// Returns an error if the estimate does not match the data.
    pub fn errors(
        &self,
        problem: &Problem,
        (estimate, correction): (&SavedEstimate, Option<&Correction>),
        data: &Dataset,
    ) -> Result<[Option<ErrorSummary>; 3], ExportError> {
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
        let alone = self.fitted_alone.as_ref().map(of_fit);
        if !poses.iter().all(|pose| pose.observation.is_position()) {
            return Ok([alone, None, None]);
        }
        let of_arm = |best: &RigidFit| {
            let rigid = rigid_errors(problem, (&model, &x), &best.arm, &poses);
            ErrorSummary::of_rows(&data.measurements, rows.iter().copied(), &rigid)
        };
        let exported = self.best_rigid.as_ref().map(of_arm).or(alone);
        let is_elastic = |joint: &Joint| joint.stiffness.is_some() || joint.beam.is_some();
        if problem.effects.is_empty() && !problem.joints.iter().any(is_elastic) {
            return Ok([exported, None, None]);
        }
        // The alternatives are only shown for comparison, so a failure is no error.
        let best = self.best_rigid.is_none().then(|| {
            let workspace = Workspace { corners: None, planes: Vec::new() };
            best_rigid(problem, estimate, correction, (&workspace, self.has_room)).ok()
        });
        let alone = self.fitted_alone.is_none().then(|| fit_alone(problem, data).ok());
        Ok([
            exported,
            best.flatten().as_ref().map(of_arm),
            alone.flatten().as_ref().map(|(_, alone)| of_fit(alone)),
        ])
    }
}

/// Fits a rigid model without effects; returns its problem and the fit.
fn fit_alone(
    problem: &Problem,
    data: &Dataset,
) -> Result<(Problem, fit::Identification), ExportError> {
    let mut rigid = Problem { effects: Vec::new(), ..problem.clone() };
    // Rules and constraints of effects alone would match nothing now, which is an error.
    let placement = Placement::of(&data.measurements);
    let matches_some = |rule: &ParameterRule| {
        let parameters = vec![rule.clone()];
        let constraints = Vec::new();
        let alone = Problem { parameters, constraints, ..rigid.clone() };
        Model::new(&alone, &placement.bases, &placement.targets).is_ok()
    };
    let kept = rigid.parameters.iter().filter(|rule| matches_some(rule)).cloned().collect();
    rigid.parameters = kept;
    let holds_without = |constraint: &Constraint| {
        let alone = Problem { constraints: vec![constraint.clone()], ..rigid.clone() };
        Model::new(&alone, &placement.bases, &placement.targets).is_ok()
    };
    let kept =
        rigid.constraints.iter().filter(|constraint| holds_without(constraint)).cloned().collect();
    rigid.constraints = kept;
    let options = Options::default().with_strategy(Strategy::Rigid);
    let found = fit::identify(&rigid, data, &options)?;
    Ok((rigid, found))
}
