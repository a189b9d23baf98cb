//! Export of identified geometry into the origins of a URDF. All other bytes are unchanged.

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::{UnitQuaternion, Vector3};

use super::chain::{Chain, moved};
use super::read::Origin;
use crate::error::{InputError, UrdfErrorKind};
use crate::mechanics::Arm;
use crate::problem::{JointKind, Problem};
use crate::spatial::Frame;

/// Largest difference between the nominal arms of problem and URDF that counts as equal \[rad\] or
/// \[m\].
const NOMINAL_TOLERANCE: f64 = 1e-6;
/// Largest transform after the chain's last origin that may be dropped \[rad\] or \[m\].
const MAX_DROPPED: f64 = 1e-10;
/// Smallest displacement for which an origin is rewritten \[rad\] or \[m\].
const MIN_DISPLACEMENT: f64 = 1e-12;

/// URDF with identified origins.
#[derive(Debug, Clone)]
pub struct Export {
    /// Text of the whole file.
    pub text: String,
    /// Moved origins from base to tip.
    #[doc(hidden)]
    pub moved: Vec<MovedOrigin>,
}

/// Moved origin of a joint.
#[derive(Debug, Clone, PartialEq)]
pub struct MovedOrigin {
    /// Name of the joint.
    pub joint: String,
    /// Origin \[m\], as written to the file.
    pub xyz: Vector3<f64>,
    /// Roll, pitch and yaw \[rad\], as written to the file.
    pub rpy: Vector3<f64>,
    /// Distance by which the origin moved \[m\].
    pub distance: f64,
    /// Angle by which the origin turned \[rad\].
    pub angle: f64,
}

/// Transforms between the axes of an arm: before each moving joint, relative to the previous one,
/// and after the last.
///
/// They regroup the joint transforms: `C_k` = Ry(`β_{k−1}`) … Rx(`α_k`) Tx(`a_k`) Rz(`θ_k`)
/// Tz(`d_k`), with fixed joints in between.
pub(super) struct Steps {
    pub before: Vec<Frame<f64>>,
    pub end: Frame<f64>,
}

impl Steps {
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

    /// Returns the gauge of each axis: the transform from the chain's axis frame to that of the
    /// nominal arm. With it an arm without errors keeps the frames of the file.
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

/// Returns the angle \[rad\] and distance \[m\] between two frames.
fn difference(first: &Frame<f64>, second: &Frame<f64>) -> (f64, f64) {
    let relative = first.inverse().compose(second);
    let sines = Vector3::new(
        relative.axes[1].z - relative.axes[2].y,
        relative.axes[2].x - relative.axes[0].z,
        relative.axes[0].y - relative.axes[1].x,
    );
    let cos = 0.5 * (relative.axes[0].x + relative.axes[1].y + relative.axes[2].z - 1.0);
    ((0.5 * sines.norm()).atan2(cos), relative.origin.norm())
}

fn words((angle, distance): (f64, f64)) -> String {
    format!("{:.3e}° and {:.3e} mm", angle.to_degrees(), distance * 1e3)
}

/// Writes the geometry of `arm` into `chain`, from which `problem` was made.
///
/// The tip then has the pose of the rigid arm in every configuration. Parameters of one joint may
/// enter the origin of the next. Inertial data and everything outside the chain stay unchanged.
///
/// # Errors
/// Returns an error if problem and chain describe different arms, or if no origin after the last
/// joint can hold its parameters.
pub fn export(chain: &Chain, problem: &Problem, arm: &Arm<f64>) -> Result<Export, InputError> {
    problem.require_chain("export to a URDF")?;
    check_names(chain, problem)?;
    let gauges = Steps::new(&Arm::nominal(problem)).gauges(chain)?;
    let steps = Steps::new(arm);
    let mut patches = Patches { chain, text: Vec::new(), moved: Vec::new() };
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
            from.compose(&moved(&step, joint, -stage.addend)).compose(&stage.axis.inverse());
        let passed = patches.through(&fixed);
        patches.place(index, &passed.inverse().compose(&target));
        from = stage.axis;
        fixed.clear();
        next = stages.next();
    }
    let last = gauges.last().copied().unwrap_or_default();
    let target = from.compose(&last.compose(&steps.end));
    if let Some((&first, others)) = fixed.split_first() {
        let behind = patches.through(others);
        patches.place(first, &target.compose(&behind.inverse()));
    } else {
        let off = difference(&Frame::identity(), &target);
        if off.0 > MAX_DROPPED || off.1 > MAX_DROPPED {
            let joint = chain.joint_names().pop().unwrap_or_default();
            return Err(chain.robot.error(UrdfErrorKind::NoRoom { joint, off: words(off) }));
        }
    }
    Ok(patches.finish())
}

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

fn as_written(origin: &Origin) -> Frame<f64> {
    Frame::from_xyz_rpy(&origin.xyz, &origin.written)
}

struct Patches<'a> {
    chain: &'a Chain<'a>,
    /// Replaced byte ranges with their new text, in the order of the chain.
    text: Vec<(Range<usize>, String)>,
    moved: Vec<MovedOrigin>,
}

