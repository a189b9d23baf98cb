//! Forecasts in words: expected standard errors, their assumptions, and how well planned poses
//! distinguish two effects.

use super::document::{Block, Table};
use crate::design::{ExpectedParameter, PairSeparation};
use crate::numeric::whole;
use crate::problem::{HeldOut, Problem};
use crate::quantity::Display;
use crate::quantity::format::{
    MAX_DECIMALS, counted, decimals, number, or_dash, p_value, two_digits,
};
use crate::results::SeparationResult;

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

/// Explains the dash of a missing standard error below a table of parameters; `None` if all have
/// one.
pub(super) fn undetermined_note(expected: &[ExpectedParameter]) -> Option<&'static str> {
    let is_open = |expected: &ExpectedParameter| expected.std_error.is_none();
    expected
        .iter()
        .any(is_open)
        .then_some("– for a standard error: the poses do not determine the parameter at all")
}

/// States the assumptions of a forecast: that all of `fitted` poses are fitted, and that the target
/// is at its default place. `at_hand` is the number of poses that are measured already. `None` if
/// neither needs saying.
pub(super) fn assumptions<'a>(
    problem: &Problem,
    expected: &[ExpectedParameter],
    (fitted, at_hand): (Option<usize>, usize),
) -> Option<Block<'a>> {
    let mut points = Vec::new();
    if let Some(HeldOut::Fraction { fraction, .. }) = &problem.data.held_out
        && let Some(fitted) = fitted
        && let Some(measured) = poses_to_measure(problem, fitted)
    {
        let share = 100.0 * fraction;
        let further = match at_hand {
            0 => format!("{measured} poses"),
            _ => format!("{} further poses", measured.saturating_sub(at_hand)),
        };
        points.push(format!(
            "All {} are fitted. held_out in [data] removes {} % of the measured poses from the fit: \
             measure {further} to fit as many.",
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
    Some(whole((fitted as f64 / (1.0 - fraction) - 1e-9).ceil()))
}

/// Formats a size \[SI\] in `unit` with two significant digits; a dash for `None`.
pub(super) fn format_size(value: Option<f64>, unit: &Display) -> String {
    or_dash(value, |value| two_digits(value * unit.factor, MAX_DECIMALS))
}

/// States how the plan changes the angle between the two effects; `None` if an angle is not known.
pub(super) fn separation_sentence(separated: &PairSeparation) -> Option<String> {
    let result = SeparationResult::new(separated);
    let [random, planned] = [result.random_angle_deg?, result.angle_deg?];
    Some(format!(
        "The angle between the two effects is {}° with these poses and {}° with random ones.",
        number(planned, 1),
        number(random, 1)
    ))
}

/// Returns the table of the angle, detectable sizes and p-values of the two effects, for planned
/// and for random poses.
pub(super) fn separation_blocks<'a>(separated: &PairSeparation) -> Vec<Block<'a>> {
    let result = SeparationResult::new(separated);
    let angle = |angle: Option<f64>| or_dash(angle, |angle| number(angle, 1));
    let cells = |cells: [&str; 4]| cells.map(str::to_owned).to_vec();
    let angles = [angle(result.random_angle_deg), angle(result.angle_deg)];
    let mut rows = vec![cells(["angle between them", &angles[0], &angles[1], "°"])];
    for effect in &result.effects {
        let unit = effect.unit.display(effect.prior_sigma);
        let show = |value: Option<f64>| format_size(value, &unit);
        let symbol = unit.symbol.as_str();
        let row =
            |name: &str, random, planned| cells([name, &show(random), &show(planned), symbol]);
        rows.push(cells([&effect.effect.declaration(), "", "", ""]));
        rows.push(row("  found from", effect.random_found_from, effect.found_from));
        rows.push(row("  told apart from", effect.random_told_from, effect.told_from));
        let at = format!("  p beside the other at {} {symbol}", show(Some(effect.size)));
        rows.push(cells([&at, &p_value(effect.random_p_value), &p_value(effect.p_value), ""]));
    }
    vec![
        Block::Table(Table::new(&["told apart", "random", "planned", "unit"], rows, &[0, 3])),
        Block::Text(
            "The angle is between the two effects after all parameters are fitted: at 0° nothing tells them apart, at 90° they have \
             nothing in common. An effect of the given size is found, or told apart from the other, in 80 of 100 such sets of \
             measurements. “p beside the other” is the p-value expected for an effect of this size if the other one is fitted, too. Random: median over sets of \
             as many random poses."
                .to_owned(),
        ),
    ]
}
