//! Virtual test rig: simulates measurements of an arm made of many short rigid segments and lumped
//! springs.
//!
//! The rig shares frames (`spatial`) and the declared arm (`problem`) with the rest of the program,
//! but no physics: the model is tested against it. Every beam is divided into segments of three
//! rigid parts and two springs that stretch, bend about y and z, and twist; joints have torsion
//! springs. Loads act on the deformed arm in static equilibrium. The discretisation error falls at
//! least with the square of the number of segments.
//!
//! A [`Truth`] (`TRUTH.toml`, see `docs/truth.md`) describes how the true arm differs from the
//! declared one, and [`simulate`] measures it in random poses.

mod build;
#[deny(clippy::indexing_slicing)]
mod camera;
mod chain;
mod command;
mod contact;
mod draw;
mod effect;
mod equilibrium;
mod law;
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

use crate::laws::{At, RANGE_AXIS};
use crate::problem::{Effect, Mount, PoseConditions, Problem};
use crate::spatial::Frame;
use equilibrium::Equilibrium;

pub(crate) use draw::Draw;
pub(crate) use draw::standard_normals;
pub use draw::{Simulation, SimulationError, simulate};
pub(crate) use output::{SavedTruth, TRUTH_FORMAT};
pub(crate) use parameters::TrueParameter;
pub(crate) use truth::RandomRule;
pub use truth::Truth;
// These items are public for the tests, the benches and the Python module only.
#[doc(hidden)]
pub use self::{
    draw::{Row, SimulatedPoses, draw, simulate_counted, simulate_poses},
    effect::{Cause, Shape, TrueEffect},
    truth::HeldOutRows,
};

/// Default number of segments per beam.
#[doc(hidden)]
pub const SEGMENTS: usize = 16;

/// True arm on the simulated test rig, with the effects that act on it.
#[doc(hidden)]
#[derive(Debug, Clone)]
pub struct Rig {
    arm: Problem,
    effects: Vec<TrueEffect>,
    segments: usize,
}

/// Error of a pose without static equilibrium.
#[doc(hidden)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("no static equilibrium: the arm is too flexible for its loads")]
pub struct NoEquilibrium;

impl Rig {
    /// Creates a rig from an arm with its true parameters and the effects that act on it. Base,
    /// tool, targets, gravity and the reference temperature T₀ are those of `arm`.
    pub fn new(arm: Problem, effects: Vec<TrueEffect>) -> Self {
        Self { arm, effects, segments: SEGMENTS }
    }

    /// Sets the number of segments per beam, at least one.
    #[must_use]
    pub fn with_segments(mut self, segments: usize) -> Self {
        self.segments = segments.max(1);
        self
    }

    /// Returns the position that the tracker reads for the tool in static equilibrium, without
    /// noise, measuring frame \[m\].
    ///
    /// # Errors
    /// Returns an error if the pose has no equilibrium.
    pub fn position(&self, conditions: &PoseConditions) -> Result<Vector3<f64>, NoEquilibrium> {
        self.pose(conditions).map(|(position, _)| position)
    }

    /// Returns position \[m\] and orientation of the tool in static equilibrium, measuring frame.
    ///
    /// # Errors
    /// Returns an error if the pose has no equilibrium.
    pub fn pose(
        &self,
        conditions: &PoseConditions,
    ) -> Result<(Vector3<f64>, UnitQuaternion<f64>), NoEquilibrium> {
        self.pose_of("", conditions)
    }

    /// Returns position \[m\] and orientation of the target with this name, measuring frame; of the
    /// tool if no target has the name.
    ///
    /// # Errors
    /// Returns an error if the pose has no equilibrium.
    pub fn pose_of(
        &self,
        target: &str,
        conditions: &PoseConditions,
    ) -> Result<(Vector3<f64>, UnitQuaternion<f64>), NoEquilibrium> {
        let (position, orientation) = self.true_pose_of(target, conditions)?;
        Ok((self.track(position, conditions), orientation))
    }

    /// Returns true position \[m\] and orientation of the target with this name, measuring frame;
    /// of the tool if no target has the name.
    fn true_pose_of(
        &self,
        target: &str,
        conditions: &PoseConditions,
    ) -> Result<(Vector3<f64>, UnitQuaternion<f64>), NoEquilibrium> {
        let (chain, frames) = self.chain(conditions);
        let equilibrium = Equilibrium::find(&chain).ok_or(NoEquilibrium)?;
        let tool = &self.arm.tool;
        let named = self.arm.targets.iter().find(|declared| declared.name == target);
        let (joint, offset, rotation) = match named {
            Some(target) => (target.joint, target.at, target.rotation),
            None => (tool.joint, tool.target, tool.rotation),
        };
        let carrier = equilibrium.frame(frames.get(joint).ok_or(NoEquilibrium)?);
        let base = Frame::from_rotation_vector(self.arm.base.translation, &self.arm.base.rotation);
        let base = self.mounting_frame(conditions).compose(&base);
        let position = base.point(&carrier.point(&offset));
        let axes = base.compose(&carrier).axes;
        let last = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&axes));
        let orientation = UnitQuaternion::from(last) * UnitQuaternion::from_scaled_axis(rotation);
        let is_finite = position.iter().chain(orientation.coords.iter()).all(|x| x.is_finite());
        if is_finite { Ok((position, orientation)) } else { Err(NoEquilibrium) }
    }

    /// Returns the frame on which the base is mounted, measuring frame. It is the measuring frame
    /// itself unless covariates, moves of the station or laws displace the base.
    fn mounting_frame(&self, conditions: &PoseConditions) -> Frame<f64> {
        let (mut turn, mut moved) = (Vector3::zeros(), Vector3::zeros());
        for effect in self.effect_values() {
            if let (Effect::Covariate { joint: Mount::Base, of }, [rx, ry, rz, x, y, z]) = effect {
                let value = self.covariate(of, conditions);
                turn += Vector3::new(*rx, *ry, *rz) * value;
                moved += Vector3::new(*x, *y, *z) * value;
            }
            // If the instrument is moved, the floor appears displaced and rotated in the measuring
            // frame.
            if let (Effect::StationMove { at_time }, [x, y, z, rx, ry, rz]) = effect
                && conditions.time >= *at_time
            {
                turn += Vector3::new(*rx, *ry, *rz);
                moved += Vector3::new(*x, *y, *z);
            }
        }
        let of_base = |at: fn(usize) -> At| {
            Vector3::from_fn(|axis, _| self.added_by_laws(conditions, |law| law.at() == at(axis)))
        };
        Frame::from_rotation_vector(moved + of_base(At::BaseShift), &(turn + of_base(At::BaseTurn)))
    }

    /// Returns the position that the tracker reads for a true position, with the errors of the
    /// instrument, measuring frame \[m\].
    fn track(&self, position: Vector3<f64>, conditions: &PoseConditions) -> Vector3<f64> {
        let mut scale = 1.0;
        let mut moved = Vector3::zeros();
        for effect in self.effect_values() {
            match effect {
                (Effect::TrackerScale, [error]) => scale += error,
                (Effect::FrameStrain, [xx, yy, zz, xy, xz, yz]) => {
                    let [x, y, z] = [position.x, position.y, position.z];
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
        let read = |axis: usize| self.added_by_laws(conditions, |law| law.at() == At::Shift(axis));
        moved += Vector3::from_fn(|axis, _| read(axis));
        position * (scale + read(RANGE_AXIS) / position.norm().max(f64::MIN_POSITIVE)) + moved
    }
}
