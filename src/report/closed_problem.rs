//! Text of `problem.closed.toml`: the text of the declared problem with the found effects added.

use std::path::PathBuf;

use toml_edit::TomlError;

use super::effect::{seen_ranges, values};
use crate::error::one_line;
use crate::problem::{Effect, Problem, edit};
use crate::quantity::format::p_value;
use crate::results::ParameterValue;
use crate::select::{ClosedLoop, Found, Status};

/// Returns the `text` of `problem` with the found effects added and the data files replaced by
/// `files` (measurements, then the joint table). The paths are relative to the folder of the new
/// file. Everything else, including comments, is unchanged.
///
/// # Errors
/// Returns an error if the text is not TOML.
pub fn closed_problem(
    text: &str,
    problem: &Problem,
    closure: &ClosedLoop,
    files: [&[PathBuf]; 2],
) -> Result<String, TomlError> {
    let declared: Vec<Effect> =
        problem.effects.iter().map(|declared| declared.effect.clone()).collect();
    let of = |effect: &Effect| closure.effects.iter().find(|found| found.effect == *effect);
    // An effect that data outside the fit contradict is not added.
    let is_kept = |effect: &Effect| {
        declared.contains(effect)
            || of(effect).is_none_or(|found| found.status != Status::Contradicted)
    };
    let closed = closure.closed.effects.iter().filter(|declared| is_kept(&declared.effect)).map(
        |declared| {
            let found = of(&declared.effect);
            (
                declared.effect.clone(),
                found.map(|found| comments(found, closure)).unwrap_or_default(),
            )
        },
    );
    let edited = edit::with_effects(text, &declared, &closed.collect::<Vec<_>>(), files)?;
    let free: Vec<_> = closure.freed.iter().map(|name| (name.clone(), None)).collect();
    let comment = "Found by flexcal loop: larger than the prior of the effect.";
    let edited = edit::with_rules(&edited, &free, comment)?;
    match &closure.harmonic_prior {
        Some(prior) => {
            let comment = "Found by flexcal loop: this prior predicts left-out poses best.";
            let rules: Vec<_> =
                prior.rules().map(|(pattern, sigma)| (pattern, Some(sigma))).collect();
            edit::with_rules(&edited, &rules, comment)
        }
        None => Ok(edited),
    }
}

/// Returns the comment lines on a found effect: p-value, doubt about its law, values and ranges.
fn comments(found: &Found, closure: &ClosedLoop) -> Vec<String> {
    let doubt = match (found.status, &found.claims) {
        (Status::Found, _) => "",
        (Status::Located, None) => "; not significant by itself",
        _ => "; that this is the law is not sure",
    };
    let added = if found.status == Status::Found { "Found" } else { "Added" };
    let first = format!(
        "{added} by flexcal loop: {}, p-value {}{doubt}.",
        closure.before.describe(&found.effect),
        p_value(found.p_value)
    );
    let parameters: Vec<_> = found.estimates.iter().map(ParameterValue::new).collect();
    let seen = seen_ranges(&found.ranges);
    // A custom effect may describe itself in several lines.
    std::iter::once(first)
        .chain(values(&found.effect, &parameters))
        .chain(seen.map(|seen| format!("Seen for {seen}; beyond, it is an extrapolation.")))
        .map(|line| one_line(&line.replace('\n', " ")))
        .collect()
}
