//! Simulated measurements, and studies of many fits to them.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use flexcal::error::InputError;
use flexcal::fit::Progress;
use flexcal::problem::HeldOut;
use flexcal::report;
use flexcal::results::{Document as _, StudyResult, study_csv, study_parameters_csv};
use flexcal::rig::{SimulatedPoses, SimulationError, Truth, simulate_counted};
use flexcal::study::{self, Results, Shard, Store};
use pyo3::prelude::*;

use crate::data::Poses;
use crate::error::raised;
use crate::problem::Problem;
use crate::supervise::supervised;

/// Simulated measurements with their truth.
#[pyclass(frozen, module = "flexcal._core")]
pub struct Simulation {
    csv: String,
    json: String,
    /// Column that marks held-out rows although the problem chooses them otherwise; None where the
    /// problem chooses them by a column.
    #[pyo3(get)]
    unused_split: Option<String>,
}

#[pymethods]
impl Simulation {
    /// Returns truth.json.
    fn json(&self) -> &str {
        &self.json
    }

    /// Returns measurements.csv.
    fn csv(&self) -> &str {
        &self.csv
    }
}

/// Error of a simulation.
#[derive(Debug)]
enum Failure {
    Input(InputError),
    Simulation(SimulationError),
}

/// Measures the true arm of TRUTH.toml on the virtual test rig, in `count` random poses or in the
/// given ones.
#[pyfunction]
pub fn simulated(
    py: Python<'_>,
    problem: &Problem,
    truth: PathBuf,
    count: usize,
    given: Option<&Poses>,
    seed: u64,
) -> PyResult<Simulation> {
    let declared = Arc::clone(&problem.declared);
    let given = given.map(|poses| Arc::clone(&poses.rows));
    let made = supervised(py, None, move |sink| {
        let truth = Truth::read(&truth, &declared).map_err(Failure::Input)?;
        let poses = given.map_or(SimulatedPoses::Random(count), |rows| {
            SimulatedPoses::Given(rows.poses_to_simulate(&declared))
        });
        // A pose is a step at which an interrupt ends the work.
        let step = || sink(Progress::Step { iteration: 1, unknowns: 0, poses: 1, cost: 0.0 });
        let simulation = simulate_counted(&declared, &truth, poses, seed, &step);
        let simulation = simulation.map_err(Failure::Simulation)?;
        let by_column = matches!(declared.data.held_out, None | Some(HeldOut::Column(_)));
        let unused_split = (!by_column).then(|| "split".to_owned());
        Ok(Simulation { csv: simulation.csv(), json: simulation.truth_json(), unused_split })
    })?;
    made.map_err(|error| match error {
        Failure::Input(error) => raised(&error),
        Failure::Simulation(error) => raised(&error),
    })
}

/// Results of a study.
#[pyclass(frozen, module = "flexcal._core")]
pub struct Study {
    study: Arc<study::Study>,
    found: Results,
}

#[pymethods]
impl Study {
    /// Returns study.json.
    fn json(&self) -> String {
        StudyResult::new(&self.study, &self.found).to_json()
    }

    /// Returns the table that the command line prints.
    fn summary(&self) -> String {
        report::study(&self.study, &self.found).text()
    }

    /// Returns study.csv.
    fn csv(&self) -> String {
        study_csv(&self.study, &self.found)
    }

    /// Returns parameters.csv.
    fn parameters_csv(&self) -> String {
        study_parameters_csv(&self.study, &self.found)
    }
}

/// Runs the fits of a STUDY.toml that are not finished in `folder`; `progress` is called with the
/// number of fits done and of all.
#[pyfunction]
pub fn studied(
    py: Python<'_>,
    file: PathBuf,
    folder: PathBuf,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<Study> {
    let study = study::Study::read(&file).map_err(|error| raised(&error))?;
    let (study, store) = (Arc::new(study), Store::new(&folder));
    let parts = study::pending(&study, &store, Shard::WHOLE).map_err(|error| raised(&error))?;
    let fits: usize = parts.iter().map(|part| part.repetitions.len()).sum();
    let found = supervised(py, progress.as_ref(), {
        let study = Arc::clone(&study);
        move |sink| {
            let done = AtomicU64::new(0);
            let fitted = || {
                let iteration = done.fetch_add(1, Ordering::Relaxed) + 1;
                sink(Progress::Step { iteration, unknowns: fits, poses: 0, cost: f64::NAN });
            };
            study::run(&study, &store, &parts, fitted)?;
            study::collect(&study, &[store])
        }
    })?;
    let found = found.map_err(|error| raised(&error))?;
    Ok(Study { study, found })
}
