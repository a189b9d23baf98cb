//! Conditions other than configurations that a data set records and varies.

use nalgebra::Vector3;

/// Regressors of effects that a data set records, with their ranges. They decide which effects it
/// can show.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DataCoverage {
    /// Reason why temperature effects cannot be shown. `None` if the temperature is recorded and
    /// varies, and the problem declares its reference temperature.
    pub no_temperature: Option<&'static str>,
    /// True if directions of approach are recorded.
    pub approach: bool,
    /// For each joint, true if it was approached from both sides.
    pub both_sides: Vec<bool>,
    /// Smallest and largest payload \[kg\].
    pub payload: (f64, f64),
    /// True if all poses with a payload have the same one.
    pub is_one_payload: bool,
    /// For each joint, smallest and largest command \[rad\] or \[m\].
    pub ranges: Vec<(f64, f64)>,
    /// Candidate times at which a station may have moved \[s\], ascending.
    pub times: Vec<f64>,
    /// Typical time between two poses of a session, and duration of the longest session \[s\].
    /// `None` if no times are recorded, so that the order of the poses is unknown.
    pub clock: Option<(f64, f64)>,
    /// For each covariate of the problem, true if it is recorded and varies.
    pub covariates: Vec<bool>,
    /// Reason why effects of velocities cannot be shown. `None` if velocities of joints are recorded
    /// and not all zero.
    pub no_velocities: Option<&'static str>,
    /// Gravity, arm base frame [m/s²].
    pub gravity: Vector3<f64>,
    /// True if a part that the problem declares gives way to loads.
    pub gives_way: bool,
}

impl DataCoverage {
    /// Returns true if the commands of a joint, counted from 0, vary.
    pub fn moves(&self, joint: usize) -> bool {
        self.ranges.get(joint).is_some_and(|(low, high)| high > low)
    }

    /// Returns true if at least one pose has a payload.
    pub fn has_payload(&self) -> bool {
        self.payload.1 > 0.0
    }

    /// Returns true if the payload varies between poses.
    pub fn payload_varies(&self) -> bool {
        self.payload.1 > self.payload.0
    }

    /// Returns true if gravity is not zero, so that masses load the arm.
    pub fn has_gravity(&self) -> bool {
        self.gravity.norm() > 0.0
    }
}

/// Reason why a temperature effect cannot be shown: no temperature is recorded, or it is constant.
pub const NO_TEMPERATURE: &str = "no temperature that changes";
/// Reason why a temperature effect cannot be shown although the temperature is recorded: the
/// problem declares no reference.
pub const NO_REFERENCE: &str = "the problem declares no reference_temperature_C";
/// Reason why an effect of the velocities of joints cannot be shown.
pub const NO_VELOCITIES: &str = "no columns qd1_deg_per_s … of an arm that moves";
/// Reason why an effect that depends on earlier poses (lag, friction, settling) cannot be shown.
pub(super) const NO_TIMES: &str = "no column time_s, so the order of the poses is not known";
/// Reason why a delayed temperature effect cannot be shown: neither times nor temperatures.
pub(super) const NO_TIMES_NOR_TEMPERATURE: &str =
    "no column time_s, and no temperature that changes";
/// Reason why an effect of a joint whose command is constant cannot be shown.
pub(super) const STANDS_STILL: &str = "the joint stands still in these poses";
/// Reason why an effect of loads cannot be shown: gravity is zero.
pub(super) const NO_LOADS: &str = "no gravity, so no loads";

/// Reason why an error of the loads cannot be shown: loads move nothing on a rigid arm.
pub(super) const IS_RIGID: &str = "no declared part gives way, so loads move nothing";

/// Reason why an error of the payload's mass cannot be shown beside what gives way under it.
pub(super) const IS_ONLY_LOAD: &str =
    "one payload is the only load, so that only its product with what gives way is known";

/// Optional columns that a set of measurements has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(clippy::struct_excessive_bools, reason = "each says whether a column is there")]
pub struct Columns {
    /// True if the table has temperatures.
    pub temperature: bool,
    /// True if directions of approach are present.
    pub approach: bool,
    /// True if the table has times.
    pub time: bool,
    /// True if all covariates of the problem are present.
    pub covariates: bool,
    /// True if the table has velocities of joints.
    pub velocities: bool,
}
