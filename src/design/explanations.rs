//! Explanations of the residual that a loop leaves undecided, as read from its loop.json.

use std::collections::HashSet;
use std::error::Error;
use std::io;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::error::InputError;
use crate::files::{FORMAT_VERSION, newer_version, read_limited, was_changed};
use crate::measurement::Measurements;
use crate::problem::{Effect, EffectDeclaration, Problem};
use crate::remainder::{Rival, Side};

/// Maximum size of a loop.json \[MiB\].
const MAX_FILE_MIB: u64 = 256;
/// Maximum number of alternatives of one effect that are considered, the most probable first.
const MAX_ALTERNATIVES: usize = 3;

/// Effects of a loop.json, with those among which the data do not decide.
#[derive(Debug, Clone, Default)]
pub struct Explanations {
    /// Effects with the status `found` and without alternatives, which the problem lacks.
    settled: Vec<EffectDeclaration>,
    /// Effects among which poses are to decide: those with an alternative or a lower status, and
    /// their alternatives.
    open: Vec<EffectDeclaration>,
    /// Descriptions of effects that would be open, but follow the time of measurement.
    pub(super) follow_time: Vec<String>,
    /// Digests of the rows that the loop fitted; empty in files of older versions.
    fitted_rows: Vec<String>,
}

/// Error of a loop.json that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ExplanationsError {
    #[error("{}: cannot be read ({source}); flexcal loop writes it", file.display())]
    Unreadable { file: PathBuf, source: io::Error },
    #[error("{}: not a loop.json: {source}", file.display())]
    Syntax { file: PathBuf, source: serde_json::Error },
    #[error("{}: format: version {version}, and this program reads versions up to {FORMAT_VERSION}; use a newer flexcal, or run flexcal loop again", file.display())]
    Newer { file: PathBuf, version: u32 },
    #[error("{}: changed since flexcal wrote it; run flexcal loop again", file.display())]
    Changed { file: PathBuf },
    #[error(
        "poses for causes are chosen without a prior: an update says nothing of effects that the problem does not declare; leave --prior \
         out, or choose for accuracy"
    )]
    WithPrior,
    #[error("{}: is of problem {found}, not of {expected}", file.display())]
    OtherProblem { file: PathBuf, found: String, expected: String },
    #[error(
        "loop.json was made from other measurements: none of the {rows} rows that it fitted is among these; run flexcal loop on these \
         first, or use --for accuracy"
    )]
    OtherMeasurements { rows: usize },
    #[error(transparent)]
    Effect(#[from] InputError),
}

#[derive(Deserialize)]
struct Document {
    problem: String,
    effects: Vec<Found>,
    #[serde(default)]
    fitted_rows: Vec<String>,
}

#[derive(Deserialize)]
struct Found {
    status: String,
    #[serde(flatten)]
    named: Named,
    #[serde(default)]
    claims: Option<Claims>,
    #[serde(default)]
    alternatives: Vec<Alternative>,
}

#[derive(Deserialize)]
struct Alternative {
    #[serde(flatten)]
    named: Named,
    #[serde(default)]
    probability: f64,
}

#[derive(Deserialize)]
struct Named {
    declaration: String,
    #[serde(default)]
    description: String,
    #[serde(default)]
    parameters: Vec<Value>,
}

#[derive(Deserialize)]
struct Value {
    name: String,
    estimate: f64,
}

#[derive(Deserialize)]
struct Claims {
    law: Probability,
}

#[derive(Deserialize)]
struct Probability {
    probability: f64,
}

impl Document {
    /// Reads the loop.json of `problem`.
    fn read(file: &Path, problem: &Problem) -> Result<Self, ExplanationsError> {
        let named = || file.to_owned();
        let unreadable = |source| ExplanationsError::Unreadable { file: named(), source };
        let bytes = read_limited(file, MAX_FILE_MIB << 20).map_err(unreadable)?;
        if let Some(version) = newer_version(&bytes) {
            return Err(ExplanationsError::Newer { file: named(), version });
        }
        let document: Self = serde_json::from_slice(&bytes)
            .map_err(|source| ExplanationsError::Syntax { file: named(), source })?;
        if was_changed(file) {
            return Err(ExplanationsError::Changed { file: named() });
        }
        if document.problem != problem.name {
            let (found, expected) = (document.problem, problem.name.clone());
            return Err(ExplanationsError::OtherProblem { file: named(), found, expected });
        }
        Ok(document)
    }
}

impl Named {
    fn side(&self, file: &Path, problem: &Problem) -> Result<Side, ExplanationsError> {
        Ok(Side {
            effect: problem.effect(&self.declaration, file)?,
            description: self.description.clone(),
            values: self.parameters.iter().map(|of| (of.name.clone(), of.estimate)).collect(),
        })
    }
}

