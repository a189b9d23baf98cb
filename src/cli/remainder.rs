//! Choice of the correction that predictions of a problem use.

use std::path::Path;

use flexcal::files::Changes;
use flexcal::fit::SavedEstimate;
use flexcal::problem::Problem;
use flexcal::remainder::{Correction, SavedRemainderError};

/// Reads the remainder that a problem declares and uses; `None` if there is none.
pub fn declared(problem: &Problem) -> Result<Option<Correction>, SavedRemainderError> {
    of_problem(problem, Changes::Refused)
}

/// Reads the remainder that a problem declares and uses; `changes` may be accepted.
fn of_problem(
    problem: &Problem,
    changes: Changes,
) -> Result<Option<Correction>, SavedRemainderError> {
    let used = problem.remainder.as_ref().filter(|declared| declared.is_used);
    used.map(|declared| read(problem, &declared.file, changes)).transpose()
}

/// Reads the correction for predictions with `estimate`: the remainder of the problem, or else that
/// of the estimate, or else only the uncertainty of predictions. Returns `None` if the estimate
/// does not contain the uncertainty.
pub fn of_estimate(
    problem: &Problem,
    estimate: &SavedEstimate,
) -> Result<Option<Correction>, SavedRemainderError> {
    if let Some(declared) = of_problem(problem, estimate.changes)? {
        return Ok(Some(declared));
    }
    if let Some(name) = estimate.remainder.as_ref().filter(|_| problem.remainder.is_none()) {
        let file = estimate.file.with_file_name(name);
        return read(problem, &file, estimate.changes).map(Some);
    }
    let parse = |text: &str| Correction::parse(text, &estimate.file);
    let correction = estimate.prediction.as_deref().map(parse).transpose()?;
    // An estimate of another arm is refused with a message of its own.
    Ok(correction.filter(|declared| declared.check(problem, &estimate.file).is_ok()))
}

fn read(
    problem: &Problem,
    file: &Path,
    changes: Changes,
) -> Result<Correction, SavedRemainderError> {
    let correction = Correction::read(file, changes)?;
    correction.check(problem, file)?;
    Ok(correction)
}

/// Parses the probability of a bound, which is between 0 and 1.
pub fn level(text: &str) -> Result<f64, String> {
    let level = text.parse::<f64>().ok().filter(|level| 0.0 < *level && *level < 1.0);
    level.ok_or_else(|| "a probability between 0 and 1 is needed, such as 0.95".to_owned())
}
