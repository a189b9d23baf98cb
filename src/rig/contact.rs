//! Simulated rows that measure against fixtures: search of a configuration in contact, and the
//! measured values.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{DMatrix, DVector, Vector3};
use rand_chacha::ChaCha8Rng;

use super::chain::PieceFrame;
use super::draw::{Row, between, rounded_command};
use super::equilibrium::Equilibrium;
use super::truth::Truth;
use super::{NoEquilibrium, Rig};
use crate::problem::{FixtureKind, Joint, JointKind, Observation, PoseConditions};
use crate::spatial::{Frame, plane_normal};

/// Maximum number of start configurations from which a contact is searched.
const MAX_STARTS: usize = 200;
/// Maximum number of Newton steps from one start configuration.
const MAX_STEPS: usize = 40;
/// Largest gap between target and fixture at which a contact counts as reached \[m\].
const CONTACT_TOLERANCE: f64 = 1e-9;
/// Step of the numerical derivative with respect to a joint coordinate \[rad\] or \[m\].
const DIFFERENCE_STEP: f64 = 1e-6;
/// Largest change of a joint coordinate in one Newton step \[rad\] or \[m\].
const MAX_STEP: f64 = 0.3;
/// Smallest singular value of the gap's Jacobian, relative to the largest, whose direction in joint
/// space a Newton step moves along.
const RANK_TOLERANCE: f64 = 1e-3;

impl Rig {
    /// Returns the offset of a target position from a fixture \[m\]: the vector from a point, or,
    /// as first component, the distance from an anchor or the height above a surface.
    fn fixture_offset(&self, fixture: usize, target: &Vector3<f64>) -> Vector3<f64> {
        let Some(fixture) = self.arm.fixtures.get(fixture) else { return Vector3::zeros() };
        let number = |k: usize| fixture.known.get(k).copied().flatten().unwrap_or(0.0);
        let position = Vector3::new(number(0), number(1), number(2));
        let scalar = |x: f64| Vector3::new(x, 0.0, 0.0);
        match fixture.kind {
            FixtureKind::Point => target - position,
            FixtureKind::Anchor => scalar((target - position).norm()),
            FixtureKind::Sphere => scalar((target - position).norm() - number(3)),
            FixtureKind::Plane => {
                scalar(plane_normal(position.x, position.y).dot(target) - position.z)
            }
            // Cameras and markers are not touched; images measure them.
            _ => Vector3::zeros(),
        }
    }

    /// Returns the angles of the x and y axes of a frame above the horizontal \[rad\], in static
    /// equilibrium; the third component is 0. `frame` 0 is the base, i the frame of joint i.
    fn tilts(
        &self,
        conditions: &PoseConditions,
        frame: usize,
    ) -> Result<Vector3<f64>, NoEquilibrium> {
        let (chain, frames) = self.chain(conditions);
        let base = PieceFrame { piece: Some(0), frame: Frame::identity() };
        let mounted = frame
            .checked_sub(1)
            .map_or(Some(&base), |joint| frames.get(joint))
            .ok_or(NoEquilibrium)?;
        let frame = Equilibrium::find(&chain).ok_or(NoEquilibrium)?.frame(mounted);
        let down = self.gravity().try_normalize(0.0).unwrap_or(-Vector3::z());
        let above = |axis: &Vector3<f64>| axis.angle(&down) - FRAC_PI_2;
        Ok(Vector3::new(above(&frame.axes[0]), above(&frame.axes[1]), 0.0))
    }

    /// Measures a row, whose position and orientation hold the noise before. For a contact, the
    /// joints are first moved until the target touches the fixture, with the noise as remaining
    /// offset.
    ///
    /// Returns `None` if no configuration in contact was found within the joint ranges.
    pub(super) fn measure(
        &self,
        row: &mut Row,
        truth: &Truth,
        random: &mut ChaCha8Rng,
    ) -> Result<Option<()>, NoEquilibrium> {
        let noise = row.position;
        let (fixture, target) = match row.observation {
            Observation::Tilt(frame) => {
                row.position =
                    self.tilts(&row.conditions, frame)? + Vector3::new(noise.x, noise.y, 0.0);
                row.orientation = None;
                return Ok(Some(()));
            }
            Observation::Point(fixture) => (fixture, noise),
            Observation::Surface(fixture) => (fixture, Vector3::new(noise.x, 0.0, 0.0)),
            Observation::Distance(anchor) => {
                let (target, _) = self.true_pose_of(&row.target, &row.conditions)?;
                row.position =
                    self.fixture_offset(anchor, &target) + Vector3::new(noise.x, 0.0, 0.0);
                row.orientation = None;
                return Ok(Some(()));
            }
            _ => {
                let (position, orientation) = self.pose_of(&row.target, &row.conditions)?;
                row.position += position;
                row.orientation = row.orientation.map(|noise| noise * orientation);
                return Ok(Some(()));
            }
        };
        (row.position, row.orientation) = (Vector3::zeros(), None);
        let (count, measured) = (row.observation.coordinates(), row.target.clone());
        let gap = |conditions: &PoseConditions| -> Result<DVector<f64>, NoEquilibrium> {
            let (position, _) = self.true_pose_of(&measured, conditions)?;
            let gap = self.fixture_offset(fixture, &position) - target;
            Ok(DVector::from_column_slice(&gap.as_slice()[..count]))
        };
        for _ in 0..MAX_STARTS {
            if self.move_to_contact(&mut row.conditions, truth, &gap)? {
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

    /// Moves the joints by Newton's method until `gap` \[m\] is zero. Returns true if a
    /// configuration within the joint ranges of the truth was found.
    fn move_to_contact(
        &self,
        conditions: &mut PoseConditions,
        truth: &Truth,
        gap: &impl Fn(&PoseConditions) -> Result<DVector<f64>, NoEquilibrium>,
    ) -> Result<bool, NoEquilibrium> {
        let kinds: Vec<JointKind> = self.arm.joints.iter().map(Joint::command_kind).collect();
        let moving: Vec<usize> =
            (0..kinds.len()).filter(|&joint| kinds[joint] != JointKind::Fixed).collect();
        for _ in 0..MAX_STEPS {
            let now = gap(conditions)?;
            if now.amax() < CONTACT_TOLERANCE {
                for &joint in &moving {
                    let q = &mut conditions.configuration[joint];
                    *q = rounded_command(kinds[joint], *q);
                }
                let is_within_range = |&joint: &usize| {
                    let (from, to) = truth.poses.joints[joint];
                    (from..=to).contains(&conditions.configuration[joint])
                };
                return Ok(moving.iter().all(is_within_range));
            }
            let mut jacobian = DMatrix::zeros(now.len(), moving.len());
            for (column, &joint) in moving.iter().enumerate() {
                let mut moved = conditions.clone();
                moved.configuration[joint] += DIFFERENCE_STEP;
                jacobian.set_column(column, &((gap(&moved)? - &now) / DIFFERENCE_STEP));
            }
            let svd = jacobian.svd(true, true);
            let largest = svd.singular_values.max();
            let Ok(step) = svd.solve(&now, RANK_TOLERANCE * largest) else { return Ok(false) };
            let factor = MAX_STEP / step.amax().max(MAX_STEP);
            for (&joint, step) in moving.iter().zip(&step) {
                conditions.configuration[joint] -= factor * step;
            }
        }
        Ok(false)
    }
}
