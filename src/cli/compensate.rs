//! `flexcal compensate`.

use std::collections::{HashMap, HashSet};
use std::error::Error;
use std::io;
use std::path::{Path, PathBuf};

use clap::Args;
use flexcal::files::at_most;
use flexcal::identify::{self, Strategy};
use flexcal::measurement::Measurements;
use flexcal::model::Model;
use flexcal::problem::Problem;
use flexcal::report;
use serde::Deserialize;

use super::input::Common;
use super::outcome::Outcome;
use super::{diagnostic, output};

/// Arguments of `flexcal compensate`.
#[derive(Debug, Args)]
#[command(after_help = "The targets are a table like measurements: x_mm, y_mm, z_mm are where the arm should be, and \
q1_deg, … where to start from; of the configurations that reach a target the nearest to that is taken. Ranges of joints \
are kept where the problem gives them (min_deg, max_deg of a joint). A column session says whose base to use.

Examples:
  flexcal identify problems/lunar-sampler
  flexcal compensate problems/lunar-sampler --estimate out/lunar-sampler/estimate.json --data targets.csv")]
pub struct Arguments {
    #[command(flatten)]
    common: Common,
    /// The estimate.json of an identification of the same problem
    #[arg(long, value_name = "FILE")]
    estimate: PathBuf,
}

/// Largest estimate.json that is read [MiB].
const LARGEST_MIB: u64 = 256;
/// Largest value: its square is a number as well.
const GREATEST: f64 = 1e150;

#[derive(Debug, Deserialize)]
struct Estimates {
    problem: String,
    /// Not there in what older versions wrote.
    arm_digest: Option<String>,
    strategy: Option<String>,
    trusted: bool,
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
enum EstimateError {
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
    #[error("no targets; name them with --data")]
    NoTargets,
}

/// Finds commands, writes `commands.csv`, and says what they reach.
pub fn run(arguments: &Arguments) -> Result<Outcome, Box<dyn Error>> {
    let common = &arguments.common;
    if common.data.is_empty() {
        return Err(EstimateError::NoTargets.into());
    }
    let mut problem = Problem::read(&common.problem)?;
    // Targets are not split: every row is one.
    problem.data.held_out = None;
    let results =
        common.results("compensate", &problem, std::slice::from_ref(&arguments.estimate), &["commands.csv"])?;
    let (targets, warnings) = Measurements::read(&common.data, &problem)?;
    if !common.quiet {
        diagnostic::print_warnings(&warnings);
    }
    let placement = identify::Placement::of(&targets);
    let model = Model::new(&problem, &placement.bases, &placement.targets)?;
    let (values, trusted, model) = read(&arguments.estimate, &problem, model)?;
    if !trusted && !common.quiet {
        diagnostic::warn("the estimate is not to be trusted, and so are the commands not");
    }
    let x = model
        .vector_of(|name| values.get(name).copied())
        .map_err(|name| EstimateError::Missing { file: arguments.estimate.clone(), name })?;
    let commands = identify::compensate(&problem, &model, &x, &targets)?;
    results.write(&[("commands.csv", &report::commands_csv(&problem, &targets, &commands))])?;
    if common.json {
        output::print_json(&report::commands_json(&problem, &commands))?;
    } else if common.talks() {
        output::print(&report::commands_text(&problem, &targets, &commands))?;
        output::print(&format!("\nWritten to {}\n", results.path("commands.csv").display()))?;
    }
    let all = commands.iter().all(identify::Command::is_reached);
    Ok(if all && trusted { Outcome::Done } else { Outcome::NotTrusted })
}

/// Estimates by name, once they are known to be of this problem, whether they are to be trusted, and the model that they are
/// of, given the declared one.
fn read(file: &Path, problem: &Problem, model: Model) -> Result<(HashMap<String, f64>, bool, Model), EstimateError> {
    let file = file.to_owned();
    let text = match at_most(&file, LARGEST_MIB << 20) {
        Ok(text) => text,
        Err(source) if source.kind() == io::ErrorKind::FileTooLarge => return Err(EstimateError::TooLarge { file }),
        Err(source) => return Err(EstimateError::Unreadable { file, source }),
    };
    let Ok(text) = String::from_utf8(text) else { return Err(EstimateError::NotUtf8 { file }) };
    let estimates: Estimates = match serde_json::from_str(&text) {
        Ok(estimates) => estimates,
        Err(source) => return Err(EstimateError::Syntax { file, source }),
    };
    if estimates.problem != problem.name {
        return Err(EstimateError::OtherProblem { file, found: estimates.problem, expected: problem.name.clone() });
    }
    let rigid = estimates.strategy.as_deref() == Some(Strategy::Rigid.as_str());
    let model = if rigid { Strategy::Rigid.model(model) } else { model };
    let mut names = HashSet::new();
    for entry in &estimates.parameters {
        if !names.insert(entry.name.as_str()) {
            return Err(EstimateError::Twice { file, name: entry.name.clone() });
        }
        if !(entry.estimate.abs() <= GREATEST && entry.nominal.abs() <= GREATEST) {
            return Err(EstimateError::TooGreat { file, name: entry.name.clone() });
        }
        let Some(own) = model.parameters.iter().find(|parameter| parameter.name == entry.name) else {
            // Sessions that the targets do not use.
            if entry.name.starts_with("base[") || entry.name.starts_with("tool[") {
                continue;
            }
            return Err(EstimateError::NotFree { file, name: entry.name.clone() });
        };
        if (own.nominal - entry.nominal).abs() > 1e-9 * own.nominal.abs().max(1.0) {
            let (name, found, expected) = (entry.name.clone(), entry.nominal, own.nominal);
            return Err(EstimateError::OtherNominal { file, name, found, expected });
        }
    }
    if estimates.arm_digest.is_some_and(|digest| digest != problem.digest()) {
        return Err(EstimateError::OtherArm { file });
    }
    let values = estimates.parameters.into_iter().map(|entry| (entry.name, entry.estimate)).collect();
    Ok((values, estimates.trusted, model))
}
