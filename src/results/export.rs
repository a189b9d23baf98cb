//! Result of the command `export`: moved origins, errors, and the parts of the model that the
//! exported file cannot represent.

use std::path::Path;

use nalgebra::{DVector, Vector3};
use schemars::JsonSchema;
use serde::Serialize;

use super::summary::Summary;
use crate::fit::{ErrorSummary, Placement, SavedEstimate};
use crate::measurement::Dataset;
use crate::model::Model;
use crate::model::parameter::{Parameter, ParameterSite};
use crate::problem::Problem;
use crate::urdf::MovedOrigin;

/// Exported file with the identified geometry, and what it leaves out.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ExportResult {
    pub problem: String,
    pub file: Option<String>,
    /// Joint origins of a URDF that moved; null for other files.
    pub origins: Option<Vec<Origin>>,
    pub held_out: Option<ExportedErrors>,
    /// Errors on the fitted rows; absent if rows are held out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fitted: Option<ExportedErrors>,
    /// Parts of the model that the file cannot represent.
    pub not_held: Vec<String>,
}

/// New origin of a joint in a URDF, and its motion from the nominal origin.
#[derive(Debug, Serialize, JsonSchema)]
pub struct Origin {
    pub joint: String,
    pub xyz_m: [f64; 3],
    pub rpy_rad: [f64; 3],
    pub moved_mm: f64,
    pub turned_deg: f64,
}

/// Errors of the whole model, and of rigid geometries without its other parts.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ExportedErrors {
    /// False if no row is held out, so that the errors are those of the fitted rows.
    #[serde(skip)]
    pub are_held_out: bool,
    pub whole: Summary,
    /// Errors of the exported geometry alone.
    pub rigid: Summary,
    /// Errors of the identified geometry without the other parts of the model, unless it was
    /// exported.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub identified: Option<Summary>,
    /// Errors of the geometry of `--best-rigid`, unless it was exported.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub best_rigid: Option<Summary>,
    /// Errors of a geometry fitted to the same rows by a rigid model without effects, unless it was
    /// exported.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fitted_alone: Option<Summary>,
    /// Errors of the nominal arm, with base and tool, or cameras and markers, fitted to it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nominal: Option<Summary>,
}

impl ExportResult {
    /// Collects the result of an export. `file` is the path of the file, if one was written, `moved`
    /// are the moved origins of a URDF, and `errors` are those on held-out or fitted rows.
    pub fn new(
        problem: &Problem,
        model: &Model,
        file: Option<&Path>,
        moved: Option<&[MovedOrigin]>,
        errors: Option<ExportedErrors>,
    ) -> Self {
        let origin = |origin: &MovedOrigin| Origin {
            joint: origin.joint.clone(),
            xyz_m: origin.xyz.into(),
            rpy_rad: origin.rpy.into(),
            moved_mm: origin.distance * 1e3,
            turned_deg: origin.angle.to_degrees(),
        };
        let (held_out, fitted) = match errors {
            Some(errors) if !errors.are_held_out => (None, Some(errors)),
            errors => (errors, None),
        };
        Self {
            problem: problem.name.clone(),
            file: file.map(|file| file.display().to_string()),
            origins: moved.map(|moved| moved.iter().map(origin).collect()),
            held_out,
            fitted,
            not_held: unexported_parts(problem, model)
                .into_iter()
                .chain(unseen_ends(problem).filter(|_| moved.is_some()))
                .collect(),
        }
    }

    /// Returns the errors on the held-out rows, or on the fitted rows if none is held out; `None`
    /// without measurements.
    pub fn errors(&self) -> Option<&ExportedErrors> {
        self.held_out.as_ref().or(self.fitted.as_ref())
    }
}

