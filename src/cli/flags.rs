//! Arguments of every command that writes results.

use std::path::{Path, PathBuf};

use clap::Args;
use flexcal::error::Warning;

use super::diagnostic;
use super::output::{self, Results, WriteError};

/// Arguments for the folder of the results and the format of the output.
#[derive(Debug, Clone, Args)]
pub struct Flags {
    /// Folder for results [default: out/<name of the problem>]
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Also replace files that flexcal did not write or that were changed since, and files that
    /// this command or the problem reads
    #[arg(long)]
    pub force: bool,
    /// Print the result as JSON on standard output, and nothing else
    #[arg(long)]
    pub json: bool,
    /// Print nothing but errors (and the JSON, if requested)
    #[arg(short, long)]
    pub quiet: bool,
}

impl Flags {
    /// Returns true if the output is text for people: neither JSON nor quiet.
    pub fn prints_text(&self) -> bool {
        !self.json && !self.quiet
    }

    /// Prints a result: the text `json` if JSON is requested, else the text that `words` returns;
    /// nothing if quiet.
    pub fn print_result(
        &self,
        json: &str,
        words: impl FnOnce() -> String,
    ) -> Result<(), WriteError> {
        match (self.json, self.quiet) {
            (true, _) => output::print_json(json),
            (false, true) => Ok(()),
            (false, false) => output::print(&words()),
        }
    }

    /// Prints warnings unless the command is quiet.
    pub fn warn(&self, warnings: &[Warning]) {
        if !self.quiet {
            diagnostic::print_warnings(warnings);
        }
    }

    /// Returns the folder for the results of the problem or study with this `name`.
    pub fn folder(&self, name: &str) -> PathBuf {
        self.out.clone().unwrap_or_else(|| Path::new("out").join(name))
    }

    /// Claims the file names `names` for the results of a `command` that reads `inputs`. `name` is
    /// that of the problem or study, after which the default folder is called.
    pub fn claim(
        &self,
        command: &'static str,
        name: &str,
        inputs: Vec<PathBuf>,
        names: &[&str],
    ) -> Result<Results, WriteError> {
        Results::claim(command, self.folder(name), inputs, names, (self.force, self.quiet))
    }
}

/// Returns the path of a file that is named itself or by its folder, in which it is called `name`.
pub fn file_in(path: &Path, name: &str) -> PathBuf {
    if path.is_dir() { path.join(name) } else { path.to_owned() }
}
