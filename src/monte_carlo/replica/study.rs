//! What a study of the misprints asks for, in SI units.

use std::path::PathBuf;

use crate::problem::Problem;
use crate::simulate::Truth;

/// A study as declared in `MISPRINTS.toml`.
#[derive(Debug, Clone)]
pub struct MisprintStudy {
    /// The files that it was read from.
    pub files: Vec<PathBuf>,
    /// Short name; results go to `out/<name>` by default.
    pub name: String,
    /// One line for people.
    pub title: String,
    /// The arm as declared.
    pub problem: Problem,
    /// How specimens differ from it, and from where poses are drawn.
    pub truth: Truth,
    /// Seed of every random number.
    pub seed: u64,
    /// Specimens of each share of flexibility.
    pub specimens: usize,
    /// Poses to identify with.
    pub identification: usize,
    /// Poses that judge.
    pub held_out: usize,
    /// What the rigid fit leaves of the held-out poses of every specimen, mean \[m\].
    pub rigid_leaves: f64,
    /// Flexibility of links over that of joints, as multiples of what the problem declares.
    pub links_over_joints: Vec<f64>,
    /// Load under which the identification poses are measured a second time.
    pub second_load: Load,
}

/// What hangs on the arm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Load {
    /// Payload \[kg\]; `None`: as in the first measurement.
    pub payload: Option<f64>,
    /// Hoist force \[N\]; `None`: as in the first measurement.
    pub hoist: Option<f64>,
}
