//! Contents of an `estimate.json`, as far as they are read.

use std::collections::{BTreeMap, HashSet};
use std::path::PathBuf;

use serde::Deserialize;
use serde_json::value::RawValue;

use super::saved_estimate_error::Format;

/// Parameter of the file.
#[derive(Debug, Clone, Deserialize)]
pub(super) struct Entry {
    pub name: String,
    pub nominal: f64,
    pub estimate: f64,
    /// Standard error of the value, SI; `None` if it has none, or in files of older versions.
    pub std_error: Option<f64>,
    pub identified: Option<f64>,
    /// Symbol of the SI unit.
    pub unit: Option<String>,
    /// Standard deviation of the declared prior of the deviation; `None` without a prior, or in
    /// files of older versions.
    pub prior_sigma: Option<f64>,
    /// False if the strategy held the parameter fixed; `None` in files of older versions.
    pub fitted: Option<bool>,
}

/// Contents of the file, as far as they are read.
#[derive(Debug, Deserialize)]
pub(super) struct Document {
    /// Name and version of the file format; `None` in files of older versions.
    pub format: Option<Format>,
    pub problem: String,
    pub arm_digest: Option<String>,
    pub strategy: Option<String>,
    pub trusted: bool,
    pub estimated_sigma_mm: Option<f64>,
    pub first_time_s: Option<f64>,
    pub session_times_s: Option<BTreeMap<String, f64>>,
    pub has_approach: Option<bool>,
    pub parameters: Vec<Entry>,
    pub remainder: Option<RemainderEntry>,
    pub measurement_files: Option<Vec<PathBuf>>,
    pub prediction: Option<Box<RawValue>>,
    pub arm_parts: Option<BTreeMap<String, String>>,
    pub covariance: Option<Vec<Vec<Option<f64>>>>,
    pub sigma_taken_mm: Option<f64>,
    pub noise_factor: Option<f64>,
    pub reduced_chi2: Option<f64>,
    pub chance: Option<(f64, f64)>,
    pub fitted_rows: Option<HashSet<String>>,
    pub prior: Option<PriorEntry>,
    pub findings: Option<Vec<FindingEntry>>,
}

#[derive(Debug, Deserialize)]
pub(super) struct FindingEntry {
    pub code: String,
    pub text: String,
}

#[derive(Debug, Deserialize)]
pub(super) struct PriorEntry {
    pub includes_fleet: Option<bool>,
}

#[derive(Debug, Deserialize)]
pub(super) struct RemainderEntry {
    pub file: Option<String>,
}