impl Patches<'_> {
    /// Returns the transform through some fixed joints, and writes their origins as the file will
    /// round them.
    fn through(&mut self, joints: &[usize]) -> Frame<f64> {
        let mut frame = Frame::identity();
        for &index in joints {
            let Some(joint) = self.chain.robot.joints.get(index) else { continue };
            let origin = joint.origin.frame();
            self.place(index, &origin);
            frame = frame.compose(&origin);
        }
        frame
    }

    /// Replaces the origin of a joint if it differs.
    fn place(&mut self, index: usize, frame: &Frame<f64>) {
        let Some(joint) = self.chain.robot.joints.get(index) else { return };
        let old = as_written(&joint.origin);
        let (angle, distance) = difference(&old, frame);
        let (turned, shifted) = (angle > MIN_DISPLACEMENT, distance > MIN_DISPLACEMENT);
        if !turned && !shifted {
            return;
        }
        let xyz = if shifted { frame.origin } else { joint.origin.xyz };
        let rpy = if turned {
            nearest(&frame.roll_pitch_yaw(), &joint.origin.written)
        } else {
            joint.origin.written
        };
        let origin = &joint.origin;
        let patch = |name: &str,
                     changed: bool,
                     values: &Vector3<f64>,
                     at: &Option<Range<usize>>| {
            match at {
                Some(at) if changed => (Some((at.clone(), triple(values))), String::new()),
                None if changed => (None, format!(" {name}=\"{}\"", triple(values))),
                _ => (None, String::new()),
            }
        };
        let (first, more) = patch("xyz", shifted, &xyz, &origin.xyz_value);
        let (second, also) = match &origin.quaternion_value {
            Some(at) if turned => (Some((at.clone(), quaternion(&rpy))), String::new()),
            Some(_) => (None, String::new()),
            None => patch("rpy", turned, &rpy, &origin.rpy_value),
        };
        self.text.extend([first, second].into_iter().flatten());
        let more = format!("{more}{also}");
        if !more.is_empty() {
            let (at, more) = match &origin.element {
                Some(element) => (element.start + "<origin".len(), more),
                None => self.new_element(&joint.span, &more),
            };
            self.text.push((at..at, more));
        }
        self.moved.push(MovedOrigin { joint: joint.name.clone(), xyz, rpy, distance, angle });
    }

    /// Returns position and text of a new `<origin>` in a joint without one: before the first
    /// child, with its indentation.
    fn new_element(&self, joint: &Range<usize>, attributes: &str) -> (usize, String) {
        let text = self.chain.robot.source.text.get(joint.clone()).unwrap_or_default();
        // The start tag ends at the first bracket outside quotes.
        let mut quote = None;
        let end = text.char_indices().find(|&(_, c)| {
            match quote {
                Some(open) if c == open => quote = None,
                None if c == '"' || c == '\'' => quote = Some(c),
                _ => {}
            }
            quote.is_none() && c == '>'
        });
        let end = end.map_or(0, |(at, _)| at + 1);
        let rest = text.get(end..).unwrap_or_default();
        let indent = rest.get(..rest.len() - rest.trim_start().len()).unwrap_or_default();
        (joint.start + end, format!("{indent}<origin{attributes}/>"))
    }

    fn finish(mut self) -> Export {
        self.text.sort_by_key(|(span, _)| span.start);
        let source = &self.chain.robot.source.text;
        let (mut text, mut at) = (String::with_capacity(source.len()), 0);
        for (span, new) in &self.text {
            text.push_str(source.get(at..span.start).unwrap_or_default());
            text.push_str(new);
            at = span.end;
        }
        text.push_str(source.get(at..).unwrap_or_default());
        Export { text, moved: self.moved }
    }
}

/// Returns the equivalent angles nearest to `old`: (r, p, y) and (r + π, π − p, y + π) are the same
/// rotation.
fn nearest(rpy: &Vector3<f64>, old: &Vector3<f64>) -> Vector3<f64> {
    let half = 0.5 * TAU;
    let near = |angles: Vector3<f64>| {
        angles.zip_map(old, |angle, old| angle - ((angle - old) / TAU).round() * TAU)
    };
    let [first, second] = [*rpy, Vector3::new(rpy.x + half, half - rpy.y, rpy.z + half)].map(near);
    if (first - old).norm() <= (second - old).norm() { first } else { second }
}

/// Returns the quaternion x, y, z, w of the rotation by roll, pitch and yaw \[rad\].
fn quaternion(rpy: &Vector3<f64>) -> String {
    let rotation = UnitQuaternion::from_euler_angles(rpy.x, rpy.y, rpy.z);
    let [x, y, z, w] = [rotation.i, rotation.j, rotation.k, rotation.w];
    [x, y, z, w].map(|number| number.to_string()).join(" ")
}

/// Returns three numbers, rounded to 10⁻¹³.
fn triple(values: &Vector3<f64>) -> String {
    let number = |value: &f64| (((value * 1e13).round() / 1e13) + 0.0).to_string();
    values.iter().map(number).collect::<Vec<_>>().join(" ")
}
