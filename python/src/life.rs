//! Changes of an arm since its estimate, and fleets.

use std::path::{Path, PathBuf};

use flexcal::fit::SavedEstimate;
use flexcal::life::{self, FleetPrior, PriorError, PriorSource};
use flexcal::results::{Document as _, FleetResult, WatchResult};
use pyo3::prelude::*;

use crate::data::Data;
use crate::error::{of_argument, raised};
use crate::outcome::Identification;
use crate::pool::detached;

/// Prior of an identification: a file, or an identification in memory.
#[derive(FromPyObject)]
pub enum Prior {
    /// An estimate.json, or a PRIOR.toml.
    File(PathBuf),
    /// Name that messages give to an estimate.json, its text, and that of its remainder.json.
    Estimate(PathBuf, String, Option<String>),
}

impl Prior {
    /// Reads the prior.
    pub fn read(self) -> Result<PriorSource, PriorError> {
        let estimate = match self {
            Self::File(file) if file.extension().is_some_and(|ending| ending == "toml") => {
                return Ok(PriorSource::Fleet(FleetPrior::read(&file)?));
            }
            Self::File(file) => SavedEstimate::read(&file)?,
            Self::Estimate(name, text, remainder) => {
                let estimate = SavedEstimate::parse(&text, &name)?;
                match remainder {
                    Some(text) => estimate.with_remainder(text),
                    None => estimate,
                }
            }
        };
        Ok(PriorSource::Estimate(Box::new(estimate)))
    }
}

/// Checks a number of days of drift.
pub fn checked_days(days: f64) -> PyResult<f64> {
    if days.is_finite() && days >= 0.0 {
        return Ok(days);
    }
    let message = "drift_days: a number of days, at least 0, is needed".to_owned();
    Err(of_argument("drift_days", message))
}

/// Tests new rows against an identification; returns watch.json.
pub fn watch(
    py: Python<'_>,
    found: &Identification,
    data: &Data,
    (days, false_alarms): (f64, f64),
) -> PyResult<String> {
    let days = checked_days(days)?;
    if !(0.0 < false_alarms && false_alarms < 1.0) {
        let message = "false_alarms: a probability between 0 and 1 is needed".to_owned();
        return Err(of_argument("false_alarms", message));
    }
    let json = found.json(py)?;
    let rows = data.data.measurements.clone();
    detached(py, || {
        let estimate = SavedEstimate::parse(&json, Path::new("estimate.json"))?;
        let verdict = life::watch(&found.problem, &estimate, &rows, (days, false_alarms))?;
        Ok(WatchResult::new(&found.problem, "estimate.json", days, &verdict).to_json())
    })?
    .map_err(|error: PriorError| raised(&error))
}

/// Estimate of an arm of a fleet: a file, or the estimate.json of an identification in memory with
/// the name that messages give it.
#[derive(FromPyObject)]
pub enum Sibling {
    /// An estimate.json.
    File(PathBuf),
    /// Name and text of an estimate.json.
    Estimate(PathBuf, String),
}

/// Finds mean and spread of a fleet; returns the result as JSON, and PRIOR.toml.
#[pyfunction]
pub fn fleet(py: Python<'_>, estimates: Vec<Sibling>) -> PyResult<(String, String)> {
    detached(py, || {
        let read = estimates.iter().map(|sibling| match sibling {
            Sibling::File(file) => SavedEstimate::read(file),
            Sibling::Estimate(name, text) => SavedEstimate::parse(text, name),
        });
        let found = life::fleet(&read.collect::<Result<Vec<_>, _>>()?)?;
        Ok((FleetResult::new(&found).to_json(), found.to_toml()))
    })?
    .map_err(|error: PriorError| raised(&error))
}
