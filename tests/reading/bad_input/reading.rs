//! Shared functions of the input tests.

use std::fs;
use std::path::Path;

use flexcal::error::InputError;
use flexcal::measurement::{Measurements, Split};
use flexcal::problem::Problem;
use tempfile::TempDir;

pub const ARM: &str = "name = 'arm'\n[[joint]]\n";

pub fn problem(text: &str) -> Result<Problem, InputError> {
    Problem::parse(text, Path::new("problem.toml"))
}

/// Asserts that a message is one line that contains every word.
pub fn check(error: &InputError, mistake: &str, words: &[&str]) {
    let message = error.to_string();
    assert!(!message.contains('\n'), "{mistake}: {message}");
    for word in words {
        assert!(message.contains(word), "{mistake}: no `{word}` in: {message}");
    }
}

/// Asserts that each piece of text, placed after the first joint, is an error whose message
/// contains the words.
pub fn check_problems(mistakes: &[(&str, &[&str])]) {
    for (text, words) in mistakes {
        let error = problem(&format!("{ARM}{text}\n")).expect_err(text);
        check(&error, text, &["problem.toml:"]);
        check(&error, text, words);
    }
}

/// Reads one table from a file and splits its rows.
pub fn table(problem_text: &str, table: &[u8]) -> Result<Split, InputError> {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("rows.csv");
    fs::write(&file, table).unwrap();
    let problem = problem(problem_text)?;
    let (measurements, _) = Measurements::read(&[file], &problem)?;
    Split::new(&problem, &measurements)
}
