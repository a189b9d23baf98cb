//! Arguments that every command takes, and the input they name.

use std::path::{Path, PathBuf};

use clap::Args;
use flexcal::error::InputError;
use flexcal::measurement::{Dataset, Measurements};
use flexcal::problem::Problem;

use super::diagnostic;

/// Problem, data, and where results go.
#[derive(Debug, Args)]
pub struct Common {
    /// A problem.toml, or the folder that holds one
    pub problem: PathBuf,
    /// Measurement files instead of those the problem names
    #[arg(long, value_name = "FILE", num_args = 1..)]
    pub data: Vec<PathBuf>,
    /// Folder for results [default: out/<name of the problem>]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print the result as JSON on standard output, and nothing else
    #[arg(long)]
    pub json: bool,
    /// Print nothing but errors (and the JSON, where it is asked for)
    #[arg(long)]
    pub quiet: bool,
}

/// Everything that was read.
pub struct Input {
    pub problem: Problem,
    pub data: Dataset,
}

impl Common {
    /// Reads the problem and its measurements.
    pub fn read(&self) -> Result<Input, InputError> {
        let problem = Problem::read(&self.problem)?;
        let (measurements, warnings) = Measurements::read(self.files(&problem), &problem)?;
        if !self.quiet {
            diagnostic::print_warnings(&warnings);
        }
        let data = Dataset::of(&problem, measurements)?;
        Ok(Input { problem, data })
    }

    /// The measurement files.
    pub fn files<'a>(&'a self, problem: &'a Problem) -> &'a [PathBuf] {
        if self.data.is_empty() { &problem.data.files } else { &self.data }
    }

    /// The problem file itself.
    pub fn problem_file(&self) -> PathBuf {
        if self.problem.is_dir() { self.problem.join("problem.toml") } else { self.problem.clone() }
    }

    /// Folder for the results of `problem`.
    pub fn folder(&self, problem: &Problem) -> PathBuf {
        self.out.clone().unwrap_or_else(|| Path::new("out").join(&problem.name))
    }

    /// Whether people read along.
    pub fn talks(&self) -> bool {
        !self.json && !self.quiet
    }
}
