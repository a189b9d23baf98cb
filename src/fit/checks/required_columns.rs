//! Columns that declared effects need.

use crate::error::{InputError, InputErrorKind};
use crate::measurement::Measurements;
use crate::model::effect::Columns;
use crate::problem::{Effect, EffectDeclaration, Problem};

/// Checks that a table has every column that the effects of `problem` need.
///
/// # Errors
/// Returns an error at the file and line of the first effect whose column is missing.
pub fn check_columns(problem: &Problem, rows: &Measurements) -> Result<(), InputError> {
    missing_columns(problem, rows, rows.time_measured).next().map_or(Ok(()), Err)?;
    not_finite(problem, rows).map_or(Ok(()), Err)
}

/// Largest value of a formula. Products and squares of larger ones leave the range of numbers, and
/// no unit of a law is so small.
const MAX_FORMULA: f64 = 1e30;

/// Returns the error of the first declared law with a formula that has no value in a row, or one
/// beyond [`MAX_FORMULA`]; `None` if every formula has a value in every row.
fn not_finite(problem: &Problem, rows: &Measurements) -> Option<InputError> {
    let starts = rows.session_starts();
    problem.effects.iter().find_map(|EffectDeclaration { effect, location }| {
        let Effect::Law(_) = effect else { return None };
        effect.terms(problem).into_iter().find_map(|term| {
            let value = |row: usize| term.regressor.value(&rows.setup(row, &starts));
            let is_lost = |row: &usize| value(*row).is_nan() || value(*row).abs() > MAX_FORMULA;
            let row = (0..rows.len()).find(is_lost)?;
            let kind = InputErrorKind::FormulaNotFinite {
                formula: term.regressor.text(),
                row: row + 1,
                place: rows.location(row).to_string(),
            };
            Some(location.clone().error(kind))
        })
    })
}

/// Returns an error for each effect that needs a column which the targets `rows` lack. Targets have
/// no earlier poses, so they need no times.
pub fn missing_target_columns(problem: &Problem, rows: &Measurements) -> Vec<InputError> {
    missing_columns(problem, rows, true).collect()
}

fn missing_columns(
    problem: &Problem,
    rows: &Measurements,
    time: bool,
) -> impl Iterator<Item = InputError> {
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
