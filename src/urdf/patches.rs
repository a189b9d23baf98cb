//! Changes to the origins and links in the text of a URDF. All other bytes stay.

use std::collections::BTreeSet;
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::ops::Range;

use nalgebra::{UnitQuaternion, Vector3};
use roxmltree::Document as Xml;

use super::read::{Origin, Robot};
use crate::spatial::Frame;

/// Displacement of an origin above which it is rewritten \[rad\] or \[m\].
const MIN_DISPLACEMENT: f64 = 1e-12;

/// Changed origin of a joint.
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

/// Returns the angle \[rad\] and distance \[m\] between two frames.
pub(super) fn difference(first: &Frame<f64>, second: &Frame<f64>) -> (f64, f64) {
    let relative = first.inverse().compose(second);
    let sines = Vector3::new(
        relative.axes[1].z - relative.axes[2].y,
        relative.axes[2].x - relative.axes[0].z,
        relative.axes[0].y - relative.axes[1].x,
    );
    let cos = 0.5 * (relative.axes[0].x + relative.axes[1].y + relative.axes[2].z - 1.0);
    ((0.5 * sines.norm()).atan2(cos), relative.origin.norm())
}

/// Returns the transform of an origin with its angles as they are written in the file.
fn as_written(origin: &Origin) -> Frame<f64> {
    Frame::from_xyz_rpy(&origin.xyz, &origin.written)
}

/// Changes to the text of a URDF.
pub(super) struct Patches<'a> {
    pub robot: &'a Robot,
    /// Replaced byte ranges with their new text.
    text: Vec<(Range<usize>, String)>,
    moved: Vec<MovedOrigin>,
    /// Indices of the joints whose origin is set; a trunk belongs to several branches.
    set: BTreeSet<usize>,
}

impl<'a> Patches<'a> {
    /// Creates an empty list of changes.
    pub fn new(robot: &'a Robot) -> Self {
        Self { robot, text: Vec::new(), moved: Vec::new(), set: BTreeSet::new() }
    }

    /// Returns the transform through some fixed joints with right angles restored, and changes
    /// their origins to it.
    pub fn through(&mut self, joints: &[usize]) -> Frame<f64> {
        let mut frame = Frame::identity();
        for &index in joints {
            let Some(joint) = self.robot.joints.get(index) else { continue };
            let origin = joint.origin.frame();
            self.set_origin(index, &origin);
            frame = frame.compose(&origin);
        }
        frame
    }

    /// Replaces the origin of the joint with this index by `frame` if they differ and it has not
    /// been set before.
    pub fn set_origin(&mut self, index: usize, frame: &Frame<f64>) {
        if !self.set.insert(index) {
            return;
        }
        let Some(joint) = self.robot.joints.get(index) else { return };
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
        // Attributes that the joint does not have yet.
        let mut more = String::new();
        let mut patch = |name: &str, value: String, at: Option<&Range<usize>>| match at {
            Some(at) => self.text.push((at.clone(), value)),
            // Writing to a String cannot fail.
            None => _ = write!(more, " {name}=\"{value}\""),
        };
        if shifted {
            patch("xyz", triple(&xyz), origin.xyz_value.as_ref());
        }
        if turned {
            match &origin.quaternion_value {
                Some(at) => patch("", quaternion(&rpy), Some(at)),
                None => patch("rpy", triple(&rpy), origin.rpy_value.as_ref()),
            }
        }
        if !more.is_empty() {
            let (at, more) = match &origin.element {
                Some(element) => (element.start + "<origin".len(), more),
                None => self.new_element(&joint.span, &more),
            };
            self.text.push((at..at, more));
        }
        self.moved.push(MovedOrigin { joint: joint.name.clone(), xyz, rpy, distance, angle });
    }

    /// Returns byte index and text of a new `<origin>` in a joint without one. It stands before the
    /// first child of the joint, with the same indentation.
    fn new_element(&self, joint: &Range<usize>, attributes: &str) -> (usize, String) {
        let text = self.robot.source.text.get(joint.clone()).unwrap_or_default();
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

    /// Adds a link with a fixed joint to `parent` at the end of the robot's element; `origin` is
    /// the pose of the link in the parent.
    pub fn append_link(&mut self, link: &str, parent: &str, origin: &Frame<f64>) {
        let source = &self.robot.source.text;
        let xml = Xml::parse(source).ok();
        let end = xml.map_or(source.len(), |xml| xml.root_element().range().end);
        let at = source.get(..end).and_then(|text| text.rfind("</")).unwrap_or(end);
        let escapes = [("&", "&amp;"), ("<", "&lt;"), ("\"", "&quot;")];
        let escaped = |name: &str| {
            escapes
                .iter()
                .fold(name.to_owned(), |text, (letter, escape)| text.replace(letter, escape))
        };
        let (link, parent) = (escaped(link), escaped(parent));
        let (xyz, rpy) = (triple(&origin.origin), triple(&origin.roll_pitch_yaw()));
        let text = format!(
            "  <link name=\"{link}\"/>\n  <joint name=\"{link}_joint\" type=\"fixed\">\n    \
             <parent link=\"{parent}\"/>\n    <child link=\"{link}\"/>\n    \
             <origin xyz=\"{xyz}\" rpy=\"{rpy}\"/>\n  </joint>\n"
        );
        self.text.push((at..at, text));
    }

    /// Returns the changed text and the moved origins.
    pub fn finish(mut self) -> (String, Vec<MovedOrigin>) {
        self.text.sort_by_key(|(span, _)| span.start);
        let source = &self.robot.source.text;
        let (mut text, mut at) = (String::with_capacity(source.len()), 0);
        for (span, new) in &self.text {
            text.push_str(source.get(at..span.start).unwrap_or_default());
            text.push_str(new);
            at = span.end;
        }
        text.push_str(source.get(at..).unwrap_or_default());
        (text, self.moved)
    }
}

/// Returns the roll, pitch and yaw \[rad\] of the same rotation that are nearest to `old`: (r, p,
/// y) and (r + π, π − p, y + π) are the same rotation.
fn nearest(rpy: &Vector3<f64>, old: &Vector3<f64>) -> Vector3<f64> {
    let half = 0.5 * TAU;
    let near = |angles: Vector3<f64>| {
        angles.zip_map(old, |angle, old| angle - ((angle - old) / TAU).round() * TAU)
    };
    let [first, second] = [*rpy, Vector3::new(rpy.x + half, half - rpy.y, rpy.z + half)].map(near);
    if (first - old).norm() <= (second - old).norm() { first } else { second }
}

/// Returns the quaternion x, y, z, w of the rotation by roll, pitch and yaw \[rad\], as text.
fn quaternion(rpy: &Vector3<f64>) -> String {
    let rotation = UnitQuaternion::from_euler_angles(rpy.x, rpy.y, rpy.z);
    let [x, y, z, w] = [rotation.i, rotation.j, rotation.k, rotation.w];
    [x, y, z, w].map(|number| number.to_string()).join(" ")
}

/// Returns three numbers, rounded to 10⁻¹³, as text.
fn triple(values: &Vector3<f64>) -> String {
    let number = |value: &f64| (((value * 1e13).round() / 1e13) + 0.0).to_string();
    values.iter().map(number).collect::<Vec<_>>().join(" ")
}
