//! Identified geometry written into the origins of a URDF, every other byte as it was.

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::Vector3;

use super::chain::{Chain, moved};
use super::read::Origin;
use crate::error::{InputError, UrdfErrorKind};
use crate::mechanics::Arm;
use crate::problem::{JointKind, Problem};
use crate::spatial::Frame;

/// How far apart the nominal arm of a problem and its URDF may be \[rad\] or \[m\].
const SAME: f64 = 1e-6;
/// A remainder behind the last origin of the chain that may be left out \[rad\] or \[m\].
const NOTHING: f64 = 1e-10;
/// An origin that moves by less is left as it is written \[rad\] or \[m\].
const UNMOVED: f64 = 1e-12;

/// A URDF with moved origins.
#[derive(Debug, Clone)]
pub struct Export {
    /// The whole file.
    pub text: String,
    /// The origins that have moved, from base to tip.
    pub moved: Vec<MovedOrigin>,
}

/// An origin of a joint, as it was and as it is.
#[derive(Debug, Clone, PartialEq)]
pub struct MovedOrigin {
    /// Name of the joint.
    pub joint: String,
    /// Origin \[m\], as written to the file.
    pub xyz: Vector3<f64>,
    /// Roll, pitch and yaw \[rad\], as written to the file.
    pub rpy: Vector3<f64>,
    /// How far it has moved \[m\].
    pub distance: f64,
    /// How far it has turned \[rad\].
    pub angle: f64,
}

/// Between the axes of an arm: what lies before each moving joint, seen from the one before, and
/// behind the last.
///
/// Our transforms in another order: `C_k` = Ry(`β_{k−1}`) … Rx(`α_k`) Tx(`a_k`) Rz(`θ_k`)
/// Tz(`d_k`), fixed joints in between.
pub(super) struct Steps {
    pub before: Vec<Frame<f64>>,
    pub end: Frame<f64>,
}

