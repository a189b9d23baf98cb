//! The virtual test rig: positions of an arm from many short rigid segments and lumped springs.
//!
//! The rig shares frames (`spatial`) and the declared arm (`problem`) with the rest of the program
//! and no physics: it is what the model is tested against. Every beam is cut into segments, each of
//! three rigid parts and two springs that stretch, bend about y and z, and twist; joints have
//! torsion springs. Loads act on the deformed arm, which is brought to static equilibrium; the
//! error falls at least with the square of the number of segments.
//!
//! A [`Truth`] (`TRUTH.toml`, see `docs/truth.md`) says how the true arm differs from the declared
//! one, and [`simulate`] measures it in poses drawn at random.

mod build;
mod chain;
mod command;
mod contact;
mod draw;
mod effect;
mod equilibrium;
mod link;
#[deny(clippy::indexing_slicing)]
mod output;
mod parameters;
#[deny(clippy::indexing_slicing)]
mod ranges;
#[deny(clippy::indexing_slicing)]
mod read;
#[deny(clippy::indexing_slicing)]
mod strengths;
mod truth;

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::problem::{Effect, Mount, PoseConditions, Problem};
use crate::spatial::Frame;
use equilibrium::AtRest;

pub(crate) use draw::standard_normals;
pub use draw::{Draw, Row, Simulation, SimulationError, draw, simulate, simulate_poses};
pub use effect::{Cause, Shape, TrueEffect, ValueCount};
pub use parameters::TrueParameter;
pub use truth::{Deviation, HeldOutRows, RandomRule, Truth};

/// Segments per beam where nobody asks for another number.
pub const SEGMENTS: usize = 16;

/// The true arm on its test bench.
#[derive(Debug, Clone)]
pub struct Rig {
    arm: Problem,
    effects: Vec<TrueEffect>,
    segments: usize,
}

/// A pose in which the arm does not come to rest.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the arm does not come to rest: too soft for its loads")]
pub struct NoRest;

impl Rig {
    /// An arm with its true parameters and the effects at work; its base, tool, targets, gravity
    /// and T₀ are those of `arm`.
    pub fn new(arm: Problem, effects: Vec<TrueEffect>) -> Self {
        Self { arm, effects, segments: SEGMENTS }
    }

    /// Cuts every beam into that many segments, at least one.
    #[must_use]
    pub fn with_segments(mut self, segments: usize) -> Self {
        self.segments = segments.max(1);
        self
    }

    /// What the tracker reads for the target in static equilibrium, without noise, measuring frame
    /// \[m\].
    ///
    /// # Errors
    /// The arm is too soft for its loads.
    pub fn position(&self, conditions: &PoseConditions) -> Result<Vector3<f64>, NoRest> {
        self.pose(conditions).map(|(position, _)| position)
    }

    /// The same with the orientation of the target, measuring frame.
    ///
    /// # Errors
    /// The arm is too soft for its loads.
    pub fn pose(
        &self,
        conditions: &PoseConditions,
    ) -> Result<(Vector3<f64>, UnitQuaternion<f64>), NoRest> {
        self.pose_of("", conditions)
    }

    /// The same of the target with this name; of the tool where there is none.
    ///
    /// # Errors
    /// The arm is too soft for its loads.
    pub fn pose_of(
        &self,
        target: &str,
        conditions: &PoseConditions,
    ) -> Result<(Vector3<f64>, UnitQuaternion<f64>), NoRest> {
        let (seen, orientation) = self.placed(target, conditions)?;
        Ok((self.track(seen, conditions), orientation))
    }

    /// Where the target with this name is, measuring frame \[m\], and its orientation there.
    fn placed(
        &self,
        target: &str,
        conditions: &PoseConditions,
    ) -> Result<(Vector3<f64>, UnitQuaternion<f64>), NoRest> {
        let (chain, frames) = self.chain(conditions);
        let rest = AtRest::find(&chain).ok_or(NoRest)?;
        let tool = &self.arm.tool;
        let (joint, at, rotation) = match self.arm.targets.iter().find(|own| own.name == target) {
            Some(own) => (own.joint, own.at, own.rotation),
            None => (tool.joint, tool.target, tool.rotation),
        };
        let carrier = rest.frame(frames.get(joint).ok_or(NoRest)?);
        let base = Frame::from_rotation_vector(self.arm.base.translation, &self.arm.base.rotation);
        let base = self.mounted(conditions).compose(&base);
        let seen = base.point(&carrier.point(&at));
        let axes = base.compose(&carrier).axes;
        let last = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&axes));
        let orientation = UnitQuaternion::from(last) * UnitQuaternion::from_scaled_axis(rotation);
        let finite = seen.iter().chain(orientation.coords.iter()).all(|x| x.is_finite());
        if finite { Ok((seen, orientation)) } else { Err(NoRest) }
    }

    /// Where the floor is, as covariates move it, measuring frame.
    fn mounted(&self, conditions: &PoseConditions) -> Frame<f64> {
        let (mut turn, mut moved) = (Vector3::zeros(), Vector3::zeros());
        for part in self.effects.iter().filter_map(TrueEffect::parts) {
            if let (Effect::Covariate { joint: Mount::Base, of }, [rx, ry, rz, x, y, z]) = part {
                let value = self.covariate(of, conditions);
                turn += Vector3::new(*rx, *ry, *rz) * value;
                moved += Vector3::new(*x, *y, *z) * value;
            }
            // To the instrument that was set up anew everything turned.
            if let (Effect::StationMove { at_time }, [x, y, z, rx, ry, rz]) = part
                && conditions.time >= *at_time
            {
                turn += Vector3::new(*rx, *ry, *rz);
                moved += Vector3::new(*x, *y, *z);
            }
        }
        Frame::from_rotation_vector(moved, &turn)
    }

    /// What the tracker makes of a position \[m\].
    fn track(&self, seen: Vector3<f64>, conditions: &PoseConditions) -> Vector3<f64> {
        let mut scale = 1.0;
        let mut moved = Vector3::zeros();
        for part in self.effects.iter().filter_map(TrueEffect::parts) {
            match part {
                (Effect::TrackerScale, [error]) => scale += error,
                (Effect::FrameStrain, [xx, yy, zz, xy, xz, yz]) => {
                    let [x, y, z] = [seen.x, seen.y, seen.z];
                    moved += Vector3::new(xx * x + xy * y + xz * z, yy * y + yz * z, zz * z);
                }
                (Effect::TrackerSettling { time_constant }, [x, y, z]) => {
                    moved += Vector3::new(*x, *y, *z)
                        * (1.0 - 1.0 / (conditions.elapsed / time_constant).exp());
                }
                (Effect::TrackerDrift, [x, y, z]) => {
                    moved += Vector3::new(*x, *y, *z) * conditions.elapsed;
                }
                (Effect::StationShift { at_time }, [x, y, z]) if conditions.time >= *at_time => {
                    moved += Vector3::new(*x, *y, *z);
                }
                _ => {}
            }
        }
        seen * scale + moved
    }
}
