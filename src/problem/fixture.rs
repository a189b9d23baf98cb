//! What stands around the arm and is touched or measured against instead of a tracker: `[[point]]`,
//! `[[anchor]]`, `[[surface]]`, and the known distances between points.
//!
//! All of it stands in the measuring frame.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::item::Item;
use super::joint::Joint;
use super::section::Section;
use crate::error::{InputError, InputErrorKind, Location};
use crate::quantity::Unit;
use crate::spatial::MAX_NORMAL_TILT;

/// σ of a known distance that says nothing of it: one micrometre \[m\].
const EXACT: f64 = 1e-6;

/// Something in the surroundings, with a few numbers that say where it is, known or not.
#[derive(Debug, Clone, PartialEq)]
pub struct Fixture {
    /// Its name, as columns have it.
    pub name: String,
    /// What it is.
    pub kind: FixtureKind,
    /// Its numbers in the order of [`FixtureKind::fields`], SI; `None`: not known, to be found.
    pub known: Vec<Option<f64>>,
    /// For errors.
    pub location: Location,
}

/// Kinds of fixtures, and what their numbers are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FixtureKind {
    /// A point that the target comes to: a socket, a touch point; x, y, z \[m\].
    Point,
    /// A point to which distances are measured; x, y, z \[m\].
    Anchor,
    /// A plane n·x = d with n = exp(\[(rx, ry, 0)\]×) ẑ, or near −ẑ, with rx above 3π/4, n =
    /// −exp(\[(rx − π, ry, 0)\]×) ẑ; rx, ry \[rad\], d \[m\].
    Plane,
    /// A sphere: centre x, y, z and radius \[m\].
    Sphere,
}

impl FixtureKind {
    /// The word that names its table, its column and its parameters.
    pub fn word(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Anchor => "anchor",
            Self::Plane | Self::Sphere => "surface",
        }
    }

    /// Names of its numbers, behind the dot of a parameter.
    pub fn fields(self) -> &'static [&'static str] {
        match self {
            Self::Point | Self::Anchor => &["x", "y", "z"],
            Self::Plane => &["rx", "ry", "d"],
            Self::Sphere => &["x", "y", "z", "radius"],
        }
    }

    /// The keys that declare one of its numbers.
    pub fn declared_by(self, axis: usize) -> &'static str {
        match (self, axis) {
            (Self::Plane, _) => "normal and at_m",
            (Self::Sphere, 3) => "radius_m",
            _ => "at_m",
        }
    }

    /// Kind of quantity of one of its numbers.
    pub fn unit(self, axis: usize) -> Unit {
        if self == Self::Plane && axis < 2 { Unit::Angle } else { Unit::Length }
    }
}

/// `[[distance]]`: a known distance between two points.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownDistance {
    /// The points, as places in [`Problem::fixtures`](super::Problem::fixtures).
    pub between: [usize; 2],
    /// Distance \[m\].
    pub length: f64,
    /// 1 σ \[m\].
    pub sigma: f64,
    /// For errors.
    pub location: Location,
}

/// What a row measures; fixtures are places in [`Problem::fixtures`](super::Problem::fixtures).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub enum Observation {
    /// The position of the target, measuring frame; three numbers, six with its orientation.
    #[default]
    Position,
    /// The target is at a point: three residuals.
    Point(usize),
    /// Distance from the target to an anchor: one number.
    Distance(usize),
    /// Distance of the target from a surface, 0 in contact: one number.
    Surface(usize),
    /// Tilts of the x and the y axis of a frame against the horizontal: two numbers. Frame 0 is the
    /// arm's base, frame i that of joint i.
    Tilt(usize),
    /// Distance between two points, without the arm: one number. Indices are narrow so that both
    /// take the room of one.
    Between(u32, u32),
}

impl Observation {
    /// How many numbers it measures of a position or contact.
    pub fn coordinates(self) -> usize {
        match self {
            Self::Position | Self::Point(_) => 3,
            Self::Tilt(_) => 2,
            Self::Distance(_) | Self::Surface(_) | Self::Between(..) => 1,
        }
    }

    /// √ of that.
    pub(crate) fn root(self) -> f64 {
        (self.coordinates() as f64).sqrt()
    }

