//! Update of an earlier estimate, with its remainder and the bounds of its predictions.

use super::error::PriorError;
use super::identify::{Identified, PriorSource, identified};
use crate::fit::{Identification, Options};
use crate::measurement::Dataset;
use crate::problem::Problem;
use crate::remainder::{self, Fitted};

/// Identification with a prior, and the uncertainty of its predictions.
#[derive(Debug, Clone)]
pub struct Update {
    pub found: Identification,
    /// Uncertainty and remainder of the earlier estimate, conditioned on the new rows as well;
    /// `None` if the prior contains none.
    pub predictions: Option<Fitted>,
    /// True if the earlier estimate has a remainder that was not carried over, because the problem
    /// has a section `[remainder]`.
    pub leaves_remainder: bool,
}

/// Fits the identification rows of `data` that are new, with the posterior of an earlier estimate
/// or of a fleet as prior, widened by the drift of `days` days. If the rows contradict the prior,
/// that of the most probable cause's parameters is widened. The remainder of the earlier estimate
/// and the uncertainty of its predictions are carried over.
///
/// # Errors
/// Returns an error if the estimate is of another arm or has other laws, if its remainder cannot be
/// read, if no row is new, or if the fit fails.
pub fn update(
    problem: &Problem,
    data: &Dataset,
    options: &Options,
    source: &PriorSource,
    days: f64,
) -> Result<Update, PriorError> {
    let (earlier, leaves_remainder) = match source {
        PriorSource::Estimate(estimate) => {
            let leaves = estimate.remainder.is_some() && problem.remainder.is_some();
            (remainder::earlier(problem, estimate)?, leaves)
        }
        PriorSource::Fleet(_) => (None, false),
    };
    let with = (source, earlier.as_ref());
    let Identified { found, data, since } = identified(problem, data, options, with, days)?;
    let predictions = match &earlier {
        Some(earlier) => earlier.updated((&found, problem), &data, &since)?,
        None => None,
    };
    Ok(Update { found, predictions, leaves_remainder })
}
