//! Columns that declared effects need.

use crate::error::{InputError, InputErrorKind};
use crate::measurement::Measurements;
use crate::model::effect::Columns;
use crate::problem::{EffectDeclaration, Problem};

/// Checks that a table has every column that the effects of `problem` need.
///
/// # Errors
/// Returns an error at the file and line of the first effect whose column is missing.
pub fn check_columns(problem: &Problem, rows: &Measurements) -> Result<(), InputError> {
    missing(problem, rows, rows.time_measured).next().map_or(Ok(()), Err)
}

/// Returns an error for each effect that needs a column which the targets `rows` lack. Targets have
/// no earlier poses, so they need no times.
pub fn missing_target_columns(problem: &Problem, rows: &Measurements) -> Vec<InputError> {
    missing(problem, rows, true).collect()
}

fn missing(problem: &Problem, rows: &Measurements, time: bool) -> impl Iterator<Item = InputError> {
    let columns = Columns {
        temperature: rows.temperature.is_some(),
        approach: rows.approach.is_some(),
        time,
        covariates: rows.covariates.len() == problem.data.covariates.len() * rows.len(),
    };
    let needs = move |EffectDeclaration { effect, location }: &EffectDeclaration| {
        let write = effect.missing_column(problem, columns)?;
        Some(location.clone().error(InputErrorKind::NeedsColumn { write }))
    };
    problem.effects.iter().filter_map(needs)
}
