//! Sentences of the command `identify` on active limits and on the convergence of alternating
//! stages.

use super::document::Block;
use crate::fit::{ActiveConstraint, Alternation, Estimate, Identification, ShadowPrice};
use crate::least_squares::solver::AtBound;
use crate::quantity::Unit;
use crate::quantity::format::{decimals, number, two_digits};

/// Lists active bounds and constraints with their shadow prices; `None` if there are none.
pub(super) fn active_limits<'a>(found: &Identification) -> Option<Block<'a>> {
    let line = |name: &str, price: ShadowPrice, unit: Unit| {
        let (fall, per) = price.in_mm(unit);
        format!("{name}: {} mm for 1 {per}", two_digits(fall, 6))
    };
    let bound = |estimate: &Estimate| {
        let side = if estimate.at_bound? == AtBound::Lower { "lower" } else { "upper" };
        let name = format!("{}, {side} bound", estimate.name);
        Some(line(&name, estimate.shadow_price?, estimate.unit))
    };
    let constraint = |active: &ActiveConstraint| {
        let place = active.location.line.map_or_else(String::new, |line| format!("line {line}: "));
        line(&format!("{place}{}", active.words), active.shadow_price, active.unit)
    };
    let bounds = found.estimates.iter().filter_map(bound);
    let points: Vec<String> =
        bounds.chain(found.active_constraints.iter().map(constraint)).collect();
    let words = "Active limits and their cost: decrease of the rms residual if the limit is moved outwards \
                 by the stated amount\n(standard errors hold with these limits kept):"
        .to_owned();
    (!points.is_empty()).then_some(Block::Lines(words, points))
}

/// States the number of sweeps of a sequential strategy, and the rate of convergence without
/// acceleration; `None` for strategies without alternating stages.
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
