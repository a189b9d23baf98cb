//! Declaration of a study of the misprints, in SI units.

use std::path::PathBuf;

use crate::problem::{PoseConditions, Problem};
use crate::rig::Truth;

/// Study of the misprints as declared in `MISPRINTS.toml`.
#[derive(Debug, Clone)]
pub struct MisprintStudy {
    /// Files that the study was read from.
    pub files: Vec<PathBuf>,
    /// Short name; results are written to `out/<name>` by default.
    pub name: String,
    /// Title in results, one line.
    pub title: String,
    /// Arm as the problem declares it.
    pub problem: Problem,
    /// Distribution of the specimens about the declared arm, and of the poses.
    pub truth: Truth,
    /// Seed of every random number.
    pub seed: u64,
    /// Number of specimens of each case.
    pub specimens: usize,
    /// Number of identification poses of each specimen.
    pub identification: usize,
    /// Number of held-out poses of each specimen.
    pub held_out: usize,
    /// Mean position error \[m\] that the rigid fit leaves at the held-out poses. Every specimen's
    /// flexibility is scaled to give this error.
    pub rigid_leaves: f64,
    /// Cases of the study; the first one has the ratio of flexibilities closest to the declared
    /// one.
    pub cases: Vec<Case>,
    /// Load under which the identification poses are measured a second time.
    pub second_load: Load,
}

/// Properties that the specimens of one case share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    /// Ratio of the flexibility of links to that of joints, divided by the declared ratio.
    pub links_over_joints: f64,
    /// Load of every pose; `None` if loads are drawn for each pose.
    pub load: Option<Load>,
}

impl Case {
    /// Returns the name in results: the ratio of link to joint flexibility, or that all poses have
    /// one load.
    pub fn name(&self) -> String {
        if self.load.is_some() {
            "one load".to_owned()
        } else {
            format!("links {}", self.links_over_joints)
        }
    }
}

/// Payload and hoist force of a pose.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Load {
    /// Payload \[kg\]; `None` leaves it as drawn.
    pub payload: Option<f64>,
    /// Hoist force \[N\]; `None` leaves it as drawn.
    pub hoist: Option<f64>,
}

impl Load {
    /// Returns the conditions of a pose with this load instead of the one that the pose states.
    pub(super) fn put_on(self, conditions: &PoseConditions) -> PoseConditions {
        let (payload, hoist) =
            (self.payload.or(conditions.payload), self.hoist.or(conditions.hoist));
        PoseConditions { payload, hoist, ..conditions.clone() }
    }
}
