//! What was identified, written into a URDF.

use std::path::Path;

use flexcal::export::{ExportError, Geometry, GeometryChoice};
use flexcal::fit::{Identification, Placement, SavedEstimate};
use flexcal::measurement::Dataset;
use flexcal::model::Model;
use flexcal::problem::Problem;
use flexcal::remainder::Correction;
use flexcal::report::{self, ExportRemarks};
use flexcal::results::{Document as _, ExportResult, ExportedErrors};
use flexcal::urdf::{Chain, Robot, export_with_links, mounted_links};
use pyo3::prelude::*;

/// A URDF with moved origins.
#[pyclass(frozen, module = "flexcal._core")]
pub struct Export {
    /// The whole file.
    #[pyo3(get)]
    text: String,
    /// Reasons not to use the file as it is.
    #[pyo3(get)]
    warnings: Vec<String>,
    json: String,
    summary: String,
}

#[pymethods]
impl Export {
    /// What `flexcal export --json` prints.
    fn json(&self) -> &str {
        &self.json
    }

    /// What the command line prints.
    fn summary(&self) -> &str {
        &self.summary
    }
}

impl Export {
    /// Writes the chosen geometry of an identified arm into the URDF that its problem came from.
    /// `estimate` is its estimate.json, `correction` its remainder.
    pub fn new(
        urdf: &Path,
        (problem, data): (&Problem, &Dataset),
        found: &Identification,
        (estimate, correction): (&str, Option<&Correction>),
        choice: &GeometryChoice,
    ) -> Result<Self, ExportError> {
        let robot = Robot::read(urdf)?;
        let chain = Chain::from_problem(&robot, problem)?;
        let placement = Placement::of(&data.measurements);
        let model =
            found.strategy.model(Model::new(problem, &placement.bases, &placement.targets)?);
        let estimate = SavedEstimate::parse(estimate, Path::new("estimate.json"))?;
        let fitted = (&estimate, correction);
        let last_joint = chain.moving_end();
        let choice = (choice, last_joint.is_none());
        let geometry = Geometry::for_file(problem, fitted, (&model, &found.x), Some(data), choice)?;
        let mounted = mounted_links(problem, &model, found.x.as_slice());
        let moved = export_with_links(&chain, problem, &geometry.arm, &mounted)?;
        let errors = ExportedErrors::new(&model, &found.x, data, None)
            .with_geometries(geometry.errors(problem, fitted, data)?);
        let mut result = ExportResult::new(problem, &model, None, Some(&moved.moved), Some(errors));
        let kept = last_joint.filter(|_| geometry.best_rigid.is_some());
        result.not_held.extend(kept.map(report::kept_at_end));
        let remarks = ExportRemarks::new(
            (
                geometry.best_rigid.as_ref().map(|best| [best.best, best.identified]),
                problem.tool.payload_mass,
            ),
            geometry.fitted_alone.as_ref(),
        );
        let mut warnings = Vec::new();
        if !found.is_trusted() {
            warnings.push(report::why_not_trusted(found));
        }
        if let Some(alone) = geometry.fitted_alone.as_ref().filter(|alone| !alone.is_trusted()) {
            warnings.push(format!("geometry alone: {}", report::why_not_trusted(alone)));
        }
        warnings.extend(report::better_geometry(&result).map(|option| {
            let argument = option.trim_start_matches('-').replace('-', "_");
            let judged = if result.held_out.is_some() { "held-out" } else { "fitted" };
            format!(
                "the exported geometry is not the best that a rigid controller can have: {argument}=True gives a smaller error on \
                 {judged} poses; errors lists all of them"
            )
        }));
        warnings.extend(report::worse_than_nominal(&result));
        let (json, summary) = (result.to_json(), report::export_text(&result, &remarks));
        Ok(Self { text: moved.text, warnings, json, summary })
    }
}
