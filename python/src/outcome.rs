//! What came of identifications, loops and traces.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use flexcal::design::Workspace;
use flexcal::export::{ExportError, GeometryChoice};
use flexcal::fit::{self, IdentifyError, Placement, Severity};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::model::Model;
use flexcal::model::parameter::Parameter;
use flexcal::nalgebra::{DMatrix, Vector3};
use flexcal::problem::Problem;
use flexcal::remainder::{self, Bounds, Correction, Fitted};
use flexcal::report::{self, PredictionAccuracy, Report};
use flexcal::results::{Document as _, IdentificationResult, LoopResult, PlotData, TraceResult};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::array::{Array, derivatives, numbers, points};
use crate::compensation::Compensation;
use crate::data::{Data, Poses, Source};
use crate::error::raised;
use crate::life;
use crate::pool::detached;
use crate::residuals;
use crate::urdf::Export;

/// Markdown, page, and name and SVG text of each figure.
pub type Pages = (String, String, Vec<(String, String)>);

/// An identified arm.
#[pyclass(frozen, module = "flexcal._core")]
pub struct Identification {
    pub problem: Arc<Problem>,
    pub data: Arc<Dataset>,
    pub found: Arc<fit::Identification>,
    /// Remainder and uncertainty; the uncertainty alone is computed when it is first needed.
    pub fitted: OnceLock<Option<Arc<Fitted>>>,
    /// True if a remainder was sought or declared, so that it corrects what is predicted.
    pub is_corrected: bool,
}

/// A closed loop.
#[pyclass(frozen, module = "flexcal._core")]
pub struct ClosedLoop {
    pub problem: Arc<Problem>,
    pub text: Arc<str>,
    pub data: Arc<Dataset>,
    pub closure: Arc<flexcal::select::ClosedLoop>,
    /// Remainder beside the effects that were found.
    pub fitted: Option<Arc<Fitted>>,
}

/// What a residual points to.
#[pyclass(frozen, module = "flexcal._core")]
pub struct Trace {
    pub problem: Arc<Problem>,
    pub data: Arc<Dataset>,
    pub found: Arc<flexcal::select::Trace>,
}

/// Slope of a correction: half the difference of commands [rad or m].
const STEP: f64 = 1e-5;

/// Positions, covariances, bounds, and flags of extrapolation.
type Bounded<'py> = (Array<'py>, Array<'py>, Array<'py>, Array<'py>);

impl Identification {
    /// An identification whose predictions no remainder corrects.
    pub fn plain(
        problem: &Arc<Problem>,
        data: &Arc<Dataset>,
        found: Arc<fit::Identification>,
    ) -> Self {
        let (problem, data) = (Arc::clone(problem), Arc::clone(data));
        Self { problem, data, found, fitted: OnceLock::new(), is_corrected: false }
    }

    /// An identification whose predictions are corrected by what was fitted beside it.
    pub fn corrected(self, fitted: Option<Arc<Fitted>>) -> Self {
        Self { fitted: OnceLock::from(fitted), is_corrected: true, ..self }
    }

    /// Remainder and uncertainty; `None` where the rows do not allow any.
    fn fitted(&self) -> Result<Option<&Fitted>, IdentifyError> {
        if let Some(fitted) = self.fitted.get() {
            return Ok(fitted.as_deref());
        }
        let fitted = remainder::uncertainty(&self.found, &self.problem, &self.data)?;
        Ok(self.fitted.get_or_init(|| fitted.map(Arc::new)).as_deref())
    }

    /// The remainder that corrects predictions.
    fn remainder(&self) -> Option<&Correction> {
        let fitted = self.fitted.get().filter(|_| self.is_corrected)?.as_ref()?;
        fitted.remainder.as_ref()
    }

    /// Slopes of the correction by the commands, added to those of the arm.
    fn add_slopes(
        &self,
        correction: &Correction,
        rows: &Measurements,
        slopes: &mut [DMatrix<f64>],
    ) -> Result<(), IdentifyError> {
        for joint in 0..rows.joints {
            let shifts = |step: f64| -> Result<Vec<Vector3<f64>>, IdentifyError> {
                let mut moved = rows.clone();
                let at_joint = moved.configurations.iter_mut().skip(joint).step_by(rows.joints);
                at_joint.for_each(|q| *q += step);
                let (_, poses) =
                    remainder::predict_identified(&self.found, &self.problem, correction, &moved)?;
                Ok(poses.into_iter().map(|pose| pose.shift).collect())
            };
            for ((slope, more), less) in slopes.iter_mut().zip(shifts(STEP)?).zip(shifts(-STEP)?) {
                let mut column = slope.column_mut(joint);
                column += (more - less) / (2.0 * STEP);
            }
        }
        Ok(())
    }

