//! Result of the command `export`: moved origins, errors, and the parts of the model that the
//! exported file cannot represent.

use std::path::Path;

use nalgebra::{DVector, Vector3};
use schemars::JsonSchema;
use serde::Serialize;

use super::document::Document;
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
    /// Parts of the model that the file cannot represent.
    pub not_held: Vec<String>,
}

impl Document for ExportResult {
    const FORMAT: &'static str = "flexcal-export";
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

/// Held-out errors of the whole model, and of rigid geometries without its other parts.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ExportedErrors {
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
}

impl ExportResult {
    /// Collects the result of an export. `file` is the path of the file, if one was written, and
    /// `moved` are the moved origins of a URDF.
    pub fn new(
        problem: &Problem,
        model: &Model,
        file: Option<&Path>,
        moved: Option<&[MovedOrigin]>,
        held_out: Option<ExportedErrors>,
    ) -> Self {
        let origin = |origin: &MovedOrigin| Origin {
            joint: origin.joint.clone(),
            xyz_m: origin.xyz.into(),
            rpy_rad: origin.rpy.into(),
            moved_mm: origin.distance * 1e3,
            turned_deg: origin.angle.to_degrees(),
        };
        Self {
            problem: problem.name.clone(),
            file: file.map(|file| file.display().to_string()),
            origins: moved.map(|moved| moved.iter().map(origin).collect()),
            held_out,
            not_held: unexported_parts(problem, model),
        }
    }
}

impl ExportedErrors {
    /// Computes the errors of the held-out rows of the leading kind in `data` (positions, if there
    /// are any). `x` is the model's full parameter vector; `saved` is the estimate from which it
    /// was read, if any.
    pub fn new(
        model: &Model,
        x: &DVector<f64>,
        data: &Dataset,
        saved: Option<&SavedEstimate>,
    ) -> Self {
        let Dataset { measurements, split } = data;
        let placement = Placement::of(measurements);
        let mut poses = placement.poses(measurements, &split.held_out, 1.0);
        if let Some(saved) = saved {
            saved.count_time_in(&placement, &mut poses);
        }
        let rigid = model.geometric_residuals(&poses, x.as_slice());
        let whole = model.residuals(poses, x);
        let of = |errors: &[Vector3<f64>]| {
            let rows = split.held_out.iter().copied();
            Summary::of(&ErrorSummary::of_rows(measurements, rows, errors))
        };
        let (whole, rigid) = (of(&whole), of(&rigid));
        Self { whole, rigid, identified: None, best_rigid: None, fitted_alone: None }
    }

    /// Adds the errors of the exported geometry, if it is not the identified one, of the geometry
    /// of `--best-rigid`, and of a geometry fitted alone.
    #[must_use]
    pub fn with_geometries(
        mut self,
        [exported, best_rigid, fitted_alone]: [Option<ErrorSummary>; 3],
    ) -> Self {
        if let Some(exported) = exported {
            self.identified = Some(std::mem::replace(&mut self.rigid, Summary::of(&exported)));
        }
        self.best_rigid = best_rigid.as_ref().map(Summary::of);
        self.fitted_alone = fitted_alone.as_ref().map(Summary::of);
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
    parts
}
