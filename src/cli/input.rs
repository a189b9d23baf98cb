//! Arguments that most commands take, and the input files that they name.

use std::error::Error;
use std::ops::Deref;
use std::path::{Path, PathBuf};

use clap::Args;
use flexcal::error::{InputError, InputErrorKind, TableErrorKind, Warning, WarningKind};
use flexcal::fit::{self, Identification, SavedEstimate};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::problem::{Freedom, ParameterRule, Problem};
use flexcal::report::shell_word;

use super::diagnostic;
use super::flags::{Flags, file_in};
use super::output::{Results, WriteError};

/// Problem, data, and folder of the results.
#[derive(Debug, Args)]
pub struct Common {
    /// A problem.toml, or the folder that holds one [default: the current folder]
    #[arg(value_name = "PROBLEM")]
    named: Option<PathBuf>,
    /// Measurement files instead of those the problem names
    #[arg(long, value_name = "FILE", num_args = 1..)]
    data: Vec<PathBuf>,
    /// Joint tables instead of those that `joints` in [data] names
    #[arg(long, value_name = "FILE", num_args = 1..)]
    joints: Vec<PathBuf>,
    #[command(flatten)]
    pub flags: Flags,
}

/// Error that joint tables are given for a problem that does not join any.
#[derive(Debug, thiserror::Error)]
#[error(
    "--joints: {} joins no joint table; write joints = \
     {{ files = [\"controller.csv\"], by = \"time\" }} in [data]",
    file.display()
)]
struct NothingToJoin {
    file: PathBuf,
}

/// Gives access to the flags of every command.
impl Deref for Common {
    type Target = Flags;

    fn deref(&self) -> &Flags {
        &self.flags
    }
}

/// Problem with its data, and the folder and file names claimed for the results.
pub struct Input {
    pub problem: Problem,
    pub data: Dataset,
    pub results: Results,
}

/// Returns the problem and the files of `--data`, which takes all words that follow. If no problem
/// is `named`, the last of several words is the problem if it is a folder or a TOML file; otherwise
/// the problem is the current folder.
fn split<'a>(named: Option<&'a Path>, data: &'a [PathBuf]) -> (&'a Path, &'a [PathBuf]) {
    let is_problem =
        |path: &Path| path.is_dir() || path.extension().is_some_and(|ending| ending == "toml");
    match (named, data) {
        (Some(named), data) => (named, data),
        (None, [data @ .., last]) if !data.is_empty() && is_problem(last) => (last, data),
        (None, data) => (Path::new("."), data),
    }
}

impl Common {
    /// Returns the path of the problem's file or folder.
    pub fn problem(&self) -> &Path {
        split(self.named.as_deref(), &self.data).0
    }

    /// Formats the problem, and the measurement files named by `--data`, as arguments of a
    /// suggested command.
    pub fn problem_arguments(&self) -> String {
        format!("{}{}", shell_word(self.problem()), self.data_arguments())
    }

    /// Formats the measurement files named by `--data` as arguments that follow the problem; empty
    /// if there are none.
    pub fn data_arguments(&self) -> String {
        let data: Vec<String> =
            self.data().iter().map(|file| format!(" {}", shell_word(file))).collect();
        let data =
            if data.is_empty() { String::new() } else { format!(" --data{}", data.concat()) };
        let joints: Vec<String> =
            self.joints.iter().map(|file| format!(" {}", shell_word(file))).collect();
        if joints.is_empty() { data } else { format!("{data} --joints{}", joints.concat()) }
    }

    /// Reads the problem, with the joint tables of `--joints` instead of those it names.
    pub fn read_problem(&self) -> Result<Problem, Box<dyn Error>> {
        Ok(self.read_problem_with_text()?.0)
    }

    /// Does the same as [`read_problem`](Self::read_problem), and returns the text of the file.
    pub fn read_problem_with_text(&self) -> Result<(Problem, String), Box<dyn Error>> {
        let (mut problem, text) = Problem::read_with_text(self.problem())?;
        if !self.joints.is_empty() {
            let log = problem.data.joint_log.as_mut();
            let log = log.ok_or_else(|| NothingToJoin { file: self.problem_file() })?;
            (log.files, log.is_given) = (self.joints.clone(), true);
        }
        Ok((problem, text.to_string()))
    }

    /// Reads the measurement files with `read` and prints the warnings. If they cannot be read
    /// beside a joint table of other measurements, a warning names that table.
    pub fn read_rows(
        &self,
        problem: &Problem,
        read: impl Fn(&[PathBuf], &Problem) -> Result<(Measurements, Vec<Warning>), InputError>,
    ) -> Result<(Measurements, Vec<Warning>), InputError> {
        let rows = read(self.files(problem), problem);
        let kept = problem.data.joint_log.as_ref().filter(|log| !log.is_given);
        let is_of_pairs = |error: &InputError| {
            matches!(
                &*error.kind,
                InputErrorKind::Table(
                    TableErrorKind::NothingJoined { .. }
                        | TableErrorKind::MostUnpaired { .. }
                        | TableErrorKind::CommonPartner { .. }
                        | TableErrorKind::OtherRowsToPair { .. }
                )
            )
        };
        let are_others = !self.data().is_empty() && rows.as_ref().is_err_and(is_of_pairs);
        if let Some(log) = kept.filter(|_| are_others) {
            self.hint(log.files.first().map(|file| {
                format!(
                    "the joint table is still {}, which joints in [data] names; --joints FILE \
                     gives that of these measurements",
                    file.display()
                )
            }));
        }
        rows
    }

    /// Returns the measurement files named by `--data`; empty if those of the problem are used.
    pub fn data(&self) -> &[PathBuf] {
        split(self.named.as_deref(), &self.data).1
    }

