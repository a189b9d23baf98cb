//! Sentences of `identify` on active limits and on alternating stages.

use super::document::Block;
use crate::fit::{ActiveConstraint, Alternation, Estimate, Identification, ShadowPrice};
use crate::least_squares::solver::AtBound;
use crate::quantity::Unit;
use crate::quantity::format::{decimals, number, two_digits};

/// Lists the costs of active bounds and constraints, if there are any.
pub(super) fn shadow_prices<'a>(found: &Identification) -> Option<Block<'a>> {
    let line = |name: &str, price: ShadowPrice, unit: Unit| {
        let (fall, per) = price.in_mm(unit);
        format!("{name}: {} mm for 1 {per}", two_digits(fall, 6))
    };
    let bound = |estimate: &Estimate| {
        let side = if estimate.at_bound? == AtBound::Lower { "lower" } else { "upper" };
        Some(line(
            &format!("{}, {side} bound", estimate.name),
            estimate.shadow_price?,
            estimate.unit,
        ))
    };
    let constraint =
        |active: &ActiveConstraint| line(&active.words, active.shadow_price, active.unit);
    let bounds = found.estimates.iter().filter_map(bound);
    let points: Vec<String> =
        bounds.chain(found.active_constraints.iter().map(constraint)).collect();
    let words =
        "Cost of active limits (decrease of the rms residual of the fit if the limit moves out):"
            .to_owned();
    (!points.is_empty()).then_some(Block::Lines(words, points))
}

/// States the rate at which a sequential strategy converges without acceleration.
pub(super) fn alternation<'a>(found: &Identification) -> Option<Block<'a>> {
    let Alternation { sweeps, contraction } = found.alternation?;
    let slow = contraction.map_or_else(String::new, |rate| {
        format!(
            "; without acceleration each sweep would leave {} of the error",
            number(rate, decimals(1.0 - rate, 6))
        )
    });
    Some(Block::lines(format!(
        "Stiffness and geometry alternated in {sweeps} accelerated sweeps{slow}."
    )))
}
