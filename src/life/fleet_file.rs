//! PRIOR.toml: mean and spread of the parameters of a fleet, which `identify --prior` reads.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::error::PriorError;
use super::fleet::Fleet;
use crate::files::{read_limited, was_changed};
use crate::problem::digest::with_whole_names;

/// Value of the key `format`.
const FORMAT: &str = "flexcal-prior";
/// Newest version of the format that is read.
const VERSION: u32 = 1;
/// Maximum size of a PRIOR.toml \[MiB\].
const MAX_FILE_MIB: u64 = 16;

/// Prior of an arm from its siblings, as read from PRIOR.toml.
#[derive(Debug, Clone)]
pub struct FleetPrior {
    /// Path of the file.
    pub(super) file: PathBuf,
    /// Name of the problem of the arms.
    pub(super) problem: String,
    /// Digest of each part of the declared arm.
    pub(super) arm_parts: BTreeMap<String, String>,
    /// Mean and 1 σ of the deviation of each parameter, SI or of the logarithm.
    pub(super) parameters: BTreeMap<String, (f64, f64)>,
}

#[derive(Deserialize)]
struct Document {
    format: String,
    version: u32,
    problem: String,
    arm_parts: BTreeMap<String, String>,
    parameters: BTreeMap<String, Entry>,
}

#[derive(Deserialize)]
struct Entry {
    mean: f64,
    mean_error: f64,
    spread: f64,
}

impl Fleet {
    /// Returns the text of PRIOR.toml.
    pub fn to_toml(&self) -> String {
        let mut text = format!(
            "# Mean and spread (1 σ) of the deviations from nominal of {} arms: flexcal identify --prior takes this file.\n\
             # SI units; of the logarithm for stiffnesses and rigidities.\n\
             format = \"{FORMAT}\"\nversion = {VERSION}\nproblem = {}\narms = {}\n\n[arm_parts]\n",
            self.arms.len(),
            quoted(&self.problem),
            self.arms.len()
        );
        for (part, digest) in &self.arm_parts {
            let _ = writeln!(text, "{} = {}", quoted(part), quoted(digest));
        }
        text.push_str("\n[parameters]\n");
        for parameter in &self.parameters {
            let _ = writeln!(
                text,
                "{} = {{ mean = {:e}, mean_error = {:e}, spread = {:e} }}",
                quoted(&parameter.name),
                parameter.mean,
                parameter.mean_error,
                parameter.spread
            );
        }
        text
    }
}

/// Returns a text as a TOML string.
fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}

impl FleetPrior {
    /// Reads a PRIOR.toml.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, is no PRIOR.toml, or was changed since flexcal
    /// wrote it.
    pub fn read(file: &Path) -> Result<Self, PriorError> {
        let syntax = |reason: String| PriorError::Syntax { file: file.to_owned(), reason };
        let bytes = read_limited(file, MAX_FILE_MIB << 20)
            .map_err(|source| PriorError::Unreadable { file: file.to_owned(), source })?;
        let text = String::from_utf8(bytes).map_err(|error| syntax(error.to_string()))?;
        if text.lines().any(|line| line.trim() == "[[joint]]") {
            return Err(syntax("it declares joints, as a problem.toml does".to_owned()));
        }
        let Document { format, version, problem, arm_parts, parameters } =
            toml::from_str(&text).map_err(|error| syntax(error.message().to_owned()))?;
        if format != FORMAT || version > VERSION {
            return Err(syntax(format!("format {format}, version {version}")));
        }
        if was_changed(file) {
            return Err(PriorError::Changed { file: file.to_owned() });
        }
        if let Some((name, _)) = parameters.iter().find(|(_, entry)| !entry.is_usable()) {
            return Err(syntax(format!(
                "{name}: mean, mean_error and spread are numbers below {MAX_MAGNITUDE:e}, and the latter \
                 two are 0 or more and not both 0"
            )));
        }
        let entry = |(name, entry): (String, Entry)| (name, (entry.mean, entry.sigma()));
        let parameters = parameters.into_iter().map(entry).collect();
        let arm_parts = with_whole_names(arm_parts);
        Ok(Self { file: file.to_owned(), problem, arm_parts, parameters })
    }
}

/// Largest magnitude of a number of a prior that is read \[SI units\]; the errors of a fit with it
/// stay finite.
const MAX_MAGNITUDE: f64 = 1e9;

impl Entry {
    /// Returns true if the numbers are finite and give a positive 1 σ.
    fn is_usable(&self) -> bool {
        self.mean.abs() < MAX_MAGNITUDE
            && [self.mean_error, self.spread].iter().all(|size| (0.0..MAX_MAGNITUDE).contains(size))
            && self.sigma() > 0.0
    }

    /// Returns 1 σ of the deviation of the next arm: spread and error of the mean together.
    fn sigma(&self) -> f64 {
        self.spread.hypot(self.mean_error)
    }
}
