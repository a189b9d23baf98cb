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
    check(problem, rows, rows.time_measured)
}

/// The same of targets, which nothing was before: they need no times.
///
/// # Errors
/// As [`check_columns`].
pub fn check_target_columns(problem: &Problem, rows: &Measurements) -> Result<(), InputError> {
    check(problem, rows, true)
}

fn check(problem: &Problem, rows: &Measurements, time: bool) -> Result<(), InputError> {
    let columns = Columns {
        temperature: rows.temperature.is_some(),
        approach: rows.approach.is_some(),
        time,
        covariates: rows.covariates.len() == problem.data.covariates.len() * rows.len(),
    };
    for EffectDeclaration { effect, location } in &problem.effects {
        if let Some(write) = effect.missing_column(problem, columns) {
            return Err(location.clone().error(InputErrorKind::NeedsColumn { write }));
        }
    }
    Ok(())
}
