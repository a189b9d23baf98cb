//! Expected standard errors in words, and the assumptions of forecasts.

use super::document::Block;
use crate::design::ExpectedParameter;
use crate::problem::{HeldOut, Problem};
use crate::quantity::Display;
use crate::quantity::format::{MAX_DECIMALS, counted, decimals, number, or_dash, two_digits};

/// Formats the nominal value and some standard errors \[SI\] of a parameter in a convenient unit.
/// Returns the table cells (name, nominal value, errors) and the unit.
pub(super) fn cells(expected: &ExpectedParameter, errors: &[Option<f64>]) -> (Vec<String>, String) {
    let unit = expected.unit.display(expected.nominal);
    let digits = errors
        .iter()
        .flatten()
        .map(|error| decimals(error * unit.factor, MAX_DECIMALS))
        .min()
        .unwrap_or(4)
        .min(4);
    let mut cells = vec![expected.name.clone(), number(expected.nominal * unit.factor, digits)];
    cells.extend(errors.iter().map(|&error| format_size(error, &unit)));
    (cells, unit.symbol)
}

/// States the assumptions of a forecast: that all of `fitted` poses are fitted, and that the target
/// is at its default place. `None` if neither needs saying.
pub(super) fn assumptions<'a>(
    problem: &Problem,
    expected: &[ExpectedParameter],
    fitted: Option<usize>,
) -> Option<Block<'a>> {
    let mut points = Vec::new();
    if let Some(HeldOut::Fraction { fraction, .. }) = &problem.data.held_out
        && let Some(fitted) = fitted
        && let Some(measured) = poses_to_measure(problem, fitted)
    {
        let share = 100.0 * fraction;
        points.push(format!(
            "All {} are fitted. held_out in [data] removes {} % of the measured poses from the fit: measure {measured} poses to fit as \
             many.",
            counted(fitted, "pose"),
            number(share, 1).trim_end_matches(".0"),
        ));
    }
    if problem.targets.is_empty()
        && problem.tool.target.norm() == 0.0
        && expected.iter().any(|parameter| parameter.name.starts_with("tool"))
    {
        points.push(
            "The target is the origin of the last frame (target_m = [0, 0, 0] in [tool]). Enter the place of your target: other points \
             give other figures."
                .to_owned(),
        );
    }
    (!points.is_empty()).then(|| Block::Lines("These figures assume:".to_owned(), points))
}

/// Returns the number of poses to measure so that `fitted` of them are fitted; `None` unless the
/// problem holds a fraction of the poses out.
pub(super) fn poses_to_measure(problem: &Problem, fitted: usize) -> Option<usize> {
    let Some(HeldOut::Fraction { fraction, .. }) = &problem.data.held_out else { return None };
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count of poses")]
    let measured = (fitted as f64 / (1.0 - fraction) - 1e-9).ceil() as usize;
    Some(measured)
}

/// Formats a size \[SI\] in `unit` with two significant digits; a dash for `None`.
pub(super) fn format_size(value: Option<f64>, unit: &Display) -> String {
    or_dash(value, |value| two_digits(value * unit.factor, MAX_DECIMALS))
}
