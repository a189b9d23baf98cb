//! A problem, and what can be done with it.

use std::path::PathBuf;
use std::sync::{Arc, OnceLock};

use flexcal::fit::{
    self, CompareOptions, IdentifyError, Options, Placement, ResidualFunction, SolverChoice,
    Strategy,
};
use flexcal::life::{PriorError, update};
use flexcal::model::Model;
use flexcal::nalgebra::DVector;
use flexcal::problem::{Joint, JointKind};
use flexcal::remainder;
use flexcal::select;
use flexcal::urdf::{Chain, Description, Robot, describe};
use pyo3::prelude::*;

use crate::array::{Array, derivatives, points};
use crate::comparison::Comparison;
use crate::data::{Data, Poses, Source};
use crate::error::{of_argument, raised};
use crate::least_squares::LeastSquares;
use crate::life::{Prior, checked_days};
use crate::outcome::{ClosedLoop, Identification, Trace, closed_text};
use crate::pool::detached;
use crate::supervise::supervised;

/// An arm, what is free of it, and where its measurements are.
#[pyclass(frozen, module = "flexcal._core")]
pub struct Problem {
    pub declared: Arc<flexcal::problem::Problem>,
    text: Arc<str>,
    /// What to know of a problem that was made from a URDF.
    #[pyo3(get)]
    notes: Vec<String>,
}

#[pymethods]
impl Problem {
    /// Reads a problem.toml, or the one in a folder.
    #[staticmethod]
    fn read(path: PathBuf) -> PyResult<Self> {
        let (problem, text) =
            flexcal::problem::Problem::read_with_text(&path).map_err(|error| raised(&error))?;
        Ok(Self { declared: Arc::new(problem), text, notes: Vec::new() })
    }

    /// Reads a problem from its text; `file` names it in messages, and data files are looked for
    /// beside it.
    #[staticmethod]
    #[pyo3(signature = (text, file, notes=Vec::new()))]
    fn parse(text: &str, file: PathBuf, notes: Vec<String>) -> PyResult<Self> {
        let problem =
            flexcal::problem::Problem::parse(text, &file).map_err(|error| raised(&error))?;
        Ok(Self { declared: Arc::new(problem), text: Arc::from(text), notes })
    }

    /// The chain between two links of a URDF; `file` names the problem in messages, and data files
    /// are looked for beside it.
    #[staticmethod]
    fn from_urdf(
        urdf: PathBuf,
        base: Option<&str>,
        tip: Option<&str>,
        file: PathBuf,
    ) -> PyResult<Self> {
        let described =
            Robot::read(&urdf).and_then(|robot| describe(&Chain::new(&robot, base, tip)?));
        let Description { text, notes, .. } = described.map_err(|error| raised(&error))?;
        Self::parse(&text, file, notes)
    }

    /// Its name.
    #[getter]
    fn name(&self) -> &str {
        &self.declared.name
    }

    /// One line for people.
    #[getter]
    fn title(&self) -> &str {
        &self.declared.title
    }

    /// The problem file.
    #[getter]
    fn text(&self) -> &str {
        &self.text
    }

    /// File that messages name, beside which its data files are looked for.
    #[getter]
    fn file(&self) -> PathBuf {
        self.declared.data.location.file.clone()
    }

    /// Measurement files that it names.
    #[getter]
    fn files(&self) -> Vec<PathBuf> {
        self.declared.data.files.clone()
    }

    /// Names of the joints, from the base outwards.
    #[getter]
    fn joints(&self) -> Vec<String> {
        self.declared.joints.iter().map(|joint| joint.name.clone()).collect()
    }

