//! Tests of what a fit leaves, for programs and for people.

use super::document::{Block, Mark, Point};
use super::quantity::number;
use crate::residual_tests::{Findings, ResidualTest, Test};

/// The tests that failed, in words.
pub(super) fn failed(findings: &Findings) -> Vec<String> {
    findings.tests.iter().filter(|check| check.failed()).map(ToString::to_string).collect()
}

/// Why the tests name another χ²/ν than the fit's own `chi2`; nothing where both read the same.
pub(super) fn another_size(findings: &Findings, chi2: Option<f64>) -> Option<String> {
    let size = findings
        .tests
        .iter()
        .find(|check| check.test == Test::ReducedChiSquared)?
        .outcome
        .as_ref()
        .ok()?;
    (number(size.statistic, 2) != number(chi2?, 2)).then(|| {
        "The checks have a χ²/ν of their own: they leave outliers out and let stiffnesses that the problem holds equal \
         differ."
            .to_owned()
    })
}

fn point(check: &ResidualTest) -> Point {
    let mark = match (&check.outcome, check.failed()) {
        (Err(_), _) => Mark::Untested,
        (Ok(_), true) => Mark::Failed,
        (Ok(_), false) => Mark::Passed,
    };
    Point { text: check.to_string(), mark: Some(mark), ..Point::default() }
}

/// Every test with its verdict: those that failed, those that passed, those that could not be made;
/// covariates that nothing depends on in one line.
pub(super) fn all(findings: &Findings) -> Vec<Point> {
    let of = |mark: Mark| {
        findings
            .tests
            .iter()
            .map(|check| (check, point(check)))
            .filter(move |(_, own)| own.mark == Some(mark))
    };
    let (free, other): (Vec<_>, Vec<_>) =
        of(Mark::Passed).partition(|(check, _)| matches!(check.test, Test::Dependence { .. }));
    let free: Vec<String> =
        free.iter().filter_map(|(check, _)| Some(check.about()?.to_string())).collect();
    let free = (!free.is_empty()).then(|| Point {
        text: format!("residuals do not depend beyond chance on {}", free.join(", ")),
        mark: Some(Mark::Passed),
        ..Point::default()
    });
    let points = of(Mark::Failed).chain(other).map(|(_, point)| point).chain(free);
    points.chain(of(Mark::Untested).map(|(_, point)| point)).collect()
}

/// Every test in the order in which they were made.
pub(super) fn each(findings: &Findings) -> Vec<Point> {
    findings.tests.iter().map(point).collect()
}

/// Every test: in brief in words, each by itself on the page.
pub(super) fn blocks<'a>(findings: &Findings) -> Vec<Block<'a>> {
    let (brief, page) = (Block::List(all(findings)), Block::List(each(findings)));
    vec![Block::Words(vec![brief]), Block::Page(vec![page])]
}