    /// Its kind in results.
    pub fn kind(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::Point(_) => "point",
            Self::Distance(_) => "distance",
            Self::Surface(_) => "surface",
            Self::Tilt(_) => "tilt",
            Self::Between(..) => "known distance",
        }
    }

    /// The fixture against which the target is measured, if it is measured against one.
    pub fn fixture(self) -> Option<usize> {
        self.fixtures()[0].filter(|_| self.is_of_arm())
    }

    /// The fixtures that it speaks of.
    pub fn fixtures(self) -> [Option<usize>; 2] {
        match self {
            Self::Position | Self::Tilt(_) => [None; 2],
            Self::Point(fixture) | Self::Distance(fixture) | Self::Surface(fixture) => {
                [Some(fixture), None]
            }
            Self::Between(first, second) => [Some(first as usize), Some(second as usize)],
        }
    }

    /// What tells it from others, as numbers.
    pub(crate) fn key(self) -> [usize; 3] {
        let [first, second] =
            self.fixtures().map(|fixture| fixture.map_or(0, |fixture| fixture + 1));
        let frame = if let Self::Tilt(frame) = self { frame + 1 } else { 0 };
        [first, second, 4 * frame + self.coordinates()]
    }

    /// Whether its numbers are angles \[rad\] rather than lengths \[m\].
    pub fn is_angle(self) -> bool {
        matches!(self, Self::Tilt(_))
    }

    /// Whether it measures where something is in the measuring frame, rather than against something
    /// else.
    pub fn is_position(self) -> bool {
        self == Self::Position
    }

    /// Whether the target is at a point; what is missing to that is told along the axes of the
    /// arm's base, so that it does not depend on where arm and point stand together.
    pub fn is_point(self) -> bool {
        matches!(self, Self::Point(_))
    }

    /// Whether the arm takes part in it.
    pub fn is_of_arm(self) -> bool {
        !matches!(self, Self::Between(..))
    }
}

/// The frame of an arm that a word names: `base`, a joint by its name, or `joint3`; `tool` is that
/// of the joint that holds the tool, number `tool` counted from 0.
///
/// # Errors
/// It names none.
pub(crate) fn frame(word: &str, joints: &[Joint], tool: usize) -> Result<usize, InputErrorKind> {
    let named = || joints.iter().position(|joint| joint.name == word).map(|index| index + 1);
    let numbered = || {
        word.strip_prefix("joint")?
            .parse()
            .ok()
            .filter(|number| (1..=joints.len()).contains(number))
    };
    match word {
        "base" => Ok(0),
        "tool" => Ok(tool + 1),
        _ => named().or_else(numbered).ok_or_else(|| {
            let joints = joints.iter().map(|joint| joint.name.clone());
            let known = std::iter::once("base".to_owned())
                .chain(joints)
                .chain(["tool".to_owned()])
                .collect();
            InputErrorKind::UnknownFixture { what: "frame", name: word.to_owned(), known }
        }),
    }
}

/// A word that names a frame of an arm: the joint's own, unless that names another.
pub(crate) fn frame_word(place: usize, joints: &[Joint], tool: usize) -> String {
    let Some(joint) = place.checked_sub(1).and_then(|joint| joints.get(joint)) else {
        return "base".to_owned();
    };
    let is_it = frame(&joint.name, joints, tool).is_ok_and(|named| named == place);
    if is_it { joint.name.clone() } else { format!("joint{place}") }
}

/// The name of `what` is measured, or measured against: parameters go by it.
pub(super) fn name_of(item: &Item<'_, '_>, what: &'static str) -> Result<String, InputError> {
    let name = item.text()?.trim().to_owned();
    let barred = |c: char| c.is_control() || c.is_whitespace() || ".*[]\"".contains(c);
    if name.is_empty() || name.contains(barred) {
        return Err(item.error(InputErrorKind::NotAFixtureName { what, name }));
    }
    Ok(name)
}

/// Every fixture, in the order point, anchor, surface, and the known distances.
pub(super) fn read(
    root: &mut Section<'_, '_>,
) -> Result<(Vec<Fixture>, Vec<KnownDistance>), InputError> {
    let mut fixtures: Vec<Fixture> = Vec::new();
    for table in ["point", "anchor", "surface"] {
        for mut section in root.sections(table)? {
            let item = section.require("name", "name = \"…\"")?;
            let name = name_of(&item, "a fixture")?;
            if let Some(first) =
                fixtures.iter().find(|own| own.kind.word() == table && own.name == name)
            {
                let line = first.location.line.unwrap_or(0);
                return Err(item.error(InputErrorKind::RepeatedFixture {
                    what: table,
                    name,
                    line,
                }));
            }
            let (kind, known) = match table {
                "point" => place(&mut section, FixtureKind::Point)?,
                "anchor" => place(&mut section, FixtureKind::Anchor)?,
                _ => surface(&mut section)?,
            };
            section.finish()?;
            fixtures.push(Fixture { name, kind, known, location: section.location() });
        }
    }
    let distances =
        root.sections("distance")?.into_iter().map(|section| distance(section, &fixtures));
    let distances = distances.collect::<Result<_, _>>()?;
    Ok((fixtures, distances))
}

