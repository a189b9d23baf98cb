//! What was identified, written into a URDF.

use std::path::Path;

use flexcal::error::InputError;
use flexcal::fit::{Identification, Placement};
use flexcal::measurement::Dataset;
use flexcal::model::Model;
use flexcal::problem::Problem;
use flexcal::report;
use flexcal::results::{Document as _, ExportResult, ExportedErrors};
use flexcal::urdf::{Chain, Robot, export};
use pyo3::prelude::*;

/// A URDF with moved origins.
#[pyclass(frozen, module = "flexcal._core")]
pub struct Export {
    /// The whole file.
    #[pyo3(get)]
    text: String,
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
    /// The geometry of an identified arm in the URDF that its problem came from.
    pub fn new(
        urdf: &Path,
        problem: &Problem,
        data: &Dataset,
        found: &Identification,
    ) -> Result<Self, InputError> {
        let robot = Robot::read(urdf)?;
        let chain = Chain::from_problem(&robot, problem)?;
        let placement = Placement::of(&data.measurements);
        let model =
            found.strategy.model(Model::new(problem, &placement.bases, &placement.targets)?);
        let arm = model.arm(|k| found.x.get(k).copied().unwrap_or(0.0));
        let moved = export(&chain, problem, &arm)?;
        let errors = Some(ExportedErrors::new(&model, &found.x, data, None));
        let result = ExportResult::new(problem, &model, None, Some(&moved.moved), errors);
        let (json, summary) = (result.to_json(), report::export_text(&result));
        Ok(Self { text: moved.text, json, summary })
    }
}
