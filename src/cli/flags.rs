//! Arguments of every command that writes results.

use std::path::{Path, PathBuf};

use clap::Args;
use flexcal::error::Warning;

use super::diagnostic;
use super::output::{self, Results, WriteError};

/// Smallest tolerance that is plausible \[mm\]: arms repeat to some hundredths of a millimetre.
const MIN_TOLERANCE_MM: f64 = 1e-3;

/// Returns true if a tolerance \[mm\] is too small for an arm, as one in metres is.
pub fn is_tiny(tolerance_mm: f64) -> bool {
    tolerance_mm < MIN_TOLERANCE_MM
}

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

    /// Prints a warning for each of some texts unless the command is quiet.
    pub fn hint(&self, words: impl IntoIterator<Item = impl AsRef<str>>) {
        words.into_iter().filter(|_| !self.quiet).for_each(|text| diagnostic::warn(text.as_ref()));
    }

    /// Warns of a tolerance \[mm\] that is too small for an arm, as one in metres is.
    pub fn warn_if_tiny(&self, tolerance_mm: Option<f64>) {
        self.hint(tolerance_mm.filter(|mm| is_tiny(*mm)).map(|tolerance| {
            format!(
                "a tolerance of {tolerance} mm is below what an arm holds; if it is in metres, \
                 write --tolerance-mm {}",
                (tolerance * 1e9).round() / 1e6
            )
        }));
    }

    /// Prints warnings unless the command is quiet.
    pub fn warn(&self, warnings: &[Warning]) {
        self.hint(warnings.iter().map(ToString::to_string));
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