    /// Data of the figures, with the uncertainty of predictions.
    fn plots(&self) -> Result<PlotData, IdentifyError> {
        let shown = PlotData::of_identification(&self.problem, &self.data, &self.found)?;
        let Some(fitted) = self.fitted()? else { return Ok(shown) };
        shown.with_uncertainty((&self.found, &self.problem), &self.data, fitted)
    }
}

#[pymethods]
impl Identification {
    /// Returns estimate.json, with the uncertainty of predictions.
    pub fn json(&self, py: Python<'_>) -> PyResult<String> {
        detached(py, || {
            // Rows from arrays have a file name, too, but no file.
            let files = self.data.measurements.files.iter().filter(|file| file.is_file());
            let files: Vec<_> = files.cloned().collect();
            let mut result =
                IdentificationResult::new(&self.problem, &self.found).with_files(&files);
            if let Some(fitted) = self.fitted()? {
                result = result.with_predictions(&self.found, fitted);
            }
            Ok(result.to_json())
        })?
        .map_err(|error: IdentifyError| raised(&error))
    }

    /// What the command line prints.
    fn summary(&self, py: Python<'_>) -> PyResult<String> {
        detached(py, || {
            let accuracy = PredictionAccuracy::new(&self.found, &self.plots()?);
            let mut text = report::estimate_text(&self.problem, &self.found, accuracy);
            if let Some(fitted) = self.fitted()?.filter(|_| self.is_corrected) {
                text.push('\n');
                text += &report::remainder_text(&self.found, &fitted.outcome());
                text.push('\n');
            }
            Ok(text)
        })?
        .map_err(|error: IdentifyError| raised(&error))
    }

    /// Tests new rows against the identification; returns watch.json.
    fn watch(&self, py: Python<'_>, data: &Data, days: f64, false_alarms: f64) -> PyResult<String> {
        life::watch(py, self, data, (days, false_alarms))
    }

    /// remainder.json; `None` without a remainder.
    fn remainder_json(&self, py: Python<'_>) -> PyResult<Option<String>> {
        detached(py, || self.remainder().map(Correction::to_json))
    }

