//! Checks that a table has the columns that declared effects need, and that formulas have values.

use crate::error::{InputError, InputErrorKind};
use crate::measurement::Measurements;
use crate::model::effect::Columns;
use crate::problem::{Effect, EffectDeclaration, Problem};

/// Checks that a table has every column that the effects of `problem` need, and that the formula of
/// each declared law has a value in every row.
///
/// # Errors
/// Returns an error at the file and line of the first effect whose column is missing, or whose
/// formula has no finite value of moderate size.
pub fn check_columns(problem: &Problem, rows: &Measurements) -> Result<(), InputError> {
    missing_columns(problem, rows, rows.time_measured).next().map_or(Ok(()), Err)?;
    formula_error(problem, rows).map_or(Ok(()), Err)
}

/// Largest absolute value of a formula. Products and squares of larger values overflow, and no
/// useful unit makes a value so large.
const MAX_FORMULA_VALUE: f64 = 1e30;

/// Returns the error of the first declared law with a formula that is not a number in some row, or
/// beyond [`MAX_FORMULA_VALUE`]; `None` if there is none.
fn formula_error(problem: &Problem, rows: &Measurements) -> Option<InputError> {
    let starts = rows.session_starts();
    problem.effects.iter().find_map(|EffectDeclaration { effect, location }| {
        let Effect::Law(_) = effect else { return None };
        effect.terms(problem).into_iter().find_map(|term| {
            let value = |row: usize| term.regressor.value(&rows.setup(row, &starts));
            let is_lost =
                |row: &usize| value(*row).is_nan() || value(*row).abs() > MAX_FORMULA_VALUE;
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

/// Returns an error for each effect that needs a column which the table `rows` of target poses
/// lacks. Target poses have no earlier poses, so they need no column of times.
pub fn missing_target_columns(problem: &Problem, rows: &Measurements) -> Vec<InputError> {
    missing_columns(problem, rows, true).collect()
}

/// Returns an error for each effect that needs a column which `rows` lack; `time` is true if times
/// are known or not needed.
fn missing_columns(
    problem: &Problem,
    rows: &Measurements,
    time: bool,
) -> impl Iterator<Item = InputError> {
    let columns = Columns {
        temperature: rows.temperature.is_some(),
        approach: rows.approach.is_some(),
        time,
        velocities: rows.velocities.is_some(),
        covariates: rows.covariates.len() == problem.data.covariates.len() * rows.len(),
    };
    let needs = move |EffectDeclaration { effect, location }: &EffectDeclaration| {
        let write = effect.missing_column(problem, columns)?;
        Some(location.clone().error(InputErrorKind::NeedsColumn { write }))
    };
    problem.effects.iter().filter_map(needs)
}
