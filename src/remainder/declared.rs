//! Choice of the correction that predictions of a problem use.

use std::path::Path;

use super::correction::Correction;
use super::saved::SavedRemainderError;
use super::update::EarlierCorrections;
use crate::files::Changes;
use crate::fit::SavedEstimate;
use crate::problem::{Problem, RemainderDeclaration};

/// Reads the correction of joint errors from the file that the section `[remainder]` names. Returns
/// `None` if the problem lacks the section or sets `use = false` in it.
///
/// # Errors
/// Returns an error if the file is no remainder of this problem.
pub fn declared(problem: &Problem) -> Result<Option<Correction>, SavedRemainderError> {
    of_problem(problem, Changes::Refused)
}

/// Reads the remainder that a problem declares and uses; `changes` states whether a file is
/// accepted that was edited after flexcal wrote it. Returns `None` if the problem uses no
/// remainder.
fn of_problem(
    problem: &Problem,
    changes: Changes,
) -> Result<Option<Correction>, SavedRemainderError> {
    let used = problem.remainder.as_ref().filter(|declared| declared.is_used);
    let read = |declared: &RemainderDeclaration| {
        read(problem, &declared.file, changes).map_err(|source| match source {
            unreadable @ SavedRemainderError::Unreadable { .. } => SavedRemainderError::Declared {
                location: declared.location.clone(),
                source: Box::new(unreadable),
            },
            other => other,
        })
    };
    used.map(read).transpose()
}

/// Reads the correction for predictions with `estimate`: the remainder of the problem, else that of
/// the estimate, else a correction of 0 with the uncertainty of predictions. Returns `None` if the
/// estimate does not contain the uncertainty.
///
/// # Errors
/// Returns an error if the file is no remainder of this problem, or one of another estimate.
pub fn of_estimate(
    problem: &Problem,
    estimate: &SavedEstimate,
) -> Result<Option<Correction>, SavedRemainderError> {
    if let Some(declared) = of_problem(problem, estimate.changes)? {
        return Ok(Some(declared));
    }
    if let Some(name) = estimate.remainder.as_ref().filter(|_| problem.remainder.is_none()) {
        let file = estimate.file.with_file_name(name);
        let correction = match &estimate.remainder_text {
            Some(text) => Correction::parse(text, &file)?,
            None => Correction::read(&file, estimate.changes)?,
        };
        correction.check(problem, &file)?;
        if estimate.changes == Changes::Refused {
            correction.check_estimate(estimate, &file)?;
        }
        return Ok(Some(correction));
    }
    uncertainty_of(problem, estimate)
}

/// Reads the uncertainty of predictions that `estimate` contains; `None` if it contains none of
/// this problem.
fn uncertainty_of(
    problem: &Problem,
    estimate: &SavedEstimate,
) -> Result<Option<Correction>, SavedRemainderError> {
    let parse = |text: &str| Correction::parse(text, &estimate.file);
    let correction = estimate.prediction.as_deref().map(parse).transpose()?;
    // Another check refuses an estimate of another arm, with a better message.
    Ok(correction.filter(|declared| declared.check(problem, &estimate.file).is_ok()))
}

/// Reads the corrections of an estimate that serves as a prior. Its remainder is left out if the
/// problem has a section `[remainder]`, which states another use. Returns `None` if the estimate
/// does not contain the uncertainty of predictions.
///
/// # Errors
/// Returns the errors of [`of_estimate`] for the files of the estimate.
pub(crate) fn earlier(
    problem: &Problem,
    estimate: &SavedEstimate,
) -> Result<Option<EarlierCorrections>, SavedRemainderError> {
    let Some(alone) = uncertainty_of(problem, estimate)? else { return Ok(None) };
    let has_remainder = estimate.remainder.is_some() && problem.remainder.is_none();
    let remainder = if has_remainder { of_estimate(problem, estimate)? } else { None };
    Ok(Some(EarlierCorrections { alone, remainder }))
}

/// Reads a correction, and checks that it belongs to the problem.
fn read(
    problem: &Problem,
    file: &Path,
    changes: Changes,
) -> Result<Correction, SavedRemainderError> {
    let correction = Correction::read(file, changes)?;
    correction.check(problem, file)?;
    Ok(correction)
}
