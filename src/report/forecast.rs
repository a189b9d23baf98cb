//! Expected standard errors as people and programs read them.

use super::document::Block;
use super::quantity::{counted, decimals, number, or_dash, two_digits};
use crate::design::ExpectedParameter;
use crate::problem::{HeldOut, Problem};
use crate::quantity::Display;

/// Decimals of any value at most.
const MOST: usize = 6;

/// Nominal value and some errors \[SI\] of a parameter in a unit for display: cells, and the unit.
pub(super) fn cells(expected: &ExpectedParameter, errors: &[Option<f64>]) -> (Vec<String>, String) {
    let unit = expected.unit.display(expected.nominal);
    let digits = errors
        .iter()
        .flatten()
        .map(|error| decimals(error * unit.factor, MOST))
        .min()
        .unwrap_or(4)
        .min(4);
    let mut cells = vec![expected.name.clone(), number(expected.nominal * unit.factor, digits)];
    cells.extend(errors.iter().map(|&error| size(error, &unit)));
    (cells, unit.symbol)
}

/// What figures about poses to come take for granted: that all of `fitted` poses are fitted, and
/// where the target sits.
pub(super) fn assumptions<'a>(
    problem: &Problem,
    expected: &[ExpectedParameter],
    fitted: Option<usize>,
) -> Option<Block<'a>> {
    let mut points = Vec::new();
    if let (Some(HeldOut::Fraction { fraction, .. }), Some(fitted)) =
        (&problem.data.held_out, fitted)
    {
        let (share, measured) =
            (100.0 * fraction, (fitted as f64 / (1.0 - fraction) - 1e-9).ceil());
        points.push(format!(
            "All {} are fitted; held_out in [data] takes {} % of what is measured from the fit, so that it takes {measured} \
             poses to fit as many.",
            counted(fitted, "pose"),
            number(share, 1).trim_end_matches(".0"),
        ));
    }
    if problem.targets.is_empty()
        && problem.tool.target.norm() == 0.0
        && expected.iter().any(|own| own.name.starts_with("tool"))
    {
        points.push(
            "The target sits at the origin of the last frame (target_m = [0, 0, 0] in [tool]). Put in where yours sits: poses tell \
             other things of another point."
                .to_owned(),
        );
    }
    (!points.is_empty()).then(|| Block::Lines("These figures assume:".to_owned(), points))
}

/// A size \[SI\] with two digits that count.
pub(super) fn size(value: Option<f64>, unit: &Display) -> String {
    or_dash(value, |value| two_digits(value * unit.factor, MOST))
}
