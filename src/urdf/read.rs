//! Reader of links and joints from the text of a URDF.

use std::f64::consts::FRAC_PI_2;
use std::ops::Range;
use std::path::Path;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use roxmltree::{Document as Xml, Node};

use super::not_closed::not_closed;
use super::number::numbers;
use crate::error::{
    InputError, InputErrorKind, Location, UrdfErrorKind, XML, is_hidden, shortened, text_format,
};
use crate::problem::item::Document;
use crate::quantity::unrounded_right_angle;
use crate::spatial::Frame;

/// Largest deviation of a quaternion's norm from 1 that is attributed to rounding of the
/// components.
const MAX_QUATERNION_NORM_ERROR: f64 = 1e-3;
/// Largest deviation of an angle from a right angle that is taken for rounding of a quaternion with
/// seven decimals \[rad\].
const MAX_QUATERNION_ROUNDING: f64 = 2e-7;

/// Largest plausible limit of a revolute joint \[rad\]: nearly five turns, more than joints with
/// several turns have. Larger limits are probably degrees.
const MAX_REVOLUTE_LIMIT: f64 = 30.0;

/// Numbers of an attribute, with their byte range in the text.
type LocatedNumbers<const N: usize> = ([f64; N], Range<usize>);

/// Robot described by a URDF.
pub struct Robot {
    pub(super) source: Document,
    /// Name of the robot.
    pub name: String,
    pub(super) links: Vec<Link>,
    pub(super) joints: Vec<Joint>,
}

/// Link with its mass.
pub(super) struct Link {
    pub name: String,
    /// Mass \[kg\]; 0 without inertial data.
    pub mass: f64,
    /// Centre of mass, link frame \[m\].
    pub com: Vector3<f64>,
}

/// Type of a joint.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    Revolute,
    Prismatic,
    Fixed,
    /// Joint type that is not supported.
    Other(String),
}

/// Joint between two links.
pub(super) struct Joint {
    pub name: String,
    pub kind: Kind,
    /// Index of the parent link.
    pub parent: usize,
    /// Index of the child link.
    pub child: usize,
    /// Pose of the joint frame in the frame of the parent link.
    pub origin: Origin,
    /// Unit axis of the motion, joint frame.
    pub axis: Vector3<f64>,
    /// True if the joint moves and has no `<axis>`; its axis is then x.
    pub lacks_axis: bool,
    /// Range of q \[rad\] or \[m\], infinite without limits.
    pub limits: (f64, f64),
    /// Limits \[rad\] or \[m\] as (lower, upper) that are ignored because the lower one is above
    /// the upper one; `None` if the limits are valid.
    pub reversed_limits: Option<(f64, f64)>,
    /// Limits as written that are ignored because they look like degrees; `None` for other limits.
    pub limits_in_degrees: Option<(f64, f64)>,
    /// Index of the joint that a mimic joint follows, factor and offset; `None` for other joints.
    pub mimic: Option<(usize, f64, f64)>,
    /// Error of a `<mimic>` that names no joint or is invalid; `None` without such an error. It is
    /// reported only if the chain needs the joint.
    pub broken_mimic: Option<(Location, UrdfErrorKind)>,
    /// Byte range of the joint's element in the text.
    pub span: Range<usize>,
}

/// Element `<origin>` of a joint; the identity if the joint has none.
#[derive(Debug, Clone, Default)]
pub(super) struct Origin {
    /// Position \[m\].
    pub xyz: Vector3<f64>,
    /// Roll, pitch, yaw as written \[rad\].
    pub written: Vector3<f64>,
    /// Roll, pitch, yaw with rounded right angles restored, π/2 for 1.5708 \[rad\].
    pub meant: Vector3<f64>,
    /// Byte ranges of the element and its attribute values, if present.
    pub element: Option<Range<usize>>,
    pub xyz_value: Option<Range<usize>>,
    pub rpy_value: Option<Range<usize>>,
    pub quaternion_value: Option<Range<usize>>,
}

impl Origin {
    /// Returns the transform, with rounded right angles restored.
    pub fn frame(&self) -> Frame<f64> {
        Frame::from_xyz_rpy(&self.xyz, &self.meant)
    }
}

impl Robot {
    /// Reads a URDF file.
    ///
    /// # Errors
    /// Returns the first error in the file, or an error if the file cannot be read.
    pub fn read(file: &Path) -> Result<Self, InputError> {
        let source = Document::read(file, InputErrorKind::Urdf(UrdfErrorKind::Missing))?;
        Self::from_document(source)
    }

