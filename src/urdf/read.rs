//! From the text of a URDF to its links and joints.

use std::ops::Range;
use std::path::Path;

use nalgebra::Vector3;
use roxmltree::{Document as Xml, Node};

use super::number::{meant_angle, numbers};
use crate::error::{InputError, InputErrorKind, Location, UrdfErrorKind, is_hidden, shortened};
use crate::problem::item::Document;
use crate::spatial::Frame;

/// Numbers, and where they stand.
type Placed<const N: usize> = ([f64; N], Range<usize>);

/// A robot as its URDF says.
pub struct Robot {
    pub(super) source: Document,
    /// Its name.
    pub name: String,
    pub(super) links: Vec<Link>,
    pub(super) joints: Vec<Joint>,
}

/// A link with what it weighs.
pub(super) struct Link {
    pub name: String,
    /// Mass \[kg\], if it has one.
    pub mass: f64,
    /// Centre of mass, link frame \[m\].
    pub com: Vector3<f64>,
}

/// What a joint does.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Kind {
    Revolute,
    Prismatic,
    Fixed,
    /// What no arm has.
    Other(String),
}

/// A joint between two links.
pub(super) struct Joint {
    pub name: String,
    pub kind: Kind,
    pub parent: usize,
    pub child: usize,
    pub origin: Origin,
    /// Unit axis of what moves, joint frame.
    pub axis: Vector3<f64>,
    /// Range of q, infinite where none is given.
    pub limits: (f64, f64),
    /// Limits whose lower one is above the upper one, which are none.
    pub reversed_limits: Option<(f64, f64)>,
    /// Index of the joint that it follows, factor and addend.
    pub mimic: Option<(usize, f64, f64)>,
    /// Its element as bytes of the text.
    pub span: Range<usize>,
}

/// A joint's `<origin>`.
#[derive(Debug, Clone, Default)]
pub(super) struct Origin {
    pub xyz: Vector3<f64>,
    /// Roll, pitch, yaw as written \[rad\].
    pub written: Vector3<f64>,
    /// The same as meant: π/2 for 1.5708.
    pub meant: Vector3<f64>,
    /// The element and the values of its attributes as bytes of the text, where they are there.
    pub element: Option<Range<usize>>,
    pub xyz_value: Option<Range<usize>>,
    pub rpy_value: Option<Range<usize>>,
}

impl Origin {
    /// The transform as meant.
    pub fn frame(&self) -> Frame<f64> {
        Frame::from_xyz_rpy(&self.xyz, &self.meant)
    }
}

impl Robot {
    /// Reads a URDF file.
    ///
    /// # Errors
    /// The first mistake found, a file that cannot be read among them.
    pub fn read(file: &Path) -> Result<Self, InputError> {
        let source = Document::read(file, InputErrorKind::Urdf(UrdfErrorKind::Missing))?;
        Self::of(source)
    }

    /// Reads a URDF from its text; `file` names it in messages.
    ///
    /// # Errors
    /// The first mistake found.
    pub fn parse(text: &str, file: &Path) -> Result<Self, InputError> {
        Self::of(Document { file: file.to_owned(), text: text.into() })
    }

    fn of(source: Document) -> Result<Self, InputError> {
        let text = source.text.clone();
        let xml = Xml::parse(&text).map_err(|error| {
            let location = Location::file(&source.file).at_line(error.pos().row as usize);
            location.error(match error {
                roxmltree::Error::DtdDetected => UrdfErrorKind::DocumentType.into(),
                _ => UrdfErrorKind::Syntax { message: error.to_string() }.into(),
            })
        })?;
        let robot = Reader { source: &source }.robot(xml.root_element())?;
        Ok(Self { source, ..robot })
    }

    /// A mistake at a joint.
    pub(super) fn error_at(&self, joint: usize, mistake: UrdfErrorKind) -> InputError {
        match self.joints.get(joint) {
            Some(own) => {
                self.source.locate(own.span.start..own.span.start + 1).error(mistake.into())
            }
            None => self.error(mistake),
        }
    }

    /// A mistake of the whole.
    pub(super) fn error(&self, mistake: UrdfErrorKind) -> InputError {
        Location::file(&self.source.file).error(mistake.into())
    }

    /// A mistake that is seen only in the problem made of it.
    pub(super) fn as_problem(&self, error: &InputError) -> InputError {
        let key = error.location.key.clone().unwrap_or_default();
        self.error(UrdfErrorKind::AsProblem { key, why: error.kind.to_string() })
    }

    /// The file that was read.
    pub fn file(&self) -> &Path {
        &self.source.file
    }

    /// Index of a link.
    pub(super) fn link(&self, name: &str) -> Result<usize, InputError> {
        let unknown = || {
            let known = self.links.iter().map(|link| link.name.clone()).collect();
            self.error(UrdfErrorKind::NoLink { name: name.to_owned(), known })
        };
        self.links.iter().position(|link| link.name == name).ok_or_else(unknown)
    }
}

