//! Shared functions of the input tests.

use std::path::Path;

use flexcal::error::InputError;
use flexcal::measurement::Split;
use flexcal::problem::Problem;

use crate::common::program::assert_contains;
use crate::common::reading::{problem_error, read_tables};

pub const ARM: &str = "name = 'arm'\n[[joint]]\n";

pub fn problem(text: &str) -> Result<Problem, InputError> {
    Problem::parse(text, Path::new("problem.toml"))
}

/// Asserts that a message is one line that contains every word.
pub fn check(error: &InputError, mistake: &str, words: &[&str]) {
    let message = error.to_string();
    assert!(!message.contains('\n'), "{mistake}: {message}");
    assert_contains(&message, words);
}

/// Asserts that each piece of text, placed after the first joint, is an error whose message
/// contains the words.
pub fn check_problems(mistakes: &[(&str, &[&str])]) {
    for (text, words) in mistakes {
        let error = problem_error(&format!("{ARM}{text}\n"));
        check(&error, text, &["problem.toml:"]);
        check(&error, text, words);
    }
}

/// Reads one table and splits its rows.
pub fn table(problem_text: &str, table: &[u8]) -> Result<Split, InputError> {
    let problem = problem(problem_text)?;
    let (measurements, _) = read_tables(&problem, &[("rows.csv", table)])?;
    Split::new(&problem, &measurements)
}