impl ExportedErrors {
    /// Computes the errors of the held-out rows of the leading kind in `data` (positions, if there
    /// are any), or of the fitted rows if none is held out. `x` is the model's full parameter
    /// vector; `saved` is the estimate from which it was read, if any.
    pub fn new(
        model: &Model,
        x: &DVector<f64>,
        data: &Dataset,
        saved: Option<&SavedEstimate>,
    ) -> Self {
        let Dataset { measurements, split } = data;
        let placement = Placement::of(measurements);
        let are_held_out = !split.held_out.is_empty();
        let rows = if are_held_out { &split.held_out } else { &split.identification };
        let mut poses = placement.poses(measurements, rows, 1.0);
        if let Some(saved) = saved {
            saved.count_time_in(&placement, &mut poses);
        }
        let rigid = model.geometric_residuals(&poses, x.as_slice());
        let whole = model.residuals(poses, x);
        let of = |errors: &[Vector3<f64>]| {
            Summary::of(&ErrorSummary::of_rows(measurements, rows.iter().copied(), errors))
        };
        let (whole, rigid) = (of(&whole), of(&rigid));
        let [identified, best_rigid, fitted_alone, nominal] = [None; 4];
        Self { are_held_out, whole, rigid, identified, best_rigid, fitted_alone, nominal }
    }

    /// Adds the errors of the exported geometry, if it is not the identified one, of the geometry
    /// of `--best-rigid`, of a geometry fitted alone, of the identified one with what was fitted to
    /// it, and of the nominal arm.
    #[must_use]
    pub fn with_geometries(
        mut self,
        [exported, best_rigid, fitted_alone, identified, nominal]: [Option<ErrorSummary>; 5],
    ) -> Self {
        if let Some(identified) = identified {
            self.rigid = Summary::of(&identified);
        }
        if let Some(exported) = exported {
            self.identified = Some(std::mem::replace(&mut self.rigid, Summary::of(&exported)));
        }
        self.best_rigid = best_rigid.as_ref().map(Summary::of);
        self.fitted_alone = fitted_alone.as_ref().map(Summary::of);
        self.nominal = nominal.as_ref().map(Summary::of);
        self
    }
}

/// Lists the parts of the model other than the geometry of the chain.
fn unexported_parts(problem: &Problem, model: &Model) -> Vec<String> {
    let mut parts: Vec<String> = Vec::new();
    for (number, joint) in (1..).zip(&problem.joints) {
        if joint.stiffness.is_some() {
            parts.push(format!("joint{number}.stiffness"));
        }
        if let Some(beam) = &joint.beam {
            parts.push(format!("elastic link {}", beam.name));
        }
    }
    parts.extend(problem.effects.iter().map(|declared| declared.effect.declaration()));
    let set_up = |parameter: &&Parameter| {
        matches!(parameter.site, ParameterSite::Base { .. } | ParameterSite::Target { .. })
    };
    let set_up: Vec<&str> =
        model.parameters.iter().filter(set_up).map(|parameter| parameter.name.as_str()).collect();
    if !set_up.is_empty() {
        parts.push(format!("base and target of the set-up ({})", set_up.join(", ")));
    }
    let cameras = problem.fixtures.iter().filter(|fixture| fixture.kind.word() == "camera");
    parts.extend(cameras.map(|camera| format!("lens of camera {}", camera.name)));
    let in_world =
        problem.fixtures.iter().filter(|known| known.kind.has_pose() && known.carrier.is_none());
    parts.extend(
        in_world.map(|known| format!("place of {} {} in the world", known.kind.word(), known.name)),
    );
    parts
}

/// Returns what a URDF cannot hold after a fit to pixels alone: the true place of base and tip;
/// `None` if positions were measured.
fn unseen_ends(problem: &Problem) -> Option<String> {
    let has_camera = problem.fixtures.iter().any(|fixture| fixture.kind.word() == "camera");
    (has_camera && problem.data.position_sigma.is_none()).then(|| {
        "true place of the base and of the tip: views cannot tell the parameters that the problem holds, which stay \
         nominal; cameras and markers on the arm follow the file"
            .to_owned()
    })
}