    /// Positions of the identified arm, their covariance, shape = (poses, 3, 3) [m²], the bound of
    /// measured − predicted that holds with probability `level` [m], and 1 where the pose lies
    /// outside of what was measured; `None` where the rows fitted do not allow any.
    fn predict_bounded<'py>(
        &self,
        py: Python<'py>,
        poses: &Poses,
        level: f64,
    ) -> PyResult<Option<Bounded<'py>>> {
        if !(0.0 < level && level < 1.0) {
            return Err(PyValueError::new_err("level: a probability between 0 and 1 is needed"));
        }
        let predicted = detached(py, || -> Result<_, IdentifyError> {
            let Some(fitted) = self.fitted()? else { return Ok(None) };
            let correction = self.remainder().unwrap_or(&fitted.alone);
            let rows = &poses.rows;
            let (positions, corrected) =
                remainder::predict_identified(&self.found, &self.problem, correction, rows)?;
            Ok(Some((positions, Bounds::new(correction, corrected, level))))
        })?;
        let Some((positions, bounds)) = predicted.map_err(|error| raised(&error))? else {
            return Ok(None);
        };
        let entries = bounds.poses.iter().flat_map(|pose| pose.covariance.iter().copied());
        let bound = (0..bounds.poses.len()).map(|pose| bounds.bound(pose));
        let flags = bounds.poses.iter().map(|pose| f64::from(u8::from(pose.is_extrapolated)));
        Ok(Some((
            points(py, &positions),
            numbers(py, entries),
            numbers(py, bound),
            numbers(py, flags),
        )))
    }

    /// Warnings about directions of approach that poses do not state although effects depend on them.
    fn unknown_sides(&self, py: Python<'_>, poses: &Poses) -> PyResult<Vec<String>> {
        let sides = detached(py, || {
            let sides = remainder::sides_of(&self.found, &self.problem, &poses.rows)?;
            Ok(report::unknown_sides(&sides, true).into_iter().collect())
        })?;
        sides.map_err(|error: IdentifyError| raised(&error))
    }

    /// Pages and figures.
    fn report(&self, py: Python<'_>) -> PyResult<Pages> {
        detached(py, || {
            let shown = self.plots()?;
            Ok(pages(report::identification_report(&self.problem, &self.found, &shown)))
        })?
        .map_err(|error: IdentifyError| raised(&error))
    }

    /// Why the fit is not to be trusted, if it is not.
    #[getter]
    fn why_not_trusted(&self) -> Option<String> {
        (!self.found.is_trusted()).then(|| report::why_not_trusted(&self.found))
    }

    /// What held-out rows say against the error bounds of predictions; `None` if nothing.
    #[getter]
    fn doubted_bounds(&self) -> Option<String> {
        self.found.doubted_bounds()
    }

    /// Texts of the findings that are warnings, with their remedies.
    #[getter]
    fn cautions(&self) -> Vec<String> {
        let findings = self.found.findings.iter();
        let warnings = findings.filter(|finding| finding.severity() == Severity::Warning);
        warnings.map(ToString::to_string).collect()
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
            found.covariance.entry(j, k).filter(|_| both).unwrap_or(f64::NAN)
        };
        numbers(py, (0..n).flat_map(|j| (0..n).map(move |k| (j, k))).map(value))
    }

    /// Returns name and 1 σ of the prior of each parameter, and whether it is that of
    /// ln(value / nominal).
    fn priors(&self) -> PyResult<Vec<(String, Option<f64>, bool)>> {
        let placement = Placement::of(&self.data.measurements);
        let model = Model::new(&self.problem, &placement.bases, &placement.targets)
            .map_err(|error| raised(&error))?;
        let prior =
            |known: Parameter| (known.name.clone(), known.sigma, known.unit().is_relative());
        Ok(model.parameters.into_iter().map(prior).collect())
    }

    /// Finds the commands that bring the arm to targets, corrected by its remainder.
    fn compensate(
        &self,
        py: Python<'_>,
        targets: Source,
        frame: &str,
        level: f64,
    ) -> PyResult<Compensation> {
        let estimate = self.json(py)?;
        let fitted = self.fitted().map_err(|error| raised(&error))?;
        let correction = self.remainder().or_else(|| fitted.map(|fitted| &fitted.alone));
        let estimate = (estimate.as_str(), correction);
        Compensation::new(py, &self.problem, estimate, targets, (frame, level))
    }

    /// Columns of the residual table.
    fn residuals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let corrected = self.remainder().and(self.fitted.get()).and_then(Option::as_ref);
        let found =
            detached(py, || match corrected.and_then(|fitted| fitted.residuals.as_ref()) {
                Some(corrected) => Ok(corrected.rows.clone()),
                None => self.found.residuals(&self.problem, &self.data),
            })?;
        residuals::table(py, &self.problem, &self.data, &found.map_err(|error| raised(&error))?)
    }

    /// Positions of the identified arm, corrected by its remainder, shape = (poses, 3), measuring
    /// frame [m].
    fn predict<'py>(&self, py: Python<'py>, poses: &Poses) -> PyResult<Array<'py>> {
        let (problem, rows) = (&self.problem, &poses.rows);
        let found = detached(py, || match self.remainder() {
            Some(correction) => {
                let predicted =
                    remainder::predict_identified(&self.found, problem, correction, rows);
                Ok(predicted?.0)
            }
            None => self.found.predict(problem, rows),
        })?;
        Ok(points(py, &found.map_err(|error: IdentifyError| raised(&error))?))
    }

    /// Writes the identified geometry into the URDF that the problem came from, or the geometry
    /// nearest to the whole model in a box [mm], or one that a rigid model gives.
    fn export_urdf(
        &self,
        py: Python<'_>,
        urdf: PathBuf,
        best_rigid: bool,
        fitted_alone: bool,
        workspace_mm: Option<[f64; 6]>,
    ) -> PyResult<Export> {
        let corners = workspace_mm.map(|[x0, x1, y0, y1, z0, z1]| {
            [Vector3::new(x0, y0, z0), Vector3::new(x1, y1, z1)].map(|corner| corner * 1e-3)
        });
        let choice = match (best_rigid, fitted_alone) {
            (true, _) => GeometryChoice::BestRigid(Workspace { corners, planes: Vec::new() }),
            (_, true) => GeometryChoice::FittedAlone,
            _ => GeometryChoice::Identified,
        };
        let estimate = self.json(py)?;
        let exported = detached(py, || {
            let fitted = (estimate.as_str(), self.remainder());
            Export::new(&urdf, (&self.problem, &self.data), &self.found, fitted, &choice)
        })?;
        exported.map_err(|error| match &error {
            ExportError::Input(input) => raised(input),
            _ => raised(&error),
        })
    }

    /// ∂p/∂q of the identified arm, corrected by its remainder, shape = (poses, 3, joints).
    fn jacobian<'py>(&self, py: Python<'py>, poses: &Poses) -> PyResult<Array<'py>> {
        let found = detached(py, || {
            let mut slopes = fit::jacobian(&self.problem, Some(&self.found), &poses.rows)?;
            if let Some(correction) = self.remainder() {
                self.add_slopes(correction, &poses.rows, &mut slopes)?;
            }
            Ok::<_, IdentifyError>(slopes)
        })?;
        Ok(derivatives(py, &found.map_err(|error| raised(&error))?))
    }
}