struct Reader<'a> {
    source: &'a Document,
}

impl Reader<'_> {
    fn fail<T>(&self, node: Node<'_, '_>, mistake: UrdfErrorKind) -> Result<T, InputError> {
        self.fail_at(node.range(), mistake)
    }

    /// At the first line of a part of the text.
    fn fail_at<T>(&self, span: Range<usize>, mistake: UrdfErrorKind) -> Result<T, InputError> {
        let line = self
            .source
            .text
            .get(span.clone())
            .and_then(|part| part.lines().next())
            .unwrap_or_default();
        Err(self.source.locate(span.start..span.start + line.len()).error(mistake.into()))
    }

    fn robot(&self, root: Node<'_, '_>) -> Result<Robot, InputError> {
        if root.tag_name().name() != "robot" {
            return self.fail(
                root,
                UrdfErrorKind::NotARobot { found: shortened(root.tag_name().name(), 40) },
            );
        }
        if let Some(node) = root
            .descendants()
            .find(|node| node.tag_name().namespace().is_some_and(|own| own.contains("xacro")))
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

    fn attribute<'n>(&self, node: Node<'n, '_>, name: &'static str) -> Result<&'n str, InputError> {
        if let Some(value) = node.attribute(name) {
            return Ok(value);
        }
        let element = shortened(node.tag_name().name(), 40);
        self.fail(node, UrdfErrorKind::NoAttribute { element, attribute: name })
    }

    fn name(&self, node: Node<'_, '_>) -> Result<String, InputError> {
        let name = self.attribute(node, "name")?;
        let bad = name.trim().is_empty() || name.chars().any(is_hidden) || name.contains("${");
        if bad { self.fail(node, UrdfErrorKind::BadName) } else { Ok(name.to_owned()) }
    }

    /// N numbers of an attribute, and where they stand; `None` where it is not there.
    fn numbers<const N: usize>(
        &self,
        node: Node<'_, '_>,
        attribute: &str,
    ) -> Result<Option<Placed<N>>, InputError> {
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

    fn link(&self, node: Node<'_, '_>) -> Result<Link, InputError> {
        let name = self.name(node)?;
        let child = |node: Node<'_, '_>, tag: &str| {
            node.children().find(|own| own.has_tag_name(tag)).map(|own| own.id())
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

    fn joint(
        &self,
        node: Node<'_, '_>,
        links: &[Link],
        names: &[&str],
    ) -> Result<Joint, InputError> {
        let name = self.name(node)?;
        let child = |tag: &'static str| node.children().find(move |own| own.has_tag_name(tag));
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
                    UrdfErrorKind::NoLink { name: shortened(name, 80), known: known() },
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
        let turns_on = node.attribute("type") == Some("continuous");
        let written = match child("limit").filter(|_| moves && !turns_on) {
            Some(limit) => {
                let one = |which| {
                    Ok::<_, InputError>(
                        self.numbers::<1>(limit, which)?.map_or(0.0, |([value], _)| value),
                    )
                };
                Some((one("lower")?, one("upper")?))
            }
            None => None,
        };
        // Both are 0 where they are left out; a range of nothing is none.
        let limits = written
            .filter(|(lower, upper)| lower < upper)
            .unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        let reversed_limits = written.filter(|(lower, upper)| lower > upper);
        let mimic = match child("mimic").filter(|_| moves) {
            Some(element) => {
                let leader = self.attribute(element, "joint")?;
                let Some(leader) = names.iter().position(|name| *name == leader) else {
                    let known = names.iter().map(|&name| name.to_owned()).collect();
                    return self.fail(
                        element,
                        UrdfErrorKind::NoJoint { name: shortened(leader, 80), known },
                    );
                };
                let one = |which, absent| {
                    Ok::<_, InputError>(
                        self.numbers::<1>(element, which)?.map_or(absent, |([value], _)| value),
                    )
                };
                Some((leader, one("multiplier", 1.0)?, one("offset", 0.0)?))
            }
            None => None,
        };
        Ok(Joint {
            name,
            kind,
            parent,
            child: child_link,
            origin,
            axis,
            limits,
            reversed_limits,
            mimic,
            span: node.range(),
        })
    }

    fn origin(&self, node: Node<'_, '_>) -> Result<Origin, InputError> {
        let mut origin = Origin { element: Some(node.range()), ..Origin::default() };
        if let Some((xyz, span)) = self.numbers::<3>(node, "xyz")? {
            (origin.xyz, origin.xyz_value) = (xyz.into(), Some(span));
        }
        if let Some((rpy, span)) = self.numbers::<3>(node, "rpy")? {
            (origin.written, origin.rpy_value) = (rpy.into(), Some(span));
            let words = node.attribute("rpy").unwrap_or_default().split_ascii_whitespace();
            let meant: Vec<f64> =
                words.zip(rpy).map(|(word, value)| meant_angle(word).unwrap_or(value)).collect();
            origin.meant = Vector3::from_iterator(meant);
        }
        Ok(origin)
    }
}
