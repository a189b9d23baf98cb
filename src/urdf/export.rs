//! Export of identified geometry into the origins of a URDF. All other bytes are unchanged.

use super::chain::{Chain, moved};
use super::mounted::{MountedLink, mount};
use super::patches::{MovedOrigin, Patches, difference};
use crate::error::{InputError, UrdfErrorKind};
use crate::mechanics::Arm;
use crate::problem::{JointKind, Problem};
use crate::quantity::format::{decimals, number};
use crate::spatial::Frame;

/// Largest difference between the nominal arms of problem and URDF at which they count as equal
/// \[rad\] or \[m\].
const NOMINAL_TOLERANCE: f64 = 1e-6;
/// Largest transform after the chain's last origin that is dropped, if no origin can contain it
/// \[rad\] or \[m\].
const MAX_DROPPED: f64 = 1e-10;

/// URDF with identified origins.
#[derive(Debug, Clone)]
pub struct Export {
    /// Text of the whole file.
    pub text: String,
    /// Origins that were changed, from base to tip.
    #[doc(hidden)]
    pub moved: Vec<MovedOrigin>,
    /// Links of cameras and markers that were not changed, because the file has them on another
    /// parent.
    #[doc(hidden)]
    pub elsewhere: Vec<String>,
}

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
    /// Computes the transforms of an arm at zero commands.
    pub fn new(arm: &Arm<f64>) -> Self {
        let (mut before, mut step) = (Vec::new(), Frame::identity());
        for joint in &arm.joints {
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
    /// Returns an error if the nominal arm differs from the chain.
    fn gauges(&self, chain: &Chain) -> Result<Vec<Frame<f64>>, InputError> {
        let mut gauges = vec![Frame::identity()];
        let mut gauge = Frame::identity();
        let names = chain.joint_names();
        for ((stage, step), name) in chain.stages.iter().zip(&self.before).zip(&names) {
            // B = G₋ C G⁻¹, where G is a rotation about the axis and a shift along it.
            gauge = stage.step.inverse().compose(&gauge).compose(step);
            let off = (gauge.axes[2].xy().norm(), gauge.origin.xy().norm());
            if off.0 > NOMINAL_TOLERANCE || off.1 > NOMINAL_TOLERANCE || gauge.axes[2].z < 0.0 {
                return Err(chain.robot.error_at(
                    stage.joint,
                    UrdfErrorKind::OtherArm { joint: name.clone(), off: words(off) },
                ));
            }
            gauges.push(gauge);
        }
        let end = difference(&chain.end, &gauge.compose(&self.end));
        if end.0 > NOMINAL_TOLERANCE || end.1 > NOMINAL_TOLERANCE {
            let joint = names.last().cloned().unwrap_or_default();
            return Err(chain.robot.error(UrdfErrorKind::OtherArm { joint, off: words(end) }));
        }
        Ok(gauges)
    }
}

/// Returns an angle \[rad\] and a distance \[m\] in words, in degrees and millimetres, with
/// three significant digits.
fn words((angle, distance): (f64, f64)) -> String {
    let digits = |value: f64| decimals(value, 3).clamp(2, 12);
    let (angle, distance) = (angle.to_degrees(), distance * 1e3);
    format!("{}° and {} mm", number(angle, digits(angle)), number(distance, digits(distance)))
}

/// Writes the geometry of `arm` into the URDF of `chain`, from which `problem` was made.
///
/// The tip then has the pose of the rigid arm in every configuration. Parameters of one joint may
/// change the origin of the next. Inertial data and everything outside the chain stay unchanged.
///
/// # Errors
/// Returns an error if problem and chain describe different arms, or if no origin after the last
/// joint can hold its parameters.
pub fn export(chain: &Chain, problem: &Problem, arm: &Arm<f64>) -> Result<Export, InputError> {
    export_with_links(chain, problem, arm, &[])
}

/// Writes the geometry of `arm` as [`export`] does, and the `mounted` cameras and markers as links
/// with a fixed joint. Links that the file has are moved; others are added at the end of the file.
///
/// # Errors
/// Returns the errors of [`export`].
pub fn export_with_links(
    chain: &Chain,
    problem: &Problem,
    arm: &Arm<f64>,
    mounted: &[MountedLink],
) -> Result<Export, InputError> {
    problem.require_chain("export to a URDF")?;
    check_names(chain, problem)?;
    let gauges = Steps::new(&Arm::nominal(problem)).gauges(chain)?;
    let steps = Steps::new(arm);
    let mut patches = Patches::new(chain.robot);
    // The state is the frame of the previous joint in its axis frame, and the fixed joints since.
    let (mut from, mut fixed) = (Frame::identity(), Vec::new());
    let mut stages =
        chain.stages.iter().zip(&steps.before).zip(gauges.iter().zip(gauges.iter().skip(1)));
    let mut next = stages.next();
    for &index in &chain.joints {
        let Some(joint) = chain.robot.joints.get(index) else { continue };
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
    let last = gauges.last().copied().unwrap_or_default();
    let target = from.compose(&last.compose(&steps.end));
    if let Some((&first, others)) = fixed.split_first() {
        let behind = patches.through(others);
        patches.set_origin(first, &target.compose(&behind.inverse()));
    } else {
        let off = difference(&Frame::identity(), &target);
        if off.0 > MAX_DROPPED || off.1 > MAX_DROPPED {
            let joint = chain.joint_names().pop().unwrap_or_default();
            return Err(chain.robot.error(UrdfErrorKind::NoRoom { joint, off: words(off) }));
        }
    }
    let elsewhere = mount(&mut patches, chain, (problem, arm, &gauges), mounted);
    let (text, moved) = patches.finish();
    Ok(Export { text, moved, elsewhere })
}

/// Checks that the moving joints of problem and chain have the same names.
fn check_names(chain: &Chain, problem: &Problem) -> Result<(), InputError> {
    let moving = problem.joints.iter().filter(|joint| joint.kind != JointKind::Fixed);
    let expected: Vec<String> = moving.map(|joint| joint.name.clone()).collect();
    let found = chain.joint_names();
    if found == expected {
        return Ok(());
    }
    let (base, tip) = chain.ends();
    let (base, tip) = (base.to_owned(), tip.to_owned());
    Err(chain.robot.error(UrdfErrorKind::OtherJoints { base, tip, found, expected }))
}
