//! What `export` says: what has moved, what that is worth, and what is left out.

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

/// What to do about a geometry that lacks what stood beside it.
const ALONE: &str = "A controller that knows geometry alone may do better with one that was fitted alone: identify the problem without its \
                     effects (and with --strategy rigid where joints or links give way), export that, and compare its error.";

/// Errors on held-out rows, of the first kind that the table has.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExportErrors {
    /// Of the model with everything that was identified.
    pub whole: ErrorSummary,
    /// Of its geometry alone, with the same base and tool.
    pub rigid: ErrorSummary,
}

impl ExportErrors {
    /// On the held-out rows of `data`; `x` are the deviations that were identified, in the order of
    /// the model's parameters, in a `saved` estimate or from the same data.
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

/// What was written.
#[derive(Debug, Clone, Copy)]
pub struct Exported<'a> {
    /// The problem as declared.
    pub problem: &'a Problem,
    /// Its model.
    pub model: &'a Model,
    /// The file, where one was written.
    pub file: Option<&'a Path>,
    /// The origins that have moved, in a URDF.
    pub moved: Option<&'a [MovedOrigin]>,
    /// Errors, where measurements are at hand.
    pub errors: Option<ExportErrors>,
}

impl Exported<'_> {
    /// Collects what was written.
    pub fn result(&self) -> ExportResult {
        let origin = |own: &MovedOrigin| Origin {
            joint: own.joint.clone(),
            xyz_m: own.xyz.into(),
            rpy_rad: own.rpy.into(),
            moved_mm: own.distance * 1e3,
            turned_deg: own.angle.to_degrees(),
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

/// What the model has beyond the geometry of the chain.
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
    left_out.extend(exported.problem.effects.iter().map(|own| own.effect.declaration()));
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

/// What was written, in words.
pub fn export_text(exported: &Exported) -> String {
    let mut blocks = Vec::new();
    if let Some(moved) = exported.moved {
        let row = |own: &MovedOrigin| {
            vec![own.joint.clone(), mm(own.distance, 4), number(own.angle.to_degrees(), 5)]
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
            blocks.push(Block::Note(ALONE.to_owned()));
        }
    }
    let left_out = left_out(exported);
    if !left_out.is_empty() {
        blocks.push(Block::Lines("The file cannot hold".to_owned(), left_out));
    }
    blocks.extend(exported.file.map(|file| Block::lines(format!("Written to {}", file.display()))));
    text(&blocks)
}
