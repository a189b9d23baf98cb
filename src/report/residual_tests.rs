//! Tests of the residual of a fit, in words.

use super::document::{Block, Mark, Point};
use crate::fit::Identification;
use crate::quantity::format::number;
use crate::residual_tests::{ResidualTest, ResidualTests, Test};

/// Describes the failed tests, one sentence each.
pub(super) fn failed(tests: &ResidualTests) -> Vec<String> {
    tests.tests.iter().filter(|check| check.failed()).map(ToString::to_string).collect()
}

/// States why the tests have another χ²/ν than the fit; `None` if both agree in the shown digits.
pub(super) fn other_reduced_chi2(
    tests: &ResidualTests,
    fit: &Identification,
) -> Option<Block<'static>> {
    let size = tests
        .tests
        .iter()
        .find(|check| check.test == Test::ReducedChiSquared)?
        .outcome
        .as_ref()
        .ok()?;
    let words = "χ²/ν of these tests is not that of the fit: the tests leave out outliers, and fit each stiffness by itself.";
    (number(size.statistic, 2) != number(fit.reduced_chi2?, 2))
        .then(|| Block::Text(words.to_owned()))
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

/// Lists the tests in the order in which they were made, one item each.
pub(super) fn in_order(tests: &ResidualTests) -> Vec<Point> {
    tests.tests.iter().map(point).collect()
}

/// Returns the tests as blocks: grouped by outcome in texts, one by one on the page.
pub(super) fn blocks<'a>(tests: &ResidualTests) -> Vec<Block<'a>> {
    let (brief, page) = (Block::List(by_outcome(tests)), Block::List(in_order(tests)));
    vec![Block::Words(vec![brief]), Block::Page(vec![page])]
}
