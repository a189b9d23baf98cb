//! What a study of the misprints asks for, in SI units.

use std::path::PathBuf;

use crate::problem::{PoseConditions, Problem};
use crate::rig::Truth;

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
    /// Specimens of each case.
    pub specimens: usize,
    /// Poses to identify with.
    pub identification: usize,
    /// Poses that judge.
    pub held_out: usize,
    /// What the rigid fit leaves of the held-out poses of every specimen, mean \[m\].
    pub rigid_leaves: f64,
    /// What specimens have in common; the first is the one that everything is tried on.
    pub cases: Vec<Case>,
    /// Load under which the identification poses are measured a second time.
    pub second_load: Load,
}

/// What the specimens of a row have in common.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    /// Flexibility of links over that of joints, as multiples of what the problem declares.
    pub links_over_joints: f64,
    /// The one load of every pose; `None`: drawn pose by pose.
    pub load: Option<Load>,
}

impl Case {
    /// Name in results: how many times the links' share is as declared, or that there is one load.
    pub fn name(&self) -> String {
        if self.load.is_some() {
            "one load".to_owned()
        } else {
            format!("links {}", self.links_over_joints)
        }
    }
}

/// What hangs on the arm.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Load {
    /// Payload \[kg\]; `None`: as drawn.
    pub payload: Option<f64>,
    /// Hoist force \[N\]; `None`: as drawn.
    pub hoist: Option<f64>,
}

impl Load {
    /// A pose under this load.
    pub(super) fn put_on(self, conditions: &PoseConditions) -> PoseConditions {
        let (payload, hoist) =
            (self.payload.or(conditions.payload), self.hoist.or(conditions.hoist));
        PoseConditions { payload, hoist, ..conditions.clone() }
    }
}
