//! Branch of an arm from the base to one of its leaves, with its origins in a URDF.

use super::chain::{Chain, moved};
use super::patches::{Patches, difference};
use crate::error::{InputError, UrdfErrorKind};
use crate::mechanics::{self, Arm};
use crate::problem::JointKind;
use crate::quantity::format::{decimals, number};
use crate::spatial::Frame;

/// Largest difference between the nominal arms of problem and URDF at which they count as equal
/// \[rad\] or \[m\].
const NOMINAL_TOLERANCE: f64 = 1e-6;
/// Largest transform after the chain's last origin that is dropped, if no origin can contain it
/// \[rad\] or \[m\].
const MAX_DROPPED: f64 = 1e-10;

/// Transforms between the axes of an arm, from one moving joint to the next.
///
/// They regroup the joint transforms: `C_k` = Ry(`β_{k−1}`) … Rx(`α_k`) Tx(`a_k`) Rz(`θ_k`)
/// Tz(`d_k`), with fixed joints in between.
pub(crate) struct Steps {
    /// Transform before each moving joint, from the base or from the previous moving joint.
    pub before: Vec<Frame<f64>>,
    /// Transform after the last moving joint.
    pub end: Frame<f64>,
}

impl Steps {
    /// Computes the transforms of an arm that is a chain, at zero commands.
    pub fn new(arm: &Arm<f64>) -> Self {
        Self::along(&arm.joints)
    }

    /// Computes the transforms along consecutive joints of an arm, at zero commands.
    fn along<'a>(joints: impl IntoIterator<Item = &'a mechanics::Joint<f64>>) -> Self {
        let (mut before, mut step) = (Vec::new(), Frame::identity());
        for joint in joints {
            joint.advance_to_zero(&mut step);
            if joint.kind != JointKind::Fixed {
                before.push(std::mem::take(&mut step));
            }
            step.rotate_y(joint.beta.sin_cos);
        }
        Self { before, end: step }
    }

    /// Returns the gauge of each axis, after the identity for the base: the transform from the
    /// chain's axis frame to that of the nominal arm. It keeps the frames of the file for an arm
    /// without errors.
    ///
    /// # Errors
    /// Returns an error if the nominal arm differs from the chain, up to its last axis.
    fn gauges(&self, chain: &Chain) -> Result<Vec<Frame<f64>>, InputError> {
        let mut gauges = vec![Frame::identity()];
        let mut gauge = Frame::identity();
        for ((stage, step), name) in chain.stages.iter().zip(&self.before).zip(chain.joint_names())
        {
            // B = G₋ C G⁻¹, where G is a rotation about the axis and a shift along it.
            gauge = stage.step.inverse().compose(&gauge).compose(step);
            let off = (gauge.axes[2].xy().norm(), gauge.origin.xy().norm());
            if off.0 > NOMINAL_TOLERANCE || off.1 > NOMINAL_TOLERANCE || gauge.axes[2].z < 0.0 {
                let kind = UrdfErrorKind::OtherArm { joint: name, off: words(off) };
                return Err(chain.robot.error_at(stage.joint, kind));
            }
            gauges.push(gauge);
        }
        Ok(gauges)
    }

    /// Checks that the nominal arm has the chain's transform behind the last axis, whose gauge is
    /// given.
    fn check_end(&self, chain: &Chain, gauge: &Frame<f64>) -> Result<(), InputError> {
        let off = difference(&chain.end, &gauge.compose(&self.end));
        if off.0 > NOMINAL_TOLERANCE || off.1 > NOMINAL_TOLERANCE {
            let joint = chain.joint_names().pop().unwrap_or_default();
            return Err(chain.robot.error(UrdfErrorKind::OtherArm { joint, off: words(off) }));
        }
        Ok(())
    }
}

/// Returns an angle \[rad\] and a distance \[m\] in words, in degrees and millimetres, with
/// three significant digits.
fn words((angle, distance): (f64, f64)) -> String {
    let digits = |value: f64| decimals(value, 3).clamp(2, 12);
    let (angle, distance) = (angle.to_degrees(), distance * 1e3);
    format!("{}° and {} mm", number(angle, digits(angle)), number(distance, digits(distance)))
}

