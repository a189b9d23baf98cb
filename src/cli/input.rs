//! Arguments that every command takes, and the input they name.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Args;
use flexcal::error::InputError;
use flexcal::measurement::{Dataset, Measurements};
use flexcal::problem::Problem;

use super::diagnostic;
use super::output::{Results, WriteError};

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
    /// Replace files that this command or the problem reads, and files that flexcal did not write
    #[arg(long)]
    pub force: bool,
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
    pub results: Results,
}

impl Common {
    /// Reads the problem and its measurements, once `command` may write the results called `names`.
    pub fn read(&self, command: &'static str, names: &[&str]) -> Result<Input, Box<dyn Error>> {
        let problem = Problem::read(&self.problem)?;
        let results = self.results(command, &problem, &[], names)?;
        let data = self.measurements(&problem)?;
        Ok(Input { problem, data, results })
    }

    /// Reads the measurements of a problem.
    pub fn measurements(&self, problem: &Problem) -> Result<Dataset, InputError> {
        let (measurements, mut warnings) = Measurements::read(self.files(problem), problem)?;
        warnings.extend(measurements.repeated_rows());
        if !self.quiet {
            diagnostic::print_warnings(&warnings);
        }
        Dataset::of(problem, measurements)
    }

    /// Where `command` writes the results called `names`; besides problem and data it reads `others`.
    pub fn results(
        &self,
        command: &'static str,
        problem: &Problem,
        others: &[PathBuf],
        names: &[&str],
    ) -> Result<Results, WriteError> {
        let own = [self.problem_file()];
        let inputs = [&own, others, &problem.data.files, &self.data].concat();
        Results::claim(command, self.folder(problem), inputs, names, (self.force, self.quiet))
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
    fn folder(&self, problem: &Problem) -> PathBuf {
        self.out.clone().unwrap_or_else(|| Path::new("out").join(&problem.name))
    }

    /// Whether people read along.
    pub fn talks(&self) -> bool {
        !self.json && !self.quiet
    }
}
