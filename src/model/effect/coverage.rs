//! What the data know about the poses besides their configurations.

use nalgebra::Vector3;

/// Which regressors of effects the poses at hand have, and vary.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DataCoverage {
    /// Why effects of the temperature cannot be shown; `None` where it is known, beside the one
    /// that the problem refers to, and changes.
    pub no_temperature: Option<&'static str>,
    /// Whether directions of approach are known.
    pub approach: bool,
    /// For each joint, whether it was approached from both sides.
    pub both_sides: Vec<bool>,
    /// Smallest and largest payload \[kg\].
    pub payload: (f64, f64),
    /// For each joint, the range of its commands \[rad\] or \[m\].
    pub ranges: Vec<(f64, f64)>,
    /// Times between which a station may have moved \[s\], ascending.
    pub times: Vec<f64>,
    /// Usual time between two poses of a session, and that of the longest session from end to end
    /// \[s\]; `None` where times were not measured: what was before a pose is not known.
    pub clock: Option<(f64, f64)>,
    /// For each covariate of the problem, whether it is known and changes.
    pub covariates: Vec<bool>,
    /// Gravity, arm base frame [m/s²].
    pub gravity: Vector3<f64>,
}

impl DataCoverage {
    /// Whether a joint, counted from 0, moves at all.
    pub fn moves(&self, joint: usize) -> bool {
        self.ranges.get(joint).is_some_and(|(low, high)| high > low)
    }

    /// Whether a payload is carried in some poses.
    pub fn carries(&self) -> bool {
        self.payload.1 > 0.0
    }

    /// Whether the payload changes.
    pub fn changes_payload(&self) -> bool {
        self.payload.1 > self.payload.0
    }

    /// Whether loads act at all.
    pub fn weighs(&self) -> bool {
        self.gravity.norm() > 0.0
    }
}

/// Why an effect that needs the temperature cannot be shown.
pub const NO_TEMPERATURE: &str = "no temperature that changes";
/// The same, of a temperature that is measured.
pub const NO_REFERENCE: &str = "the problem declares no reference_temperature_C";
/// Why an effect that remembers what was before a pose cannot be shown.
pub(super) const NO_TIMES: &str = "no time_s that tells which pose was before which";
/// Why an effect of a joint that stands still cannot be shown.
pub(super) const STANDS_STILL: &str = "the joint stands still in these poses";
/// Why an effect of loads cannot be shown.
pub(super) const NO_LOADS: &str = "no gravity, so no loads";

/// Which columns some measurements have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(clippy::struct_excessive_bools, reason = "each says whether a column is there")]
pub struct Columns {
    /// Temperatures.
    pub temperature: bool,
    /// Directions of approach.
    pub approach: bool,
    /// Times.
    pub time: bool,
    /// Covariates of the problem.
    pub covariates: bool,
}
