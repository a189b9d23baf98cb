//! An estimate.json, read back for an arm that it was identified for.

use std::collections::{HashMap, HashSet};
use std::io;
use std::path::{Path, PathBuf};

use flexcal::files::at_most;
use flexcal::identify::Strategy;
use flexcal::model::Model;
use flexcal::nalgebra::DVector;
use flexcal::problem::Problem;
use serde::Deserialize;

/// Largest estimate.json that is read [MiB].
const LARGEST_MIB: u64 = 256;
/// Largest value: its square is a number as well.
const GREATEST: f64 = 1e150;

/// What an estimate.json says.
#[derive(Debug, Deserialize)]
pub struct Estimates {
    #[serde(skip)]
    file: PathBuf,
    problem: String,
    /// Not there in what older versions wrote.
    arm_digest: Option<String>,
    strategy: Option<String>,
    /// Whether the fit was.
    pub trusted: bool,
    parameters: Vec<Estimated>,
}

#[derive(Debug, Deserialize)]
struct Estimated {
    name: String,
    nominal: f64,
    estimate: f64,
}

/// An estimate that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum EstimateError {
    #[error("{}: cannot be read: {source}", file.display())]
    Unreadable { file: PathBuf, source: std::io::Error },
    #[error("{}: not an estimate.json: {source}", file.display())]
    Syntax { file: PathBuf, source: serde_json::Error },
    #[error("{}: has no estimate of {name}; identify the same problem and sessions", file.display())]
    Missing { file: PathBuf, name: String },
    #[error("{}: identifies problem {found}, not {expected}", file.display())]
    OtherProblem { file: PathBuf, found: String, expected: String },
    #[error("{}: {name} is {found} nominally there, {expected} in the problem; identify again", file.display())]
    OtherNominal { file: PathBuf, name: String, found: f64, expected: f64 },
    #[error("{}: was identified with another declared arm (a fixed value, a mass, gravity or an effect has changed since); identify again", file.display())]
    OtherArm { file: PathBuf },
    #[error("{}: {name} was identified, but is not free in the problem; identify again", file.display())]
    NotFree { file: PathBuf, name: String },
    #[error("{}: {name} stands there twice; keep one of the two", file.display())]
    Twice { file: PathBuf, name: String },
    #[error("{}: {name} has a value larger than 1e150, the largest number that can be reckoned with", file.display())]
    TooGreat { file: PathBuf, name: String },
    #[error("{}: larger than {LARGEST_MIB} MiB; is it the right file?", file.display())]
    TooLarge { file: PathBuf },
    #[error("{}: not UTF-8 text, so no estimate.json", file.display())]
    NotUtf8 { file: PathBuf },
}

impl Estimates {
    /// Reads the file of an estimate of `problem`.
    pub fn read(file: &Path, problem: &Problem) -> Result<Self, EstimateError> {
        let file = file.to_owned();
        let text = match at_most(&file, LARGEST_MIB << 20) {
            Ok(text) => text,
            Err(source) if source.kind() == io::ErrorKind::FileTooLarge => {
                return Err(EstimateError::TooLarge { file });
            }
            Err(source) => return Err(EstimateError::Unreadable { file, source }),
        };
        let Ok(text) = String::from_utf8(text) else { return Err(EstimateError::NotUtf8 { file }) };
        let estimates: Self = match serde_json::from_str(&text) {
            Ok(estimates) => estimates,
            Err(source) => return Err(EstimateError::Syntax { file, source }),
        };
        if estimates.problem != problem.name {
            let expected = problem.name.clone();
            return Err(EstimateError::OtherProblem { file, found: estimates.problem, expected });
        }
        let mut names = HashSet::new();
        for entry in &estimates.parameters {
            if !names.insert(entry.name.as_str()) {
                return Err(EstimateError::Twice { file, name: entry.name.clone() });
            }
            if !(entry.estimate.abs() <= GREATEST && entry.nominal.abs() <= GREATEST) {
                return Err(EstimateError::TooGreat { file, name: entry.name.clone() });
            }
        }
        Ok(Self { file, ..estimates })
    }

    /// The model that the estimates are of, given the declared one.
    pub fn model(&self, declared: Model) -> Model {
        let rigid = self.strategy.as_deref() == Some(Strategy::Rigid.as_str());
        if rigid { Strategy::Rigid.model(declared) } else { declared }
    }

    /// The full parameter vector of a model of the problem, once the estimates are known to be of that.
    pub fn vector(&self, problem: &Problem, model: &Model) -> Result<DVector<f64>, EstimateError> {
        let file = || self.file.clone();
        for entry in &self.parameters {
            let Some(own) = model.parameters.iter().find(|parameter| parameter.name == entry.name) else {
                // Sessions that the model does not have.
                if entry.name.starts_with("base[") || entry.name.starts_with("tool[") {
                    continue;
                }
                return Err(EstimateError::NotFree { file: file(), name: entry.name.clone() });
            };
            if (own.nominal - entry.nominal).abs() > 1e-9 * own.nominal.abs().max(1.0) {
                let (name, found, expected) = (entry.name.clone(), entry.nominal, own.nominal);
                return Err(EstimateError::OtherNominal { file: file(), name, found, expected });
            }
        }
        if self.arm_digest.as_ref().is_some_and(|digest| *digest != problem.digest()) {
            return Err(EstimateError::OtherArm { file: file() });
        }
        let values: HashMap<&str, f64> = self.parameters.iter().map(|own| (own.name.as_str(), own.estimate)).collect();
        model.vector_of(|name| values.get(name).copied()).map_err(|name| EstimateError::Missing { file: file(), name })
    }

    /// Words in brackets behind `base` or `tool`, in the order of the file; one that is empty where there are none.
    pub fn words(&self, of: &str) -> Vec<String> {
        let mut words: Vec<String> = Vec::new();
        for entry in &self.parameters {
            let word = entry
                .name
                .strip_prefix(of)
                .and_then(|rest| rest.strip_prefix('[')?.split_once(']'))
                .map(|(word, _)| word);
            if let Some(word) = word.filter(|word| !words.iter().any(|known| known == word)) {
                words.push(word.to_owned());
            }
        }
        if words.is_empty() { vec![String::new()] } else { words }
    }
}