/// Returns the effects that the loop.json beside the file of `problem` does not exclude in the place
/// of effects that the problem declares and that the loop has fitted, each with its probability
/// among all. Returns none without such a file.
///
/// # Errors
/// Returns the errors of [`Explanations::read`], except that the loop.json of another problem has
/// none.
#[doc(hidden)]
pub fn rivals(problem: &Problem) -> Result<Vec<Rival>, Box<dyn Error>> {
    let file = &problem.data.location.file.with_file_name("loop.json");
    if !file.is_file() {
        return Ok(Vec::new());
    }
    let document = match Document::read(file, problem) {
        Err(ExplanationsError::OtherProblem { .. }) => return Ok(Vec::new()),
        read => read?,
    };
    let mut rivals = Vec::new();
    for found in document.effects.iter().filter(|found| found.status != "contradicted") {
        let declared = found.named.side(file, problem)?;
        let is_it = |known: &EffectDeclaration| known.effect.is_same_as(&declared.effect.effect);
        if !problem.effects.iter().any(is_it) {
            continue;
        }
        let others = found.alternatives.iter().map(|other| other.probability).sum::<f64>();
        let law = found.claims.as_ref().map_or(1.0 - others, |claims| claims.law.probability);
        // Alternatives that the loop did not fit state no error of the instrument.
        let fitted = found.alternatives.iter().filter(|other| !other.named.parameters.is_empty());
        for other in fitted.take(MAX_ALTERNATIVES) {
            let share = other.probability / (law.max(0.0) + others).max(f64::MIN_POSITIVE);
            let rival = other.named.side(file, problem)?;
            rivals.push(Rival { declared: declared.clone(), rival, share });
        }
    }
    Ok(rivals)
}

impl Explanations {
    /// Reads the loop.json of `problem`.
    ///
    /// # Errors
    /// Returns an error if the file cannot be read, is no loop.json or of a newer version, was
    /// changed since flexcal wrote it, or belongs to another problem.
    pub fn read(file: &Path, problem: &Problem) -> Result<Self, ExplanationsError> {
        let document = Document::read(file, problem)?;
        let mut explanations = Self { fitted_rows: document.fitted_rows, ..Self::default() };
        for found in &document.effects {
            let effect = problem.effect(&found.named.declaration, file)?;
            let alternatives = found.alternatives.iter().take(MAX_ALTERNATIVES);
            let alternatives = alternatives.map(|of| problem.effect(&of.named.declaration, file));
            let alternatives: Vec<EffectDeclaration> = alternatives.collect::<Result<_, _>>()?;
            match found.status.as_str() {
                "contradicted" => {}
                "found" if alternatives.is_empty() => explanations.settled.push(effect),
                _ => {
                    explanations.open.push(effect);
                    explanations.open.extend(alternatives);
                }
            }
        }
        let is_new = |of: &EffectDeclaration| {
            let is_declared =
                |declared: &EffectDeclaration| declared.effect.describe() == of.effect.describe();
            !problem.effects.iter().any(is_declared)
        };
        explanations.settled.retain(is_new);
        // The choice of poses cannot separate what follows the time of measurement.
        explanations.open.retain(is_new);
        let follow_time = explanations.open.extract_if(.., |of| of.effect.follows_time());
        explanations.follow_time = follow_time.map(|of| of.effect.describe()).collect();
        let mut names = Vec::new();
        explanations.open.retain(|of| {
            let name = of.effect.describe();
            let is_first = !names.contains(&name);
            names.push(name);
            is_first
        });
        Ok(explanations)
    }

    /// Returns how many of the rows that the loop fitted are not among `measurements`, and how many
    /// it fitted.
    #[doc(hidden)]
    pub fn missing_rows(&self, measurements: &Measurements) -> (usize, usize) {
        let digests = (0..measurements.len()).map(|row| measurements.row_digest(row));
        let present: HashSet<String> = digests.collect();
        let missing = self.fitted_rows.iter().filter(|row| !present.contains(*row)).count();
        (missing, self.fitted_rows.len())
    }

    /// Returns an error if the loop fitted none of the rows of `measurements`, so that its
    /// explanations are of other data.
    pub(super) fn check_rows(&self, measurements: &Measurements) -> Result<(), ExplanationsError> {
        let (missing, rows) = self.missing_rows(measurements);
        if rows > 0 && missing == rows {
            return Err(ExplanationsError::OtherMeasurements { rows });
        }
        Ok(())
    }

    /// Returns the effects among which the data do not decide yet.
    pub fn open(&self) -> impl Iterator<Item = &Effect> {
        self.open.iter().map(|declared| &declared.effect)
    }

    /// Returns the problem with all effects of the loop.json declared, settled and open.
    pub(super) fn declared(&self, problem: &Problem) -> Problem {
        let mut declared = problem.clone();
        declared.effects.extend(self.settled.iter().chain(&self.open).cloned());
        declared
    }

    /// Returns the names of the open effects' parameters that are 0 without the effect, such as a
    /// compliance. The smaller their errors, the better the data decide among the effects.
    pub(super) fn parameters(&self, declared: &Problem) -> Vec<String> {
        let parameters = self.open().flat_map(|effect| effect.parameters(declared));
        let sized = parameters.filter(|parameter| parameter.nominal == 0.0);
        sized.map(|parameter| parameter.name).collect()
    }
}