    /// Parses a URDF; `file` names the text in messages.
    ///
    /// # Errors
    /// Returns the first error in the text.
    #[doc(hidden)]
    pub fn parse(text: &str, file: &Path) -> Result<Self, InputError> {
        Self::from_document(Document { file: file.to_owned(), text: text.into() })
    }

    fn from_document(source: Document) -> Result<Self, InputError> {
        let text = source.text.clone();
        if let Some(found) = text_format(&text).filter(|format| *format != XML) {
            let expected = InputErrorKind::from(UrdfErrorKind::Missing).expected_file();
            return Err(Location::file(&source.file)
                .at_line(1)
                .error(InputErrorKind::OtherFormat { found, expected }));
        }
        let xml = Xml::parse(&text).map_err(|error| {
            if let Some(error) = not_closed(&source, &error) {
                return error;
            }
            let location = Location::file(&source.file).at_line(error.pos().row as usize);
            location.error(match error {
                roxmltree::Error::DtdDetected => UrdfErrorKind::DocumentType,
                _ => UrdfErrorKind::Syntax { message: error.to_string() },
            })
        })?;
        let robot = Reader { source: &source }.robot(xml.root_element())?;
        Ok(Self { source, ..robot })
    }

    /// Returns an error at a joint.
    pub(super) fn error_at(&self, joint: usize, kind: UrdfErrorKind) -> InputError {
        match self.joints.get(joint) {
            Some(joint) => self.source.locate(joint.span.start..joint.span.start + 1).error(kind),
            None => self.error(kind),
        }
    }

    /// Returns an error about the whole file.
    pub(super) fn error(&self, kind: UrdfErrorKind) -> InputError {
        Location::file(&self.source.file).error(kind)
    }

    /// Returns the path of the file.
    pub(crate) fn file(&self) -> &Path {
        &self.source.file
    }

    /// Returns the name of a link; empty for none.
    pub(super) fn link_name(&self, link: usize) -> String {
        self.links.get(link).map_or_else(String::new, |link| link.name.clone())
    }

    /// Returns the index of the link with a name; an error if there is none.
    pub(super) fn link(&self, name: &str) -> Result<usize, InputError> {
        let unknown = || {
            let known = self.links.iter().map(|link| link.name.clone()).collect();
            let joint = self.joints.iter().find(|joint| joint.name == name);
            let child = joint.and_then(|joint| self.links.get(joint.child));
            let child = child.map(|link| link.name.clone());
            self.error(UrdfErrorKind::NoLink { name: name.to_owned(), known, child })
        };
        self.links.iter().position(|link| link.name == name).ok_or_else(unknown)
    }
}

/// Returns the multiple of 90° \[rad\] from which `angle` only deviates by the rounding of a
/// quaternion; if there is none, `angle` itself.
fn right_angle_of_quaternion(angle: f64) -> f64 {
    let right = (angle / FRAC_PI_2).round() * FRAC_PI_2;
    if (angle - right).abs() < MAX_QUATERNION_ROUNDING { right } else { angle }
}

/// Reader of the elements of a URDF.
struct Reader<'a> {
    source: &'a Document,
}

