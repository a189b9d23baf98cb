//! PRIOR.toml: mean and spread of the parameters of a fleet, which `identify --prior` reads.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::error::PriorError;
use super::fleet::{Fleet, MIN_ARMS};
use crate::files::{DIGEST_KEY, digest_of_values, read_limited, was_changed};
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
    arms: i64,
    /// Digest of all other values; absent in older files and in those written by hand.
    digest: Option<String>,
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
        let head = format!(
            "# Mean and spread (1 σ) of the deviations from nominal of {} arms: flexcal identify --prior takes this file.\n\
             # SI units; of the logarithm for stiffnesses and rigidities.\n\
             format = \"{FORMAT}\"\nversion = {VERSION}\nproblem = {}\narms = {}\n",
            self.arms.len(),
            quoted(&self.problem),
            self.arms.len()
        );
        let mut text = "\n[arm_parts]\n".to_owned();
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
        let digest = digest_of(&format!("{head}{text}")).unwrap_or_default();
        format!("{head}{DIGEST_KEY} = {}\n{text}", quoted(&digest))
    }
}

/// Returns one digest of all values of a PRIOR.toml except the digest in it.
fn digest_of(text: &str) -> Result<String, toml::de::Error> {
    toml::from_str(text).map(digest_of_values)
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
        let unread = |error: toml::de::Error| syntax(error.message().to_owned());
        let Document { format, version, problem, arms, digest, arm_parts, parameters } =
            toml::from_str(&text).map_err(unread)?;
        if format != FORMAT || version > VERSION {
            return Err(syntax(format!("format {format}, version {version}")));
        }
        let found = digest_of(&text).map_err(unread)?;
        if was_changed(file) || digest.is_some_and(|digest| digest != found) {
            return Err(PriorError::Changed { file: file.to_owned() });
        }
        if !usize::try_from(arms).is_ok_and(|arms| arms >= MIN_ARMS) {
            return Err(syntax(format!("arms = {arms}, but a fleet has at least {MIN_ARMS}")));
        }
        if let Some((name, _)) = parameters.iter().find(|(_, entry)| !entry.is_usable()) {
            return Err(syntax(format!(
                "{name}: mean, mean_error and spread are numbers below {MAX_MAGNITUDE:e}, mean_error is \
                 0 or more, and spread is above 0"
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
    /// Returns true if the numbers are finite and the spread, which no fleet finds to be 0, is
    /// positive.
    fn is_usable(&self) -> bool {
        self.mean.abs() < MAX_MAGNITUDE
            && [self.mean_error, self.spread].iter().all(|size| (0.0..MAX_MAGNITUDE).contains(size))
            && self.spread > 0.0
    }

    /// Returns 1 σ of the deviation of the next arm: spread and error of the mean together.
    fn sigma(&self) -> f64 {
        self.spread.hypot(self.mean_error)
    }
}
