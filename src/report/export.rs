//! Result and text of `export`: moved origins, errors, and what the file cannot hold.

use std::path::Path;

use nalgebra::{DVector, Vector3};

use super::document::{Block, Table};
use super::errors;
use super::quantity::{mm, number};
use super::render::text;
use crate::fit::{ErrorSummary, Placement, SavedEstimate, rows_of_kind};
use crate::measurement::Dataset;
use crate::model::Model;
use crate::model::parameter::ParameterSite;
use crate::problem::Problem;
use crate::results::{ExportResult, ExportedErrors, Origin, Summary};
use crate::urdf::MovedOrigin;

/// Advice for a geometry whose error is larger without the rest of the model.
const ADVICE: &str = "If the controller uses geometry alone, a geometry fitted alone may be better: identify the problem without its effects (and \
                     with --strategy rigid if joints or links are compliant), export it, and compare the errors.";

/// Errors on the held-out rows of the first kind in the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExportErrors {
    /// Errors of the whole identified model.
    pub whole: ErrorSummary,
    /// Errors of its rigid geometry, with the same base and tool.
    pub rigid: ErrorSummary,
}

impl ExportErrors {
    /// Computes the errors on the held-out rows of `data`. `x` are the identified deviations in the
    /// order of the model's parameters; `saved` is the estimate that they come from, if it was read
    /// from a file.
    pub fn of(
        model: &Model,
        x: &DVector<f64>,
        data: &Dataset,
        saved: Option<&SavedEstimate>,
    ) -> Self {
        let Dataset { measurements, split } = data;
        let placement = Placement::of(measurements);
        let mut poses = placement.poses(measurements, &split.held_out, 1.0);
        if let Some(saved) = saved {
            saved.count_time_in(&mut poses);
        }
        let rigid = model.geometric_residuals(&poses, x.as_slice());
        let whole = model.residuals(poses, x);
        let of = |errors: &[Vector3<f64>]| {
            ErrorSummary::of_rows(measurements, split.held_out.iter().copied(), errors)
        };
        Self { whole: of(&whole), rigid: of(&rigid) }
    }
}

/// Exported file, with what is reported about it.
#[derive(Debug, Clone, Copy)]
pub struct Exported<'a> {
    /// Problem as declared.
    pub problem: &'a Problem,
    /// Model of the problem.
    pub model: &'a Model,
    /// Path of the file, if one was written.
    pub file: Option<&'a Path>,
    /// Moved origins of a URDF.
    pub moved: Option<&'a [MovedOrigin]>,
    /// Errors, if measurements are available.
    pub errors: Option<ExportErrors>,
}

impl Exported<'_> {
    /// Returns the result as data.
    pub fn result(&self) -> ExportResult {
        let origin = |origin: &MovedOrigin| Origin {
            joint: origin.joint.clone(),
            xyz_m: origin.xyz.into(),
            rpy_rad: origin.rpy.into(),
            moved_mm: origin.distance * 1e3,
            turned_deg: origin.angle.to_degrees(),
        };
        let errors = |errors: ExportErrors| ExportedErrors {
            whole: Summary::of(&errors.whole),
            rigid: Summary::of(&errors.rigid),
        };
        ExportResult {
            problem: self.problem.name.clone(),
            file: self.file.map(|file| file.display().to_string()),
            origins: self.moved.map(|moved| moved.iter().map(origin).collect()),
            held_out: self.errors.map(errors),
            not_held: left_out(self),
        }
    }
}

/// Lists the parts of the model beyond the geometry of the chain.
fn left_out(exported: &Exported) -> Vec<String> {
    let mut left_out: Vec<String> = Vec::new();
    for (number, joint) in (1..).zip(&exported.problem.joints) {
        if joint.stiffness.is_some() {
            left_out.push(format!("joint{number}.stiffness"));
        }
        if let Some(beam) = &joint.beam {
            left_out.push(format!("elastic link {}", beam.name));
        }
    }
    left_out.extend(exported.problem.effects.iter().map(|declared| declared.effect.declaration()));
    let set_up = |parameter: &&crate::model::parameter::Parameter| {
        matches!(parameter.site, ParameterSite::Base { .. } | ParameterSite::Target { .. })
    };
    let set_up: Vec<&str> = exported
        .model
        .parameters
        .iter()
        .filter(set_up)
        .map(|parameter| parameter.name.as_str())
        .collect();
    if !set_up.is_empty() {
        left_out.push(format!("base and target of the set-up ({})", set_up.join(", ")));
    }
    left_out
}

/// Returns the result as text.
pub fn export_text(exported: &Exported) -> String {
    let mut blocks = Vec::new();
    if let Some(moved) = exported.moved {
        let row = |origin: &MovedOrigin| {
            vec![origin.joint.clone(), mm(origin.distance, 4), number(origin.angle.to_degrees(), 5)]
        };
        blocks.push(Block::Table(Table::new(
            &["origin of", "moved, mm", "turned, °"],
            moved.iter().map(row).collect(),
            &[0],
        )));
    }
    if let Some(ExportErrors { whole, rigid }) = &exported.errors {
        blocks.push(Block::lines(format!(
            "{} held-out {}: {} with the whole model, {} with the geometry that was exported",
            whole.n,
            rows_of_kind(whole.kind),
            errors::mean_and_rms(whole),
            errors::mean_and_rms(rigid)
        )));
        if rigid.mean.norm > 1.1 * whole.mean.norm {
            blocks.push(Block::Note(ADVICE.to_owned()));
        }
    }
    let left_out = left_out(exported);
    if !left_out.is_empty() {
        blocks.push(Block::Lines(
            "Parts of the model that the file cannot hold".to_owned(),
            left_out,
        ));
    }
    blocks.extend(exported.file.map(|file| Block::lines(format!("Written to {}", file.display()))));
    text(&blocks)
}