    /// Unit of each joint's command, from the base outwards; None at fixed joints.
    #[getter]
    fn units(&self) -> Vec<Option<&'static str>> {
        let unit = |joint: &Joint| match joint.command_kind() {
            JointKind::Revolute => Some("rad"),
            JointKind::Prismatic => Some("m"),
            JointKind::Fixed => None,
        };
        self.declared.joints.iter().map(unit).collect()
    }

    /// Reads measurements.
    fn data(&self, py: Python<'_>, source: Source) -> PyResult<Data> {
        let input = source.owned()?;
        detached(py, || Data::read(input, &self.declared))?.map_err(|error| raised(&error))
    }

    /// Reads poses, measured or not.
    fn poses(&self, py: Python<'_>, source: Source) -> PyResult<Poses> {
        let input = source.owned()?;
        detached(py, || Poses::read(input, &self.declared))?.map_err(|error| raised(&error))
    }

    /// Fits the free parameters, and a remainder beside them where that is asked for.
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn identify(
        &self,
        py: Python<'_>,
        data: &Data,
        strategy: &str,
        solver: &str,
        remainder: bool,
        prior: Option<Prior>,
        drift_days: f64,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Identification> {
        let drift_days = checked_days(drift_days)?;
        if prior.is_none() && drift_days > 0.0 {
            let message = "drift_days: widens a prior, and none is given".to_owned();
            return Err(of_argument("drift_days", message));
        }
        if prior.is_some() && remainder {
            let message = "remainder: a fit with a prior takes over that of the prior".to_owned();
            return Err(of_argument("remainder", message));
        }
        let prior = prior.map(|prior| detached(py, || prior.read())).transpose()?.transpose();
        let prior = prior.map_err(|error| raised(&error))?;
        let strategy = word("strategy", strategy, &Strategy::EACH, Strategy::as_str)?;
        let solver = word("solver", solver, SolverChoice::CHOICES, SolverChoice::as_str)?;
        let (problem, data) = (Arc::clone(&self.declared), Arc::clone(&data.data));
        let declared = if remainder || prior.is_some() {
            None
        } else {
            remainder::declared(&problem).map_err(|error| raised(&error))?
        };
        let is_corrected = remainder || declared.is_some();
        let has_prior = prior.is_some();
        let found = supervised(py, progress.as_ref(), {
            let (problem, data) = (Arc::clone(&problem), Arc::clone(&data));
            move |sink| {
                let options = Options::default()
                    .with_influential_rows()
                    .with_strategy(strategy)
                    .with_solver(solver)
                    .with_progress(sink);
                let (mut found, fitted) = if let Some(prior) = prior {
                    let updated = update(&problem, &data, &options, &prior, drift_days)?;
                    (updated.found, updated.predictions)
                } else {
                    let found = fit::identify(&problem, &data, &options)?;
                    let fitted = match (remainder, declared) {
                        (true, _) => remainder::fit(&found, &problem, &data)?,
                        (false, Some(declared)) => remainder::uncertainty(&found, &problem, &data)?
                            .map(|fitted| fitted.with_declared(declared, (&found, &problem), &data))
                            .transpose()?,
                        (false, None) => None,
                    };
                    (found, fitted)
                };
                if let Some(fitted) = &fitted {
                    fitted.judge_held_out(&mut found);
                }
                Ok::<_, PriorError>((found, fitted))
            }
        })?;
        let (found, fitted) = found.map_err(|error| raised(&error))?;
        let identified = Identification::plain(&problem, &data, Arc::new(found));
        if has_prior {
            // Without that of the prior, the uncertainty of predictions would be that of the new
            // rows alone.
            let is_corrected = fitted.as_ref().is_some_and(|fitted| fitted.remainder.is_some());
            let fitted = OnceLock::from(fitted.map(Arc::new));
            return Ok(Identification { fitted, is_corrected, ..identified });
        }
        Ok(if is_corrected { identified.corrected(fitted.map(Arc::new)) } else { identified })
    }

    /// Finds the effects that the problem lacks.
    fn close(
        &self,
        py: Python<'_>,
        data: &Data,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<ClosedLoop> {
        let (problem, data) = (Arc::clone(&self.declared), Arc::clone(&data.data));
        let closure = supervised(py, progress.as_ref(), {
            let (problem, data) = (Arc::clone(&problem), Arc::clone(&data));
            let text = Arc::clone(&self.text);
            move |sink| {
                let options = Options::default().with_influential_rows().with_progress(sink);
                let (closure, fitted) =
                    select::close(&problem, &data, &options)?.corrected(&data)?;
                // The extended problem may declare another arm than was fitted, as without an
                // effect that data contradict.
                let text = closed_text(&text, &problem, &closure).ok();
                let file = &problem.data.location.file;
                let is_declared = text
                    .and_then(|text| flexcal::problem::Problem::parse(&text, file).ok())
                    .is_some_and(|closed| closed.digest() == closure.closed.digest());
                Ok::<_, IdentifyError>((closure, fitted.filter(|_| is_declared)))
            }
        })?;
        let (closure, fitted) = closure.map_err(|error| raised(&error))?;
        Ok(ClosedLoop {
            problem,
            text: Arc::clone(&self.text),
            data,
            closure: Arc::new(closure),
            fitted: fitted.map(Arc::new),
        })
    }

    /// Ranks the effects that the residual points to.
    fn trace(
        &self,
        py: Python<'_>,
        data: &Data,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Trace> {
        let (problem, data) = (Arc::clone(&self.declared), Arc::clone(&data.data));
        let trace = supervised(py, progress.as_ref(), {
            let (problem, data) = (Arc::clone(&problem), Arc::clone(&data));
            move |sink| select::trace(&problem, &data, &Options::default().with_progress(sink))
        })?;
        let trace = trace.map_err(|error| raised(&error))?;
        Ok(Trace { problem, data, found: Arc::new(trace) })
    }

    /// Compares all strategies and solvers.
    fn compare(
        &self,
        py: Python<'_>,
        data: &Data,
        paper: bool,
        progress: Option<Bound<'_, PyAny>>,
    ) -> PyResult<Comparison> {
        let (problem, data) = (Arc::clone(&self.declared), Arc::clone(&data.data));
        let compared = supervised(py, progress.as_ref(), move |sink| {
            Comparison::new(problem, data, &CompareOptions { paper, progress: Some(sink) })
        })?;
        compared.map_err(|error| raised(&error))
    }

    /// Returns the residuals as a function of the parameters that a strategy varies.
    fn least_squares(&self, py: Python<'_>, data: &Data, strategy: &str) -> PyResult<LeastSquares> {
        let strategy = word("strategy", strategy, &Strategy::EACH, Strategy::as_str)?;
        let data = Arc::clone(&data.data);
        let function =
            detached(py, || ResidualFunction::new(&self.declared, Arc::clone(&data), strategy))?;
        Ok(LeastSquares { function: function.map_err(|error| raised(&error))?, data })
    }

    /// Positions of the nominal arm, shape = (poses, 3), measuring frame [m].
    fn predict<'py>(&self, py: Python<'py>, poses: &Poses) -> PyResult<Array<'py>> {
        let found = detached(py, || {
            let placement = Placement::of(&poses.rows);
            let model = Model::new(&self.declared, &placement.bases, &placement.targets)?;
            let rows: Vec<usize> = (0..poses.rows.len()).collect();
            let x = DVector::zeros(model.parameters.len());
            Ok(model.predict(placement.poses(&poses.rows, &rows, 1.0), &x))
        })?;
        Ok(points(py, &found.map_err(|error: flexcal::error::InputError| raised(&error))?))
    }

    /// ∂p/∂q of the nominal arm, shape = (poses, 3, joints).
    fn jacobian<'py>(&self, py: Python<'py>, poses: &Poses) -> PyResult<Array<'py>> {
        let found = detached(py, || fit::jacobian(&self.declared, None, &poses.rows))?;
        Ok(derivatives(py, &found.map_err(|error| raised(&error))?))
    }
}

/// What a word of an argument stands for.
fn word<T: Copy>(
    argument: &str,
    word: &str,
    each: &[T],
    name: fn(T) -> &'static str,
) -> PyResult<T> {
    each.iter().copied().find(|&value| name(value) == word).ok_or_else(|| {
        let known: Vec<&str> = each.iter().map(|&value| name(value)).collect();
        of_argument(argument, format!("{argument}: \"{word}\" is none of {}", known.join(", ")))
    })
}
