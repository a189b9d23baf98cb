//! Checks of what a fit leaves, for programs and for people.

use serde::Serialize;

use super::quantity::number;
use crate::diagnose::{Covariate, Findings, ResidualTest, Test};

/// One check.
#[derive(Debug, Serialize)]
pub(super) struct Entry {
    check: &'static str,
    about: Option<String>,
    structure: bool,
    failed: bool,
    statistic: Option<f64>,
    /// Where chance keeps the statistic.
    bounds: Option<[f64; 2]>,
    p_value: Option<f64>,
    words: String,
}

impl From<&ResidualTest> for Entry {
    fn from(check: &ResidualTest) -> Self {
        let outcome = check.outcome.as_ref().ok();
        Self {
            check: check.name(),
            about: check.about().map(named),
            structure: check.is_structure(),
            failed: check.failed(),
            statistic: outcome.map(|outcome| outcome.statistic),
            bounds: outcome.map(|outcome| outcome.bounds.into()),
            p_value: outcome.map(|outcome| outcome.p_value),
            words: check.to_string(),
        }
    }
}

/// What a test is about: the order of the rows in the plural.
fn named(covariate: Covariate) -> String {
    if covariate == Covariate::Row { "rows".to_owned() } else { covariate.to_string() }
}

/// Every check.
pub(super) fn entries(findings: &Findings) -> Vec<Entry> {
    findings.tests.iter().map(Entry::from).collect()
}

/// The checks that failed, in words.
pub(super) fn failed(findings: &Findings) -> Vec<String> {
    findings.tests.iter().filter(|check| check.failed()).map(ToString::to_string).collect()
}

/// Why the checks name another χ²/ν than the fit's own `chi2`; nothing where both read the same.
pub(super) fn another_size(findings: &Findings, chi2: Option<f64>) -> Option<&'static str> {
    let size = findings.tests.iter().find(|check| check.test == Test::ReducedChiSquared)?.outcome.as_ref().ok()?;
    (number(size.statistic, 2) != number(chi2?, 2)).then_some(
        "The checks have a χ²/ν of their own: they leave outliers out and let stiffnesses that the problem holds equal \
         differ.",
    )
}

/// Every check in words with its verdict: those that failed, those that passed, those that could not be made.
pub(super) fn all(findings: &Findings) -> Vec<String> {
    let checks = findings.tests.iter();
    let mut lines: Vec<String> =
        checks.clone().filter(|check| check.failed()).map(|check| format!("failed: {check}")).collect();
    let passed = checks.clone().filter(|check| check.outcome.is_ok() && !check.failed());
    // Drivers that nothing depends on fill one line.
    let (free, other): (Vec<&ResidualTest>, Vec<&ResidualTest>) =
        passed.partition(|check| matches!(check.test, Test::Dependence { .. }));
    lines.extend(other.iter().map(|check| format!("passed: {check}")));
    if !free.is_empty() {
        let drivers: Vec<String> = free.iter().filter_map(|check| Some(check.about()?.to_string())).collect();
        lines.push(format!("passed: residuals do not depend beyond chance on {}", drivers.join(", ")));
    }
    lines.extend(checks.filter(|check| check.outcome.is_err()).map(ToString::to_string));
    lines
}