impl Steps {
    pub fn of(arm: &Arm<f64>) -> Self {
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

    /// Where each step leads that the chain's frames see: with the gauges of the nominal arm, so
    /// that an arm without errors has the frames it had.
    ///
    /// # Errors
    /// The nominal arm is not that of the chain.
    fn gauges(&self, chain: &Chain) -> Result<Vec<Frame<f64>>, InputError> {
        let mut gauges = vec![Frame::identity()];
        let mut gauge = Frame::identity();
        let names = chain.joint_names();
        for ((stage, own), name) in chain.stages.iter().zip(&self.before).zip(&names) {
            // B = G₋ C G⁻¹ with G a turn about the axis and a shift along it.
            gauge = stage.step.inverse().compose(&gauge).compose(own);
            let off = (gauge.axes[2].xy().norm(), gauge.origin.xy().norm());
            if off.0 > SAME || off.1 > SAME || gauge.axes[2].z < 0.0 {
                return Err(chain.robot.error_at(
                    stage.joint,
                    UrdfErrorKind::OtherArm { joint: name.clone(), off: words(off) },
                ));
            }
            gauges.push(gauge);
        }
        let end = difference(&chain.end, &gauge.compose(&self.end));
        if end.0 > SAME || end.1 > SAME {
            let joint = names.last().cloned().unwrap_or_default();
            return Err(chain.robot.error(UrdfErrorKind::OtherArm { joint, off: words(end) }));
        }
        Ok(gauges)
    }
}

/// Angle \[rad\] and distance \[m\] between two frames.
fn difference(one: &Frame<f64>, other: &Frame<f64>) -> (f64, f64) {
    let rest = one.inverse().compose(other);
    let sines = Vector3::new(
        rest.axes[1].z - rest.axes[2].y,
        rest.axes[2].x - rest.axes[0].z,
        rest.axes[0].y - rest.axes[1].x,
    );
    let cos = 0.5 * (rest.axes[0].x + rest.axes[1].y + rest.axes[2].z - 1.0);
    ((0.5 * sines.norm()).atan2(cos), rest.origin.norm())
}

fn words((angle, distance): (f64, f64)) -> String {
    format!("{:.3e}° and {:.3e} mm", angle.to_degrees(), distance * 1e3)
}

/// `chain`, from which `problem` was made, with the geometry of `arm`.
///
/// The pose of the tip is then that of the rigid arm in every configuration; what one joint's
/// numbers hold behind it goes into the next origin. Inertial data and everything beside the chain
/// stay.
///
/// # Errors
/// Problem and chain are not of one arm, or no origin is left behind the last joint that could hold
/// what was identified there.
pub fn export(chain: &Chain, problem: &Problem, arm: &Arm<f64>) -> Result<Export, InputError> {
    problem.require_chain("export to a URDF")?;
    check_names(chain, problem)?;
    let gauges = Steps::of(&Arm::nominal(problem)).gauges(chain)?;
    let steps = Steps::of(arm);
    let mut patches = Patches { chain, text: Vec::new(), moved: Vec::new() };
    // From the axis frame before, in the frames of the chain: its own joint's frame first.
    let (mut from, mut fixed) = (Frame::identity(), Vec::new());
    let mut stages =
        chain.stages.iter().zip(&steps.before).zip(gauges.iter().zip(gauges.iter().skip(1)));
    let mut next = stages.next();
    for &index in &chain.joints {
        let Some(joint) = chain.robot.joints.get(index) else { continue };
        let Some(((stage, step), (before, own))) =
            next.filter(|((stage, _), _)| stage.joint == index)
        else {
            fixed.push(index);
            continue;
        };
        let step = before.compose(step).compose(&own.inverse());
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
        if off.0 > NOTHING || off.1 > NOTHING {
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
    /// Parts of the text and what takes their place, in the order of the chain.
    text: Vec<(Range<usize>, String)>,
    moved: Vec<MovedOrigin>,
}

impl Patches<'_> {
    /// The frame behind some fixed joints, whose rounded angles are written out.
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

    /// Gives a joint another origin, unless that is the one it has.
    fn place(&mut self, index: usize, frame: &Frame<f64>) {
        let Some(joint) = self.chain.robot.joints.get(index) else { return };
        let old = as_written(&joint.origin);
        let (angle, distance) = difference(&old, frame);
        let (turned, shifted) = (angle > UNMOVED, distance > UNMOVED);
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
        let own = |name: &str, changed: bool, values: &Vector3<f64>, at: &Option<Range<usize>>| {
            match at {
                Some(at) if changed => (Some((at.clone(), triple(values))), String::new()),
                None if changed => (None, format!(" {name}=\"{}\"", triple(values))),
                _ => (None, String::new()),
            }
        };
        let (first, more) = own("xyz", shifted, &xyz, &origin.xyz_value);
        let (second, further) = own("rpy", turned, &rpy, &origin.rpy_value);
        self.text.extend([first, second].into_iter().flatten());
        let more = format!("{more}{further}");
        if !more.is_empty() {
            let (at, more) = match &origin.element {
                Some(element) => (element.start + "<origin".len(), more),
                None => self.new_element(&joint.span, &more),
            };
            self.text.push((at..at, more));
        }
        self.moved.push(MovedOrigin { joint: joint.name.clone(), xyz, rpy, distance, angle });
    }

    /// Where an `<origin>` may stand in a joint that has none, and its text: before the first
    /// child, with the same indent.
    fn new_element(&self, joint: &Range<usize>, attributes: &str) -> (usize, String) {
        let text = self.chain.robot.source.text.get(joint.clone()).unwrap_or_default();
        // The start tag ends at the first bracket outside of quotes.
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

/// The same orientation in angles as near as can be to others: (r, p, y) and (r + π, π − p, y + π)
/// are one.
fn nearest(rpy: &Vector3<f64>, old: &Vector3<f64>) -> Vector3<f64> {
    let half = 0.5 * TAU;
    let near = |angles: Vector3<f64>| {
        angles.zip_map(old, |own, old| own - ((own - old) / TAU).round() * TAU)
    };
    let [one, other] = [*rpy, Vector3::new(rpy.x + half, half - rpy.y, rpy.z + half)].map(near);
    if (one - old).norm() <= (other - old).norm() { one } else { other }
}

/// Three numbers, to 10⁻¹³.
fn triple(values: &Vector3<f64>) -> String {
    let number = |value: &f64| (((value * 1e13).round() / 1e13) + 0.0).to_string();
    values.iter().map(number).collect::<Vec<_>>().join(" ")
}
