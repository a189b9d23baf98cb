//! Columns without which a declared effect would silently be none.

use crate::error::{InputError, InputErrorKind};
use crate::measurement::Measurements;
use crate::model::effect::Columns;
use crate::problem::{EffectDeclaration, Problem};

/// Checks that a table has the columns that the effects of `problem` follow.
///
/// # Errors
/// One is not there: the effect that follows it, by file and line.
pub fn check_columns(problem: &Problem, rows: &Measurements) -> Result<(), InputError> {
    missing(problem, rows, rows.time_measured).next().map_or(Ok(()), Err)
}

/// For each effect that follows a column that targets do not have an error that says so, by file
/// and line. Nothing was before targets: they need no times.
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
