//! Commands against readings of the joints: which of the two the arm follows.

use crate::fit::identification::{IdentifyError, Options, identify};
use crate::fit::outcome::Identification;
use crate::measurement::Dataset;
use crate::problem::{JointSource, Problem};

/// What a fit leaves of the identification rows with commands as configurations, and with readings:
/// root mean squared errors \[m\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointSources {
    /// Which of the two the problem takes.
    pub used: JointSource,
    /// With commands.
    pub commanded: f64,
    /// With readings.
    pub read: f64,
}

impl JointSources {
    /// The one that fits better.
    pub fn better(&self) -> JointSource {
        if self.read < self.commanded { JointSource::Read } else { JointSource::Commanded }
    }
}

/// Fits once more with the other of commands and readings, where the rows have both and they
/// differ; `found` is the fit with those that the problem takes. Held-out rows decide nothing.
///
/// # Errors
/// As for [`identify`].
pub fn joint_sources(
    problem: &Problem,
    data: &Dataset,
    options: &Options,
    found: &Identification,
) -> Result<Option<JointSources>, IdentifyError> {
    let Some(other) = data.measurements.with_other_joint_source() else { return Ok(None) };
    let other = identify(problem, &Dataset::new(other, data.split.clone()), options)?;
    let [own, other] = [found, &other].map(|found| found.fitted.identification.rms.norm);
    let used = problem.data.joints;
    let (commanded, read) =
        if used == JointSource::Commanded { (own, other) } else { (other, own) };
    Ok(Some(JointSources { used, commanded, read }))
}
