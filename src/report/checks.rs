//! Checks of what a fit leaves, for programs and for people.

use serde::Serialize;

use crate::diagnosis::{Check, Findings};

/// One check.
#[derive(Debug, Serialize)]
pub(super) struct Entry<'a> {
    check: &'static str,
    about: Option<&'a str>,
    structure: bool,
    failed: bool,
    statistic: Option<f64>,
    /// Where chance keeps the statistic.
    bounds: Option<[f64; 2]>,
    p_value: Option<f64>,
    words: String,
}

impl<'a> From<&'a Check> for Entry<'a> {
    fn from(check: &'a Check) -> Self {
        let outcome = check.outcome.as_ref().ok();
        Self {
            check: check.name(),
            about: check.about(),
            structure: check.is_structure(),
            failed: check.failed(),
            statistic: outcome.map(|outcome| outcome.statistic),
            bounds: outcome.map(|outcome| outcome.bounds.into()),
            p_value: outcome.map(|outcome| outcome.p_value),
            words: check.to_string(),
        }
    }
}

/// Every check.
pub(super) fn entries(findings: &Findings) -> Vec<Entry<'_>> {
    findings.checks.iter().map(Entry::from).collect()
}

/// The checks that failed, in words.
pub(super) fn failed(findings: &Findings) -> Vec<String> {
    findings.checks.iter().filter(|check| check.failed()).map(ToString::to_string).collect()
}

/// Every check in words with its verdict, those that failed first.
pub(super) fn all(findings: &Findings) -> Vec<String> {
    let verdict = |check: &&Check| match (&check.outcome, check.failed()) {
        (_, true) => 0,
        (Ok(_), false) => 1,
        (Err(_), false) => 2,
    };
    let mut checks: Vec<&Check> = findings.checks.iter().collect();
    checks.sort_by_key(verdict);
    let words = |check: &Check| match verdict(&check) {
        0 => format!("failed: {check}"),
        1 => format!("passed: {check}"),
        _ => check.to_string(),
    };
    checks.into_iter().map(words).collect()
}
