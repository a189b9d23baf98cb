//! `flexcal compensate`.

use std::collections::HashMap;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use clap::Args;
use flexcal::measurement::Measurements;
use flexcal::model::Model;
use flexcal::problem::Problem;
use flexcal::{identify, report};
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

#[derive(Debug, Deserialize)]
struct Estimates {
    problem: String,
    /// Not there in what older versions wrote.
    arm_digest: Option<String>,
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
    let (targets, warnings) = Measurements::read(&common.data, &problem)?;
    if !common.quiet {
        diagnostic::print_warnings(&warnings);
    }
    let placement = identify::Placement::of(&targets);
    let model = Model::new(&problem, &placement.bases, &placement.targets)?;
    let (values, trusted) = read(&arguments.estimate, &problem, &model)?;
    if !trusted && !common.quiet {
        diagnostic::warn("the estimate is not to be trusted, and so are the commands not");
    }
    let x = model
        .vector_of(|name| values.get(name).copied())
        .map_err(|name| EstimateError::Missing { file: arguments.estimate.clone(), name })?;
    let commands = identify::compensate(&problem, &model, &x, &targets)?;
    let folder = common.folder(&problem);
    let path = output::write(&folder, "commands.csv", &report::commands_csv(&problem, &targets, &commands))?;
    if common.json {
        output::print(&report::commands_json(&problem, &commands))?;
    } else if common.talks() {
        output::print(&report::commands_text(&problem, &targets, &commands))?;
        output::print(&format!("\nWritten to {}\n", path.display()))?;
    }
    let all = commands.iter().all(identify::Command::is_reached);
    Ok(if all && trusted { Outcome::Done } else { Outcome::NotTrusted })
}

/// Estimates by name, once they are known to be of this problem, and whether they are to be trusted.
fn read(file: &Path, problem: &Problem, model: &Model) -> Result<(HashMap<String, f64>, bool), EstimateError> {
    let file = file.to_owned();
    let text = match fs::read_to_string(&file) {
        Ok(text) => text,
        Err(source) => return Err(EstimateError::Unreadable { file, source }),
    };
    let estimates: Estimates = match serde_json::from_str(&text) {
        Ok(estimates) => estimates,
        Err(source) => return Err(EstimateError::Syntax { file, source }),
    };
    if estimates.problem != problem.name {
        return Err(EstimateError::OtherProblem { file, found: estimates.problem, expected: problem.name.clone() });
    }
    for entry in &estimates.parameters {
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
    Ok((values, estimates.trusted))
}
