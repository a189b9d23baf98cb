//! Loads that the rows of an estimate had and a table to which it is applied lacks.

use serde::Deserialize;

use super::saved_estimate::SavedEstimate;
use crate::measurement::Measurements;
use crate::problem::Problem;

/// Inputs of the fitted poses in an `estimate.json`.
#[derive(Deserialize)]
struct Inputs {
    inputs: Vec<Input>,
}

/// Range of one input over the fitted poses.
#[derive(Deserialize)]
struct Input {
    name: String,
    min: f64,
    max: f64,
}

/// Returns a sentence for each load column that the table `rows` lacks although the fitted rows of
/// `estimate` had it, and the arm gives way to loads.
pub(crate) fn missing_loads(
    problem: &Problem,
    estimate: &SavedEstimate,
    rows: &Measurements,
) -> Vec<String> {
    let depends = problem.is_elastic() || !problem.effects.is_empty();
    let parsed = estimate.prediction.as_deref().map(serde_json::from_str::<Inputs>);
    let Some(Ok(Inputs { inputs })) = parsed.filter(|_| depends) else { return Vec::new() };
    let has_hoist = problem
        .joints
        .iter()
        .any(|joint| joint.beam.as_ref().is_some_and(|beam| beam.hoist.is_some()));
    let columns = [
        ("payload", "payload_kg", "kg", rows.payload.is_none(), Some(problem.tool.payload_mass)),
        ("hoist", "hoist_N", "N", rows.hoist.is_none() && has_hoist, None),
    ];
    let lacking = columns.into_iter().filter(|(.., is_missing, _)| *is_missing);
    let sentence = |(name, column, unit, _, taken): (&str, &str, &str, bool, Option<f64>)| {
        let Input { min, max, .. } = inputs.iter().find(|input| input.name == name)?;
        let is_same =
            min.total_cmp(max).is_eq() && taken.is_some_and(|taken| taken.total_cmp(min).is_eq());
        if is_same {
            return None;
        }
        let had =
            if min < max { format!("{min} to {max} {unit}") } else { format!("{min} {unit}") };
        let (taken, other) = match taken {
            Some(mass) => (format!("{mass} {unit}"), "the arm carries something else"),
            None => ("the declared force".to_owned(), "the hoist pulls with another force"),
        };
        Some(format!(
            "the table has no column {column}, and the rows of the estimate had {had}; {taken} is \
             taken in every row: add the column if {other}"
        ))
    };
    lacking.filter_map(sentence).chain(missing_time(problem, estimate, rows)).collect()
}

/// Returns a sentence if `rows` lack times, the rows of `estimate` had times, and an effect depends on
/// time.
fn missing_time(
    problem: &Problem,
    estimate: &SavedEstimate,
    rows: &Measurements,
) -> Option<String> {
    let lacks = !rows.time_measured && estimate.start_times.as_ref()?.first != 0.0;
    let effect = problem.effects.iter().find(|of| of.effect.follows_time()).filter(|_| lacks)?;
    Some(format!(
        "the table has no column time, and {} depends on it: rows are taken as measured one a \
         second from the start of the measurements of the estimate on; add the column if that is \
         not meant",
        effect.effect.name()
    ))
}
