//! Problems and tables read from texts.

#![expect(clippy::unwrap_used, clippy::panic, reason = "a test that fails may panic")]

use std::path::{Path, PathBuf};

use flexcal::error::{InputError, Warning, WarningKind};
use flexcal::measurement::{Dataset, Measurements};
use flexcal::problem::Problem;

use super::program::Folder;

/// Returns the error of a problem's text.
#[track_caller]
pub fn problem_error(text: &str) -> InputError {
    match Problem::parse(text, Path::new("problem.toml")) {
        Err(error) => error,
        Ok(_) => panic!("accepted:\n{text}"),
    }
}

/// Writes tables to a folder and returns their paths.
fn files<T: AsRef<[u8]>>(folder: &Folder, tables: &[(&str, T)]) -> Vec<PathBuf> {
    let write = |(name, text): &(&str, T)| {
        folder.write(name, text);
        folder.path(name)
    };
    tables.iter().map(write).collect()
}

/// Reads tables of measurements, given by their names and texts.
pub fn read_tables<T: AsRef<[u8]>>(
    problem: &Problem,
    tables: &[(&str, T)],
) -> Result<(Measurements, Vec<Warning>), InputError> {
    let folder = Folder::new();
    Measurements::read(&files(&folder, tables), problem)
}

/// Reads one table of measurements, `rows.csv`.
pub fn try_table(
    problem: &Problem,
    text: &str,
) -> Result<(Measurements, Vec<Warning>), InputError> {
    read_tables(problem, &[("rows.csv", text)])
}

#[track_caller]
pub fn read_table(problem: &Problem, text: &str) -> Measurements {
    try_table(problem, text).unwrap().0
}

/// Returns the error of a table of measurements.
#[track_caller]
pub fn table_error(problem: &Problem, text: &str) -> InputError {
    match try_table(problem, text) {
        Err(error) => error,
        Ok(_) => panic!("accepted:\n{text}"),
    }
}

/// Reads a table of poses, which need no measurement.
pub fn try_poses(
    problem: &Problem,
    text: &str,
) -> Result<(Measurements, Vec<Warning>), InputError> {
    let folder = Folder::new();
    Measurements::read_poses(&files(&folder, &[("rows.csv", text)]), problem)
}

/// Reads a table of measurements and splits its rows.
pub fn try_dataset(problem: &Problem, text: &str) -> Result<Dataset, InputError> {
    let folder = Folder::new();
    Dataset::read_files(&files(&folder, &[("rows.csv", text)]), problem).map(|(data, _)| data)
}

#[track_caller]
pub fn read_dataset(problem: &Problem, text: &str) -> Dataset {
    try_dataset(problem, text).unwrap()
}

/// Asserts that the message of an error contains every one of `expected`.
#[track_caller]
pub fn assert_says(error: &InputError, expected: &[&str]) {
    super::program::assert_contains(&error.to_string(), expected);
}

/// Asserts that one warning is of this kind, and returns its line.
#[track_caller]
pub fn assert_warned(warnings: &[Warning], kind: &WarningKind) -> Option<usize> {
    let warning = warnings.iter().find(|warning| warning.kind == *kind);
    warning.unwrap_or_else(|| panic!("no {kind:?} in {warnings:#?}")).location.line
}

/// Returns the texts of warnings, a line each.
pub fn words(warnings: &[Warning]) -> String {
    warnings.iter().map(ToString::to_string).fold(String::new(), |text, line| text + &line + "\n")
}
