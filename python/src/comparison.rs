//! Comparison of strategies and solvers.

use std::sync::Arc;

use flexcal::fit::{self, CompareOptions, IdentifyError};
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use flexcal::report;
use flexcal::results::{ComparisonResult, Document as _, PlotData};
use pyo3::prelude::*;

use crate::error::raised;
use crate::outcome::{Identification, Pages, pages};
use crate::pool::detached;

/// Results of all strategies and solvers for one problem.
#[pyclass(frozen, module = "flexcal._core")]
pub struct Comparison {
    problem: Arc<Problem>,
    data: Arc<Dataset>,
    found: Arc<fit::Comparison>,
}

#[pymethods]
impl Comparison {
    /// Returns compare.json.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        detached(py, || ComparisonResult::new(&self.problem, &self.found).to_json())
    }

    /// Returns the tables that the command line prints.
    fn summary(&self, py: Python<'_>) -> PyResult<String> {
        detached(py, || report::compare_text(&self.problem, &self.found))
    }

    /// Returns pages and figures.
    fn report(&self, py: Python<'_>) -> PyResult<Pages> {
        detached(py, || {
            let shown = PlotData::of_comparison(&self.problem, &self.data, &self.found)?;
            Ok(pages(report::comparison_report(&self.problem, &self.found, &shown)))
        })?
        .map_err(|error: IdentifyError| raised(&error))
    }

    /// Returns the joint fit by the solver that `auto` chooses.
    fn joint(&self) -> Identification {
        Identification::plain(&self.problem, &self.data, Arc::new(self.found.joint.clone()))
    }
}

impl Comparison {
    /// Compares all strategies and solvers.
    pub fn new(
        problem: Arc<Problem>,
        data: Arc<Dataset>,
        options: &CompareOptions,
    ) -> Result<Self, IdentifyError> {
        let found = Arc::new(fit::compare(&problem, &data, options)?);
        Ok(Self { problem, data, found })
    }
}