/// A kind and its numbers as far as they are declared.
type Known = (FixtureKind, Vec<Option<f64>>);

fn place(section: &mut Section<'_, '_>, kind: FixtureKind) -> Result<Known, InputError> {
    let at = section.vector("at", Unit::Length)?;
    Ok((kind, at.map_or(vec![None; 3], |at| at.iter().map(|x| Some(*x)).collect())))
}

fn surface(section: &mut Section<'_, '_>) -> Result<Known, InputError> {
    section.require("kind", "kind = \"plane\" or \"sphere\"")?;
    let kinds = [FixtureKind::Plane, FixtureKind::Sphere];
    let kind = section.word("kind", &["plane", "sphere"], &kinds)?.unwrap_or(FixtureKind::Plane);
    if kind == FixtureKind::Sphere {
        let (_, mut known) = place(section, kind)?;
        known.push(
            section
                .positive("radius", Unit::Length, |value| InputErrorKind::NotPositive { value })?,
        );
        return Ok((kind, known));
    }
    let at = section.vector("at", Unit::Length)?;
    let Some(item) = section.get("normal") else { return Ok((kind, vec![None, None, None])) };
    let normal = item.vector()?;
    let length = normal.norm();
    if length == 0.0 {
        return Err(item.error(InputErrorKind::NoDirection));
    }
    let [rx, ry] = lean(&(normal / length));
    Ok((kind, vec![Some(rx), Some(ry), at.map(|at| at.dot(&normal) / length)]))
}

/// The first two numbers (rx, ry) of a plane with this normal, of length 1 \[rad\]; see
/// [`plane_normal`](crate::spatial::plane_normal).
pub fn lean(normal: &Vector3<f64>) -> [f64; 2] {
    let across = normal.x.hypot(normal.y);
    let angle = across.atan2(normal.z);
    if angle > MAX_NORMAL_TILT {
        let [rx, ry] = lean(&-normal);
        [PI + rx, ry]
    } else if across > 0.0 {
        [-normal.y / across * angle, normal.x / across * angle]
    } else {
        [0.0; 2]
    }
}

fn distance(
    mut section: Section<'_, '_>,
    fixtures: &[Fixture],
) -> Result<KnownDistance, InputError> {
    let item = section.require("between", "between = [\"…\", \"…\"], two points")?;
    let points = item.list("a list of two names of points")?;
    let names: Vec<&str> = fixtures
        .iter()
        .filter(|own| own.kind == FixtureKind::Point)
        .map(|own| &*own.name)
        .collect();
    let mut between = Vec::new();
    for point in &points {
        let name = point.text()?;
        let known =
            fixtures.iter().position(|own| own.kind == FixtureKind::Point && own.name == name);
        between.push(known.ok_or_else(|| point.error(unknown("point", name, &names)))?);
    }
    let [first, second] = between[..] else {
        return Err(item.error(InputErrorKind::NotTwoPoints { found: points.len() }));
    };
    if first == second {
        return Err(item.error(InputErrorKind::NotTwoPoints { found: 1 }));
    }
    let mut length = None;
    for (key, unit) in [("mm", 1e-3), ("m", 1.0)] {
        if let Some(item) = section.get(key) {
            let value = item.number()?;
            if value <= 0.0 {
                return Err(item.error(InputErrorKind::NotPositive { value }));
            }
            if length.replace(value * unit).is_some() {
                return Err(item.error(InputErrorKind::GivenTwice { first: "mm".to_owned() }));
            }
        }
    }
    let length = length.ok_or_else(|| section.missing("mm", "mm = … or m = …"))?;
    let sigma =
        section.positive("sigma", Unit::Length, |value| InputErrorKind::NotPositive { value })?;
    section.finish()?;
    Ok(KnownDistance {
        between: [first, second],
        length,
        sigma: sigma.unwrap_or(EXACT),
        location: section.location(),
    })
}

/// The mistake of a word that names no fixture.
pub fn unknown(what: &'static str, name: &str, names: &[&str]) -> InputErrorKind {
    let known = names.iter().map(|&name| name.to_owned()).collect();
    InputErrorKind::UnknownFixture { what, name: name.to_owned(), known }
}