    /// Claims the file names `names` for results of a `command`, then reads the problem and its
    /// measurements.
    pub fn read(&self, command: &'static str, names: &[&str]) -> Result<Input, Box<dyn Error>> {
        self.read_beside(command, &[], names)
    }

    /// Does the same as [`read`](Self::read) for a command that also reads the files `others`,
    /// which its results must not replace.
    pub fn read_beside(
        &self,
        command: &'static str,
        others: &[PathBuf],
        names: &[&str],
    ) -> Result<Input, Box<dyn Error>> {
        let problem = self.read_problem()?;
        let results = self.results(command, &problem, others, names)?;
        let data = self.measurements(&problem)?;
        Ok(Input { problem, data, results })
    }

    /// Reads the measurements of a problem, prints warnings, and splits the rows into
    /// identification and held-out rows.
    pub fn measurements(&self, problem: &Problem) -> Result<Dataset, InputError> {
        let (mut measurements, mut warnings) = self.read_rows(problem, Measurements::read)?;
        warnings.extend(measurements.row_warnings(problem));
        self.warn(&warnings);
        // Reports list the warnings of the measurements.
        measurements.warnings = warnings;
        Dataset::from_measurements(problem, measurements)
    }

    /// Warns if `rows` lack a load that the rows of an estimate had, and returns true then.
    pub fn warn_of_loads(
        &self,
        problem: &Problem,
        estimate: &SavedEstimate,
        rows: &Measurements,
    ) -> bool {
        let missing = fit::missing_loads(problem, estimate, rows);
        self.hint(&missing);
        !missing.is_empty()
    }

    /// Prints a warning if no parameter of the arm is free, unless the command is quiet.
    pub fn warn_if_nothing_is_free(&self, problem: &Problem) {
        let is_of_setup = |rule: &ParameterRule| {
            let is_placement = ["base", "tool"].iter().any(|name| rule.pattern.starts_with(name));
            is_placement || matches!(rule.freedom, Freedom::Fixed)
        };
        let rules = &problem.parameters;
        let is_arm_held = rules.iter().all(is_of_setup) && problem.effects.is_empty();
        if is_arm_held && !self.quiet {
            let subject = if rules.is_empty() { "no parameter" } else { "no parameter of the arm" };
            diagnostic::warn(&format!(
                "{subject} is free, so the nominal arm is judged; to identify it, write [parameters] with lines such as \
                 \"joint*.alpha\" = {{ sigma_deg = 1.0 }}, \"joint*.a\" = {{ sigma_mm = 5.0 }}, \"joint*.theta\" = {{ sigma_deg = 1.0 }}, \
                 \"joint*.d\" = {{ sigma_mm = 5.0 }}, \"base.*\" = {{ free = true }}"
            ));
        }
    }

    /// Warns if nothing was fitted although rules free parameters.
    pub fn warn_if_all_is_held(&self, problem: &Problem, found: &Identification) {
        let is_freed = |rule: &ParameterRule| !matches!(rule.freedom, Freedom::Fixed);
        if found.unknowns.is_empty() && problem.parameters.iter().any(is_freed) && !self.quiet {
            diagnostic::warn(
                "no parameter is fitted, although [parameters] frees some: later lines hold all of \
                 them, or no parameter of this arm has such a name",
            );
        }
    }

    /// Returns a line of text that says that the orientations of a table are not fitted; empty if
    /// they are, or if it has none.
    pub fn orientation_line(problem: &Problem, rows: &Measurements) -> &'static str {
        if rows.orientations.is_some() && !problem.data.fits_orientation {
            "\nThe orientations in the table are not fitted: orientation_sigma_deg in [data], \
             their 1 σ, fits them.\n"
        } else {
            ""
        }
    }

    /// Prints a warning if the problem fits orientations, which the search for effects ignores.
    /// Adds the warning to `data` for the reports.
    pub fn warn_of_orientation(&self, problem: &Problem, data: &mut Dataset) {
        if problem.data.fits_orientation {
            let warning = Warning {
                location: problem.data.location.clone(),
                kind: WarningKind::OrientationLeftOut,
            };
            self.warn(std::slice::from_ref(&warning));
            data.measurements.warnings.push(warning);
        }
    }

    /// Claims the file names `names` for results of a `command` that reads the problem, its data
    /// and the files `others`.
    pub fn results(
        &self,
        command: &'static str,
        problem: &Problem,
        others: &[PathBuf],
        names: &[&str],
    ) -> Result<Results, WriteError> {
        let file = [self.problem_file()];
        let joint_files =
            problem.data.joint_log.as_ref().map_or(&[][..], |log| log.files.as_slice());
        let inputs = [&file, others, &problem.data.files, joint_files, self.data()].concat();
        self.claim(command, &self.results_name(problem), inputs, names)
    }

    /// Returns the measurement files: those of `--data`, or else those that the problem names.
    pub fn files<'a>(&'a self, problem: &'a Problem) -> &'a [PathBuf] {
        if self.data().is_empty() { &problem.data.files } else { self.data() }
    }

    /// Returns the path of the problem file.
    pub fn problem_file(&self) -> PathBuf {
        file_in(self.problem(), "problem.toml")
    }

    /// Returns the name of the default folder of the results: the problem's name, and for a file
    /// `problem.VARIANT.toml` its variant, as in `arm-closed`.
    fn results_name(&self, problem: &Problem) -> String {
        let file = self.problem_file();
        let variant = file.file_stem().and_then(|stem| stem.to_str()?.strip_prefix("problem."));
        variant
            .map_or_else(|| problem.name.clone(), |variant| format!("{}-{variant}", problem.name))
    }
}
