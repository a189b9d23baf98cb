//! Rows that measure against the surroundings: which, in which configuration, and what is read.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{DMatrix, DVector, Vector3};
use rand_chacha::ChaCha8Rng;

use super::chain::Place;
use super::draw::{Row, between, rounded_command};
use super::equilibrium::AtRest;
use super::truth::Truth;
use super::{NoRest, Rig};
use crate::problem::{FixtureKind, Joint, JointKind, Observation, PoseConditions};
use crate::spatial::{Frame, plane_normal};

/// Configurations from which a contact is sought before it is given up.
const TRIES: usize = 200;
/// Steps of one search.
const STEPS: usize = 40;
/// A contact is reached where this much is missing \[m\].
const REACHED: f64 = 1e-9;
/// Step of a difference \[rad\] or \[m\], and the longest step of a search.
const DIFFERENCE: f64 = 1e-6;
const LONGEST: f64 = 0.3;
/// Singular values below this part of the largest turn no joint.
const WEAK: f64 = 1e-3;

impl Rig {
    /// The place of a fixture, or the distance of the target from it \[m\]: what is missing to be
    /// at a point, the distance to an anchor, the height above a surface.
    fn seen(&self, fixture: usize, target: &Vector3<f64>) -> Vector3<f64> {
        let Some(own) = self.arm.fixtures.get(fixture) else { return Vector3::zeros() };
        let number = |k: usize| own.known.get(k).copied().flatten().unwrap_or(0.0);
        let place = Vector3::new(number(0), number(1), number(2));
        let only = |x: f64| Vector3::new(x, 0.0, 0.0);
        match own.kind {
            FixtureKind::Point => target - place,
            FixtureKind::Anchor => only((target - place).norm()),
            FixtureKind::Sphere => only((target - place).norm() - number(3)),
            FixtureKind::Plane => only(plane_normal(place.x, place.y).dot(target) - place.z),
        }
    }

    /// How far the x and the y axis of a frame of the arm at rest lie above the horizontal \[rad\].
    ///
    /// A plumb line shows how the frame leans: the axis is off the vertical by the angle ½π − τ
    /// between it and the line.
    fn tilts(&self, conditions: &PoseConditions, frame: usize) -> Result<Vector3<f64>, NoRest> {
        let (chain, frames) = self.chain(conditions);
        let mounting = Place { piece: Some(0), frame: Frame::identity() };
        let place = frame
            .checked_sub(1)
            .map_or(Some(&mounting), |joint| frames.get(joint))
            .ok_or(NoRest)?;
        let frame = AtRest::find(&chain).ok_or(NoRest)?.frame(place);
        let down = self.gravity().try_normalize(0.0).unwrap_or(-Vector3::z());
        let above = |axis: &Vector3<f64>| axis.angle(&down) - FRAC_PI_2;
        Ok(Vector3::new(above(&frame.axes[0]), above(&frame.axes[1]), 0.0))
    }

    /// Moves the joints of a row until the target is at its point or surface, as far off as the
    /// row's noise says, and reads the row.
    ///
    /// `None` where no configuration within the ranges was found.
    pub(super) fn measure(
        &self,
        row: &mut Row,
        truth: &Truth,
        random: &mut ChaCha8Rng,
    ) -> Result<Option<()>, NoRest> {
        let noise = row.position;
        let (fixture, target) = match row.observation {
            Observation::Tilt(frame) => {
                row.position =
                    self.tilts(&row.conditions, frame)? + Vector3::new(noise.x, noise.y, 0.0);
                row.orientation = None;
                return Ok(Some(()));
            }
            Observation::Position | Observation::Between(..) => {
                let (position, orientation) = self.pose_of(&row.target, &row.conditions)?;
                row.position += position;
                row.orientation = row.orientation.map(|noise| noise * orientation);
                return Ok(Some(()));
            }
            Observation::Distance(anchor) => {
                let (target, _) = self.placed(&row.target, &row.conditions)?;
                row.position = self.seen(anchor, &target) + Vector3::new(noise.x, 0.0, 0.0);
                row.orientation = None;
                return Ok(Some(()));
            }
            Observation::Point(fixture) => (fixture, noise),
            Observation::Surface(fixture) => (fixture, Vector3::new(noise.x, 0.0, 0.0)),
        };
        (row.position, row.orientation) = (Vector3::zeros(), None);
        let (numbers, measured) = (row.observation.coordinates(), row.target.clone());
        let missing = |conditions: &PoseConditions| -> Result<DVector<f64>, NoRest> {
            let seen = self.seen(fixture, &self.placed(&measured, conditions)?.0) - target;
            Ok(DVector::from_column_slice(&seen.as_slice()[..numbers]))
        };
        for _ in 0..TRIES {
            if self.reach(&mut row.conditions, truth, &missing)? {
                return Ok(Some(()));
            }
            let ranges = &truth.poses.joints;
            let joints = self.arm.joints.iter().zip(ranges).zip(&mut row.conditions.configuration);
            for ((joint, range), q) in
                joints.filter(|((joint, _), _)| joint.command_kind() != JointKind::Fixed)
            {
                *q = rounded_command(joint.kind, between(random, *range));
            }
        }
        Ok(None)
    }

    /// Moves the joints by Newton's method until nothing is missing; whether that is so, within the
    /// ranges.
    fn reach(
        &self,
        conditions: &mut PoseConditions,
        truth: &Truth,
        missing: &impl Fn(&PoseConditions) -> Result<DVector<f64>, NoRest>,
    ) -> Result<bool, NoRest> {
        let kinds: Vec<JointKind> = self.arm.joints.iter().map(Joint::command_kind).collect();
        let moving: Vec<usize> =
            (0..kinds.len()).filter(|&joint| kinds[joint] != JointKind::Fixed).collect();
        for _ in 0..STEPS {
            let now = missing(conditions)?;
            if now.amax() < REACHED {
                for &joint in &moving {
                    let q = &mut conditions.configuration[joint];
                    *q = rounded_command(kinds[joint], *q);
                }
                let within = |&joint: &usize| {
                    let (from, to) = truth.poses.joints[joint];
                    (from..=to).contains(&conditions.configuration[joint])
                };
                return Ok(moving.iter().all(within));
            }
            let mut jacobian = DMatrix::zeros(now.len(), moving.len());
            for (column, &joint) in moving.iter().enumerate() {
                let mut moved = conditions.clone();
                moved.configuration[joint] += DIFFERENCE;
                jacobian.set_column(column, &((missing(&moved)? - &now) / DIFFERENCE));
            }
            let svd = jacobian.svd(true, true);
            let largest = svd.singular_values.max();
            let Ok(step) = svd.solve(&now, WEAK * largest) else { return Ok(false) };
            let shorter = LONGEST / step.amax().max(LONGEST);
            for (&joint, step) in moving.iter().zip(&step) {
                conditions.configuration[joint] -= shorter * step;
            }
        }
        Ok(false)
    }
}
