//! What came of identifications, loops and traces.

use std::path::PathBuf;
use std::sync::Arc;

use flexcal::fit;
use flexcal::measurement::Dataset;
use flexcal::problem::Problem;
use flexcal::report::{self, Report};
use flexcal::results::{Document as _, IdentificationResult, LoopResult, PlotData, TraceResult};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::array::{Array, derivatives, numbers, points};
use crate::data::Poses;
use crate::error::raised;
use crate::pool::detached;
use crate::residuals;
use crate::urdf::Export;

/// Markdown, page, and name and SVG text of each figure.
type Pages = (String, String, Vec<(String, String)>);

/// An identified arm.
#[pyclass(frozen, module = "flexcal._core")]
pub struct Identification {
    pub problem: Arc<Problem>,
    pub data: Arc<Dataset>,
    pub found: Arc<fit::Identification>,
}

/// A closed loop.
#[pyclass(frozen, module = "flexcal._core")]
pub struct ClosedLoop {
    pub problem: Arc<Problem>,
    pub text: Arc<str>,
    pub data: Arc<Dataset>,
    pub closure: Arc<flexcal::select::ClosedLoop>,
}

/// What a residual points to.
#[pyclass(frozen, module = "flexcal._core")]
pub struct Trace {
    pub problem: Arc<Problem>,
    pub data: Arc<Dataset>,
    pub found: Arc<flexcal::select::Trace>,
}

#[pymethods]
impl Identification {
    /// Returns estimate.json, with the uncertainty of predictions.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        detached(py, || {
            let mut result = IdentificationResult::new(&self.problem, &self.found);
            let fitted = flexcal::remainder::uncertainty(&self.found, &self.problem, &self.data)?;
            if let Some(fitted) = fitted {
                result = result.with_predictions(&self.found, &fitted);
            }
            Ok(result.to_json())
        })?
        .map_err(|error: fit::IdentifyError| raised(&error))
    }

    /// What the command line prints.
    fn summary(&self, py: Python<'_>) -> PyResult<String> {
        detached(py, || report::estimate_text(&self.problem, &self.found))
    }

    /// Pages and figures.
    fn report(&self, py: Python<'_>) -> PyResult<Pages> {
        detached(py, || {
            let shown = PlotData::of_identification(&self.problem, &self.data, &self.found)?;
            Ok(pages(report::identification_report(&self.problem, &self.found, &shown)))
        })?
        .map_err(|error: fit::IdentifyError| raised(&error))
    }

    /// Why the fit is not to be trusted, if it is not.
    #[getter]
    fn why_not_trusted(&self) -> Option<String> {
        (!self.found.is_trusted()).then(|| report::why_not_trusted(&self.found))
    }

    /// What to ask about the input.
    #[getter]
    fn cautions(&self) -> Vec<String> {
        self.found.reasons_to_ask()
    }

    /// Covariance of all parameters, SI, shape = (parameters, parameters); NaN where one of the two
    /// has no standard error.
    fn covariance<'py>(&self, py: Python<'py>) -> Array<'py> {
        let found = &self.found;
        let known: Vec<bool> =
            found.estimates.iter().map(|estimate| estimate.std_error.is_some()).collect();
        let n = known.len();
        let value = |(j, k): (usize, usize)| {
            let both = known.get(j) == Some(&true) && known.get(k) == Some(&true);
            found.covariance.of(j, k).filter(|_| both).unwrap_or(f64::NAN)
        };
        numbers(py, (0..n).flat_map(|j| (0..n).map(move |k| (j, k))).map(value))
    }

    /// Columns of the residual table.
    fn residuals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = detached(py, || self.found.residuals(&self.problem, &self.data))?;
        residuals::table(py, &self.problem, &self.data, &found.map_err(|error| raised(&error))?)
    }

    /// Positions of the identified arm, shape = (poses, 3), measuring frame [m].
    fn predict<'py>(&self, py: Python<'py>, poses: &Poses) -> PyResult<Array<'py>> {
        let found = detached(py, || self.found.predict(&self.problem, &poses.rows))?;
        Ok(points(py, &found.map_err(|error| raised(&error))?))
    }

    /// The URDF that the problem came from, with the origins that were identified.
    fn export_urdf(&self, py: Python<'_>, urdf: PathBuf) -> PyResult<Export> {
        detached(py, || Export::new(&urdf, &self.problem, &self.data, &self.found))?
            .map_err(|error| raised(&error))
    }

    /// ∂p/∂q of the identified arm, shape = (poses, 3, joints).
    fn jacobian<'py>(&self, py: Python<'py>, poses: &Poses) -> PyResult<Array<'py>> {
        let jacobian = || fit::jacobian(&self.problem, Some(&self.found), &poses.rows);
        let found = detached(py, jacobian)?;
        Ok(derivatives(py, &found.map_err(|error| raised(&error))?))
    }
}

#[pymethods]
impl ClosedLoop {
    /// loop.json.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        detached(py, || LoopResult::new(&self.problem, &self.closure).to_json())
    }

    /// What the command line prints.
    fn summary(&self, py: Python<'_>) -> PyResult<String> {
        detached(py, || report::loop_text(&self.problem, &self.closure))
    }

    /// Pages and figures.
    fn report(&self, py: Python<'_>) -> PyResult<Pages> {
        detached(py, || {
            let shown = PlotData::of_loop(&self.problem, &self.data, &self.closure)?;
            Ok(pages(report::loop_report(&self.problem, &self.closure, &shown)))
        })?
        .map_err(|error: fit::IdentifyError| raised(&error))
    }

    /// problem.closed.toml: the problem with what was found declared, its data where they were.
    fn closed_problem(&self) -> PyResult<String> {
        let data = &self.problem.data;
        let joint_files = data.joint_log.as_ref().map_or(&[][..], |log| log.files.as_slice());
        let files = [data.files.as_slice(), joint_files];
        report::closed_problem(&self.text, &self.problem, &self.closure, files)
            .map_err(|error| PyValueError::new_err(error.to_string()))
    }

    /// The fit of the declared problem.
    fn before(&self) -> Identification {
        let found = Arc::new(self.closure.before.fit.clone());
        Identification { problem: Arc::clone(&self.problem), data: Arc::clone(&self.data), found }
    }

    /// The fit with everything that was found.
    fn after(&self) -> Identification {
        let (problem, found) =
            (Arc::new(self.closure.closed.clone()), Arc::new(self.closure.after.clone()));
        Identification { problem, data: Arc::clone(&self.data), found }
    }
}

#[pymethods]
impl Trace {
    /// trace.json.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        detached(py, || TraceResult::new(&self.problem, &self.found).to_json())
    }

    /// What the command line prints.
    fn summary(&self, py: Python<'_>) -> PyResult<String> {
        detached(py, || report::trace_text(&self.problem, &self.found))
    }

    /// The fit of the declared problem.
    fn fit(&self) -> Identification {
        let found = Arc::new(self.found.fit.clone());
        Identification { problem: Arc::clone(&self.problem), data: Arc::clone(&self.data), found }
    }
}

fn pages(report: Report) -> Pages {
    (report.markdown, report.html, report.figures)
}
