//! Result of `identify` on one screen.

use super::around::unsteady;
use super::document::Block;
use super::errors::noun;
use super::identify::{errors_by_axis, headline};
use super::noise::{carried, noise};
use super::parameters::correlated;
use super::quantity::{counted, number};
use super::render::text_within;
use crate::fit::{Estimate, Identification, size_of_kind};
use crate::problem::Problem;

/// A fit on one screen of so many columns, ending in a line break: errors, how large the residual
/// is, and what to look at.
pub fn estimate_brief(problem: &Problem, found: &Identification, columns: usize) -> String {
    let mut blocks = vec![
        headline(problem, found),
        Block::Table(errors_by_axis(found)),
        Block::lines(noise(problem, found)),
    ];
    blocks.extend(carried(found));
    blocks.push(Block::Lines(parameters(&found.estimates), worth_a_look(found)));
    text_within(&blocks, columns)
}

/// Whether the data, rather than its prior, say what a parameter is.
fn is_well(own: &Estimate) -> bool {
    own.at_bound.is_none() && own.fitted && own.identified > 0.9
}

/// Whether a fit found no parameter well.
pub fn tells_little(found: &Identification) -> bool {
    !found.estimates.iter().any(is_well)
}

/// How many parameters are known how well.
fn parameters(estimates: &[Estimate]) -> String {
    let count = |is: fn(&Estimate) -> bool| estimates.iter().filter(|own| is(own)).count();
    let held = count(|own| own.at_bound.is_some() || !own.fitted);
    let well = count(is_well);
    let in_part = count(|own| own.at_bound.is_none() && own.fitted && own.identified > 0.1) - well;
    let parts =
        [(in_part, "in part"), (estimates.len() - held - well - in_part, "hardly"), (held, "held")];
    let rest: Vec<String> =
        parts.iter().filter(|own| own.0 > 0).map(|(n, how)| format!(", {n} {how}")).collect();
    let rest = rest.concat();
    format!(
        "{} of {} identified well{rest}; -v lists them.",
        well,
        counted(estimates.len(), "parameter")
    )
}

/// What the tables would tell at length.
fn worth_a_look(found: &Identification) -> Vec<String> {
    let mut points = Vec::new();
    if let Some(own) = &found.orientation {
        let mean = |of: &crate::fit::Errors| number(of.held_out.mean.norm.to_degrees(), 4);
        points.push(format!(
            "orientation: {} ° before, {} ° after, mean of the held-out poses",
            mean(&own.registered),
            mean(&own.fitted)
        ));
    }
    let farthest = found.outliers.iter().max_by(|a, b| a.distance.total_cmp(&b.distance));
    points.extend(farthest.map(|own| {
        let n = counted(found.outliers.len(), noun(found));
        format!(
            "{n} too far off to be noise, the farthest {}: {}",
            own.location,
            size_of_kind(own.kind, own.error.norm(), 3)
        )
    }));
    points.extend(unsteady(found.spreads.iter().map(|own| &own.1)));
    let of_parameters =
        format!("of {} not identifiable", counted(found.unknowns.len(), "parameter"));
    let counts = [
        (found.identifiability().unidentifiable.len(), "combination", of_parameters.as_str()),
        (found.weak.len(), "combination", "seen too weakly"),
        (correlated(found).len(), "pair", "correlated by more than 0.9"),
        (found.active_constraints.len(), "constraint", "at its limit"),
    ];
    let counts = counts.into_iter().filter(|own| own.0 > 0);
    points.extend(counts.map(|(n, noun, what)| format!("{} {what}", counted(n, noun))));
    points
}