/// Joints of a problem from the base to one of its leaves, with their chain in the URDF.
pub(super) struct Branch<'a> {
    pub chain: &'a Chain<'a>,
    /// Indices of the joints of the problem, from the base on.
    pub path: Vec<usize>,
    /// Gauge of each axis after the identity for the base: the transform from the chain's axis
    /// frame to that of the problem.
    pub gauges: Vec<Frame<f64>>,
}

impl<'a> Branch<'a> {
    /// Returns the branch of a `chain`.
    ///
    /// # Errors
    /// Returns an error if the nominal arm differs from the chain.
    pub fn new(chain: &'a Chain, path: &[usize], nominal: &Arm<f64>) -> Result<Self, InputError> {
        let branch = Self { chain, path: path.to_vec(), gauges: Vec::new() };
        let gauges = branch.steps(nominal).gauges(chain)?;
        Ok(Self { gauges, ..branch })
    }

    /// Returns the joints of the branch in an arm, from the base on.
    pub fn joints<'b>(&self, arm: &'b Arm<f64>) -> impl Iterator<Item = &'b mechanics::Joint<f64>> {
        self.path.iter().filter_map(|&joint| arm.joints.get(joint))
    }

    fn steps(&self, arm: &Arm<f64>) -> Steps {
        Steps::along(self.joints(arm))
    }

    /// Writes the origins up to the last axis.
    pub fn write(&self, patches: &mut Patches, arm: &Arm<f64>) {
        let steps = self.steps(arm);
        // The state is the frame of the previous joint in its axis frame, and the fixed joints
        // since.
        let (mut from, mut fixed) = (Frame::identity(), Vec::new());
        let gauges = self.gauges.iter().zip(self.gauges.iter().skip(1));
        let mut stages = self.chain.stages.iter().zip(&steps.before).zip(gauges);
        let mut next = stages.next();
        for &index in &self.chain.joints {
            let Some(joint) = self.chain.robot.joints.get(index) else { continue };
            let Some(((stage, step), (before, after))) =
                next.filter(|((stage, _), _)| stage.joint == index)
            else {
                fixed.push(index);
                continue;
            };
            let step = before.compose(step).compose(&after.inverse());
            let target =
                from.compose(&moved(&step, joint, -stage.offset)).compose(&stage.axis.inverse());
            let passed = patches.through(&fixed);
            patches.set_origin(index, &passed.inverse().compose(&target));
            from = stage.axis;
            fixed.clear();
            next = stages.next();
        }
    }

    /// Writes the transform behind the last axis into the fixed joints that follow it.
    ///
    /// # Errors
    /// Returns an error if the nominal arm has another transform there, or if no joint follows that
    /// could hold it.
    pub fn write_end(
        &self,
        patches: &mut Patches,
        (nominal, arm): (&Arm<f64>, &Arm<f64>),
    ) -> Result<(), InputError> {
        let gauge = self.gauges.last().copied().unwrap_or_default();
        self.steps(nominal).check_end(self.chain, &gauge)?;
        let last = self.chain.stages.last();
        let from = last.map_or_else(Frame::identity, |stage| stage.axis);
        let target = from.compose(&gauge.compose(&self.steps(arm).end));
        let joints = self.chain.joints.iter().copied();
        let fixed: Vec<usize> = match last {
            Some(last) => joints.skip_while(|&joint| joint != last.joint).skip(1).collect(),
            None => joints.collect(),
        };
        if let Some((&first, others)) = fixed.split_first() {
            let behind = patches.through(others);
            patches.set_origin(first, &target.compose(&behind.inverse()));
            return Ok(());
        }
        let off = difference(&Frame::identity(), &target);
        if off.0 > MAX_DROPPED || off.1 > MAX_DROPPED {
            let joint = self.chain.joint_names().pop().unwrap_or_default();
            return Err(self.chain.robot.error(UrdfErrorKind::NoRoom { joint, off: words(off) }));
        }
        Ok(())
    }
}