impl ClosedLoop {
    /// What its pages and its summary show.
    fn shown(&self) -> Result<PlotData, IdentifyError> {
        let shown = PlotData::of_loop(&self.problem, &self.data, &self.closure)?;
        let Some(fitted) = &self.fitted else { return Ok(shown) };
        let found = (&self.closure.after, &self.closure.closed);
        shown.with_uncertainty(found, &self.data, fitted)
    }
}

#[pymethods]
impl ClosedLoop {
    /// loop.json.
    fn json(&self, py: Python<'_>) -> PyResult<String> {
        detached(py, || {
            let result = LoopResult::new(&self.problem, &self.closure);
            match &self.fitted {
                Some(fitted) => result.with_remainder(&self.closure, fitted).to_json(),
                None => result.to_json(),
            }
        })
    }

    /// What the command line prints.
    fn summary(&self, py: Python<'_>) -> PyResult<String> {
        detached(py, || {
            let shown = self.shown()?;
            let accuracy = PredictionAccuracy::new(&self.closure.after, &shown);
            Ok(report::loop_text(&self.problem, &self.closure, accuracy))
        })?
        .map_err(|error: IdentifyError| raised(&error))
    }

    /// Pages and figures.
    fn report(&self, py: Python<'_>) -> PyResult<Pages> {
        detached(py, || {
            Ok(pages(report::loop_report(&self.problem, &self.closure, &self.shown()?)))
        })?
        .map_err(|error: IdentifyError| raised(&error))
    }

    /// problem.closed.toml: the problem with what was found declared, its data where they were.
    fn closed_problem(&self) -> PyResult<String> {
        closed_text(&self.text, &self.problem, &self.closure).map_err(PyValueError::new_err)
    }

    /// The fit of the declared problem.
    fn before(&self) -> Identification {
        let found = Arc::new(self.closure.before.fit.clone());
        Identification::plain(&self.problem, &self.data, found)
    }

    /// The fit with everything that was found.
    fn after(&self) -> Identification {
        let (problem, found) =
            (Arc::new(self.closure.closed.clone()), Arc::new(self.closure.after.clone()));
        Identification::plain(&problem, &self.data, found).corrected(self.fitted.clone())
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
        detached(py, || report::trace(&self.problem, &self.found, None).text())
    }

    /// The fit of the declared problem.
    fn fit(&self) -> Identification {
        let found = Arc::new(self.found.fit.clone());
        Identification::plain(&self.problem, &self.data, found)
    }
}

/// problem.closed.toml, its data where they were.
pub fn closed_text(
    text: &str,
    problem: &Problem,
    closure: &flexcal::select::ClosedLoop,
) -> Result<String, String> {
    let data = &problem.data;
    let joint_files = data.joint_log.as_ref().map_or(&[][..], |log| log.files.as_slice());
    let files = [data.files.as_slice(), joint_files];
    report::closed_problem(text, problem, closure, files).map_err(|error| error.to_string())
}

pub fn pages(report: Report) -> Pages {
    (report.markdown, report.html, report.figures)
}
