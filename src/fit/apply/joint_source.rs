//! Comparison of commanded joint values with those read from encoders: with which of the two is the
//! error smaller?

use crate::fit::identification::identify;
use crate::fit::outcome::Identification;
use crate::fit::{IdentifyError, Options};
use crate::measurement::Dataset;
use crate::problem::{JointSource, Problem};

/// Root mean squared errors on the identification rows \[m\] of two fits: one with commanded joint
/// values, one with values read from encoders.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointSources {
    /// Source of the joint values that the problem uses.
    pub used: JointSource,
    /// Root mean square position error of the fit with commanded joint values \[m\].
    pub commanded: f64,
    /// Root mean square position error of the fit with joint values read from encoders \[m\].
    pub read: f64,
}

impl JointSources {
    /// Returns the source of joint values with which the fit has the smaller error.
    pub fn better(&self) -> JointSource {
        if self.read < self.commanded { JointSource::Read } else { JointSource::Commanded }
    }
}

/// Compares the fit `found` with one that uses the other source of joint values, by their errors on
/// the identification rows. Returns `None` if the table does not have both sources, or both are
/// equal.
///
/// # Errors
/// Returns the errors of [`identify`].
pub fn joint_sources(
    problem: &Problem,
    data: &Dataset,
    options: &Options,
    found: &Identification,
) -> Result<Option<JointSources>, IdentifyError> {
    let Some(other) = data.measurements.with_other_joint_source() else { return Ok(None) };
    let other = identify(problem, &Dataset::new(other, data.split.clone()), options)?;
    let [chosen, other] = [found, &other].map(|fit| fit.fitted.identification.rms.norm);
    let used = problem.data.joints;
    let (commanded, read) =
        if used == JointSource::Commanded { (chosen, other) } else { (other, chosen) };
    Ok(Some(JointSources { used, commanded, read }))
}