impl Reader<'_> {
    /// Returns an error at the first line of an element.
    fn fail<T>(&self, node: Node<'_, '_>, kind: UrdfErrorKind) -> Result<T, InputError> {
        self.fail_at(node.range(), kind)
    }

    /// Returns an error at the first line of `span`, a byte range of the text.
    fn fail_at<T>(&self, span: Range<usize>, kind: UrdfErrorKind) -> Result<T, InputError> {
        let line = self
            .source
            .text
            .get(span.clone())
            .and_then(|part| part.lines().next())
            .unwrap_or_default();
        Err(self.source.locate(span.start..span.start + line.len()).error(kind))
    }

    /// Reads the element `<robot>`.
    fn robot(&self, root: Node<'_, '_>) -> Result<Robot, InputError> {
        if root.tag_name().name() != "robot" {
            return self.fail(
                root,
                UrdfErrorKind::NotARobot { found: shortened(root.tag_name().name(), 40) },
            );
        }
        if let Some(node) = root
            .descendants()
            .find(|node| node.tag_name().namespace().is_some_and(|uri| uri.contains("xacro")))
        {
            return self.fail(node, UrdfErrorKind::Xacro);
        }
        let name = root.attribute("name").unwrap_or("arm").to_owned();
        let mut links: Vec<Link> = Vec::new();
        let of = |tag| root.children().filter(move |node| node.has_tag_name(tag));
        for node in of("link") {
            let link = self.link(node)?;
            if links.iter().any(|other| other.name == link.name) {
                return self.fail(node, UrdfErrorKind::Repeated { what: "link", name: link.name });
            }
            links.push(link);
        }
        let names: Vec<&str> =
            of("joint").map(|node| node.attribute("name").unwrap_or_default()).collect();
        let mut joints: Vec<Joint> = Vec::new();
        for node in of("joint") {
            let joint = self.joint(node, &links, &names)?;
            if joints.iter().any(|other| other.name == joint.name) {
                return self
                    .fail(node, UrdfErrorKind::Repeated { what: "joint", name: joint.name });
            }
            joints.push(joint);
        }
        let source = Document { file: self.source.file.clone(), text: self.source.text.clone() };
        Ok(Robot { source, name, links, joints })
    }

    /// Returns the value of an attribute, which must exist.
    fn attribute<'n>(&self, node: Node<'n, '_>, name: &'static str) -> Result<&'n str, InputError> {
        if let Some(value) = node.attribute(name) {
            return Ok(value);
        }
        let element = shortened(node.tag_name().name(), 40);
        self.fail(node, UrdfErrorKind::NoAttribute { element, attribute: name })
    }

    /// Reads the attribute `name`, which must not be blank.
    fn name(&self, node: Node<'_, '_>) -> Result<String, InputError> {
        let name = self.attribute(node, "name")?;
        let bad = name.trim().is_empty() || name.chars().any(is_hidden) || name.contains("${");
        if bad { self.fail(node, UrdfErrorKind::BadName) } else { Ok(name.to_owned()) }
    }

    /// Reads N numbers of an attribute with their byte range; `None` if it is absent.
    fn numbers<const N: usize>(
        &self,
        node: Node<'_, '_>,
        attribute: &str,
    ) -> Result<Option<LocatedNumbers<N>>, InputError> {
        let Some(found) = node.attribute_node(attribute) else { return Ok(None) };
        let span = found.range_value();
        match numbers(found.value()) {
            Some(values) => Ok(Some((values, span))),
            None if found.value().contains("${") => self.fail_at(span, UrdfErrorKind::Xacro),
            None => self.fail_at(
                span,
                UrdfErrorKind::NotNumbers { text: shortened(found.value(), 40), count: N },
            ),
        }
    }

    /// Reads an element `<link>`.
    fn link(&self, node: Node<'_, '_>) -> Result<Link, InputError> {
        let name = self.name(node)?;
        let child = |node: Node<'_, '_>, tag: &str| {
            node.children().find(|child| child.has_tag_name(tag)).map(|child| child.id())
        };
        let get = |id| node.document().get_node(id);
        let Some(inertial) = child(node, "inertial").and_then(get) else {
            return Ok(Link { name, mass: 0.0, com: Vector3::zeros() });
        };
        let mass = match child(inertial, "mass").and_then(get) {
            Some(mass) => match self.numbers::<1>(mass, "value")? {
                Some(([value], span)) if value < 0.0 => {
                    return self
                        .fail_at(span, UrdfErrorKind::NegativeMass { text: value.to_string() });
                }
                Some(([value], _)) => value,
                None => 0.0,
            },
            None => 0.0,
        };
        let com = match child(inertial, "origin").and_then(get) {
            Some(origin) => self.numbers::<3>(origin, "xyz")?.map_or([0.0; 3], |(xyz, _)| xyz),
            None => [0.0; 3],
        };
        Ok(Link { name, mass, com: com.into() })
    }

    /// Reads an element `<joint>`; `names` are those of all joints.
    fn joint(
        &self,
        node: Node<'_, '_>,
        links: &[Link],
        names: &[&str],
    ) -> Result<Joint, InputError> {
        let name = self.name(node)?;
        let child = |tag: &'static str| node.children().find(move |child| child.has_tag_name(tag));
        let kind = match self.attribute(node, "type")? {
            "revolute" | "continuous" => Kind::Revolute,
            "prismatic" => Kind::Prismatic,
            "fixed" => Kind::Fixed,
            other => Kind::Other(shortened(other, 40)),
        };
        let end = |tag: &'static str| {
            let Some(element) = child(tag) else {
                return self.fail(node, UrdfErrorKind::NoElement { element: tag });
            };
            let name = self.attribute(element, "link")?;
            let known = || links.iter().map(|link| link.name.clone()).collect();
            match links.iter().position(|link| link.name == name) {
                Some(link) => Ok(link),
                None => self.fail(
                    element,
                    UrdfErrorKind::NoLink {
                        name: shortened(name, 80),
                        known: known(),
                        child: None,
                    },
                ),
            }
        };
        let (parent, child_link) = (end("parent")?, end("child")?);
        let origin = child("origin").map_or(Ok(Origin::default()), |origin| self.origin(origin))?;
        let moves = matches!(kind, Kind::Revolute | Kind::Prismatic);
        let mut axis = Vector3::x();
        if let Some(element) = child("axis").filter(|_| moves)
            && let Some((xyz, span)) = self.numbers::<3>(element, "xyz")?
        {
            let given = Vector3::from(xyz);
            let scaled = given / given.amax().max(f64::MIN_POSITIVE);
            axis = match scaled.try_normalize(0.0) {
                Some(axis) => axis,
                None => return self.fail_at(span, UrdfErrorKind::NoAxis),
            };
        }
        let is_continuous = node.attribute("type") == Some("continuous");
        let written = match child("limit").filter(|_| moves && !is_continuous) {
            Some(limit) => {
                let limit_value = |which| {
                    Ok::<_, InputError>(
                        self.numbers::<1>(limit, which)?.map_or(0.0, |([value], _)| value),
                    )
                };
                Some((limit_value("lower")?, limit_value("upper")?))
            }
            None => None,
        };
        let in_degrees = written.filter(|limits| {
            kind == Kind::Revolute && limits.0.abs().max(limits.1.abs()) > MAX_REVOLUTE_LIMIT
        });
        // Absent limits are 0; an empty range means no limits.
        let limits = written
            .filter(|(lower, upper)| lower < upper && in_degrees.is_none())
            .unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        let reversed_limits = written.filter(|(lower, upper)| lower > upper);
        let mimic = child("mimic").filter(|_| moves).map(|element| self.mimic(element, names));
        // The chain may not need this joint, so a broken element is no error yet.
        let (mimic, broken_mimic) = match mimic.transpose() {
            Ok(mimic) => (mimic, None),
            Err(InputError { location, kind }) => match *kind {
                InputErrorKind::Urdf(kind) => (None, Some((*location, kind))),
                other => return Err(location.error(other)),
            },
        };
        Ok(Joint {
            name,
            kind,
            parent,
            child: child_link,
            origin,
            axis,
            lacks_axis: moves && child("axis").is_none(),
            limits,
            reversed_limits,
            limits_in_degrees: in_degrees,
            mimic,
            broken_mimic,
            span: node.range(),
        })
    }

    /// Reads the index of the leading joint, factor and offset of a `<mimic>`.
    fn mimic(
        &self,
        element: Node<'_, '_>,
        names: &[&str],
    ) -> Result<(usize, f64, f64), InputError> {
        let leader = self.attribute(element, "joint")?;
        let Some(leader) = names.iter().position(|name| *name == leader) else {
            let known = names.iter().map(|&name| name.to_owned()).collect();
            let kind = UrdfErrorKind::NoJoint { name: shortened(leader, 80), known };
            return self.fail(element, kind);
        };
        let number = |which, default| {
            let found = self.numbers::<1>(element, which)?;
            Ok::<_, InputError>(found.map_or(default, |([value], _)| value))
        };
        Ok((leader, number("multiplier", 1.0)?, number("offset", 0.0)?))
    }

    /// Reads an element `<origin>`.
    fn origin(&self, node: Node<'_, '_>) -> Result<Origin, InputError> {
        let mut origin = Origin { element: Some(node.range()), ..Origin::default() };
        if let Some((xyz, span)) = self.numbers::<3>(node, "xyz")? {
            (origin.xyz, origin.xyz_value) = (xyz.into(), Some(span));
        }
        if let Some((rpy, span)) = self.numbers::<3>(node, "rpy")? {
            (origin.written, origin.rpy_value) = (rpy.into(), Some(span));
            let words = node.attribute("rpy").unwrap_or_default().split_ascii_whitespace();
            let meant: Vec<f64> = words
                .zip(rpy)
                .map(|(word, value)| unrounded_right_angle(word).unwrap_or(value))
                .collect();
            origin.meant = Vector3::from_iterator(meant);
        }
        if let Some((quaternion, span)) = self.numbers::<4>(node, "quat_xyzw")? {
            if origin.rpy_value.is_some() {
                return self.fail(node, UrdfErrorKind::TwoRotations);
            }
            let [x, y, z, w] = quaternion;
            let quaternion = Quaternion::new(w, x, y, z);
            if (quaternion.norm() - 1.0).abs() > MAX_QUATERNION_NORM_ERROR {
                let text = shortened(node.attribute("quat_xyzw").unwrap_or_default(), 80);
                return self.fail_at(span, UrdfErrorKind::NotAQuaternion { text });
            }
            let mut frame = Frame::identity();
            frame.rotate(&UnitQuaternion::from_quaternion(quaternion).scaled_axis());
            origin.written = frame.roll_pitch_yaw();
            origin.meant = origin.written.map(right_angle_of_quaternion);
            origin.quaternion_value = Some(span);
        }
        Ok(origin)
    }
}
