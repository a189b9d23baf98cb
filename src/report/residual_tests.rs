//! Tests of the residual of a fit, in words.

use super::document::{Block, Mark, Point};
use crate::fit::Identification;
use crate::quantity::format::{counted, number};
use crate::residual_tests::{ResidualTest, ResidualTests, Test};

/// Describes the failed tests, one sentence each.
pub(super) fn failed(tests: &ResidualTests) -> Vec<String> {
    tests.tests.iter().filter(|check| check.failed()).map(ToString::to_string).collect()
}

/// States why the tests have another χ²/ν than the fit; `None` if both agree in the shown digits,
/// or if no reason is known.
pub(super) fn other_reduced_chi2(tests: &ResidualTests, fit: &Identification) -> Option<String> {
    let size = tests
        .tests
        .iter()
        .find(|check| check.test == Test::ReducedChiSquared)?
        .outcome
        .as_ref()
        .ok()?;
    let is_elastic = fit.unknowns.iter().any(|name| name.ends_with("stiffness"));
    let reasons = [
        (fit.orientation.is_some(), "take positions alone"),
        (!tests.outliers.is_empty(), "leave out outliers"),
        (is_elastic, "also free the stiffnesses that the fit keeps equal"),
    ];
    let reasons: Vec<&str> =
        reasons.iter().filter(|(holds, _)| *holds).map(|(_, reason)| *reason).collect();
    let differ = number(size.statistic, 2) != number(fit.reduced_chi2?, 2);
    (differ && !reasons.is_empty()).then(|| {
        format!(
            "χ²/ν of the tests and its expected range differ from those of the fit, because the \
             tests {}.",
            reasons.join(" and ")
        )
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

/// Lists the tests: failed ones, passed ones, then those that could not be made. All quantities on
/// which the residual does not depend share one item.
pub(super) fn by_outcome(tests: &ResidualTests) -> Vec<Point> {
    let of = |mark: Mark| {
        tests
            .tests
            .iter()
            .map(|check| (check, point(check)))
            .filter(move |(_, point)| point.mark == Some(mark))
    };
    let (free, other): (Vec<_>, Vec<_>) =
        of(Mark::Passed).partition(|(check, _)| matches!(check.test, Test::Dependence { .. }));
    let free: Vec<String> =
        free.iter().filter_map(|(check, _)| Some(check.about()?.to_string())).collect();
    let free = (!free.is_empty()).then(|| Point {
        text: format!("residuals do not depend significantly on {}", free.join(", ")),
        mark: Some(Mark::Passed),
        ..Point::default()
    });
    let points = of(Mark::Failed).chain(other).map(|(_, point)| point).chain(free);
    points.chain(of(Mark::Untested).map(|(_, point)| point)).collect()
}

/// Returns the tests as blocks after the points `before`: grouped by outcome in texts; on the page
/// one by one, the passed ones folded.
pub(super) fn blocks_after<'a>(before: Vec<Point>, tests: &ResidualTests) -> Vec<Block<'a>> {
    let (passed, other): (Vec<Point>, Vec<Point>) =
        tests.tests.iter().map(point).partition(|point| point.mark == Some(Mark::Passed));
    let brief = before.iter().cloned().chain(by_outcome(tests)).collect();
    let listed: Vec<Point> = before.into_iter().chain(other).collect();
    let mut page: Vec<Block> =
        (!listed.is_empty()).then_some(Block::List(listed)).into_iter().collect();
    if !passed.is_empty() {
        let title = format!("{} passed", counted(passed.len(), "test"));
        let names = by_outcome(tests).into_iter().filter(|point| point.mark == Some(Mark::Passed));
        let on_paper: Vec<String> = names.map(|point| point.text).collect();
        let on_paper = format!("{title}: {}.", on_paper.join("; "));
        page.push(Block::Folded(title, vec![Block::List(passed)], on_paper));
    }
    vec![Block::Words(vec![Block::List(brief)]), Block::Page(page)]
}

/// Returns the tests as blocks: grouped by outcome in texts; on the page one by one, the passed ones
/// folded.
pub(super) fn blocks<'a>(tests: &ResidualTests) -> Vec<Block<'a>> {
    blocks_after(Vec::new(), tests)
}
