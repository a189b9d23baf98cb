//! The model as C code equals the library; rigid tables describe the exported arm.

#![expect(clippy::unwrap_used, reason = "a test that fails may panic")]
#![expect(clippy::print_stderr, reason = "what is not installed is said")]

#[path = "../common/mod.rs"]
mod common;

mod code;
mod rigid;

use std::path::Path;
use std::process::{Command, Output};

use common::arms::path;

/// Runs flexcal in a folder.
fn flexcal(folder: &Path, words: &str) -> Output {
    let mut command = Command::new(assert_cmd::cargo::cargo_bin!("flexcal"));
    command.args(words.split_whitespace()).current_dir(folder).output().unwrap()
}

/// Returns a folder with the problem and measurements of the lunar sampler, identified.
fn lunar_sampler() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let cases = path("tests/cases");
    let rows = cases.join("a-none.csv");
    let run = format!("identify {} --data {} --out out --quiet", cases.display(), rows.display());
    assert!(flexcal(folder.path(), &run).status.success());
    folder
}
