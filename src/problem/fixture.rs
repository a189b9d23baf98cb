//! Fixtures: objects around the arm that are touched or measured against instead of a tracked
//! target. Reads `[[point]]`, `[[anchor]]`, `[[surface]]`, and `[[distance]]` between points.
//!
//! All coordinates are in the measuring frame.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::item::Item;
use super::joint::Joint;
use super::section::Section;
use crate::error::{InputError, InputErrorKind, Location};
use crate::quantity::Unit;
use crate::spatial::MAX_NORMAL_TILT;

/// Standard deviation of a known distance if the file states none: one micrometre \[m\].
const DEFAULT_DISTANCE_SIGMA: f64 = 1e-6;

/// Object in the surroundings whose position may be known or unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct Fixture {
    /// Name of the fixture, as used in columns.
    pub name: String,
    /// Kind of the fixture.
    pub kind: FixtureKind,
    /// Coordinates in the order of [`FixtureKind::fields`], SI; `None` for an unknown coordinate.
    pub known: Vec<Option<f64>>,
    /// Place in the file, for errors.
    pub location: Location,
}

/// Kind of a fixture, which determines its coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FixtureKind {
    /// Point that the target is brought to (socket, touch point): x, y, z \[m\].
    Point,
    /// Point to which distances are measured: x, y, z \[m\].
    Anchor,
    /// Plane n·x = d with n = exp(\[(rx, ry, 0)\]×) ẑ. Near −ẑ (rx above 3π/4) n = −exp(\[(rx − π,
    /// ry, 0)\]×) ẑ. Coordinates rx, ry \[rad\], d \[m\].
    Plane,
    /// Sphere: centre x, y, z and radius \[m\].
    Sphere,
}

impl FixtureKind {
    /// Returns the word that names its table, its column and its parameters.
    pub fn word(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Anchor => "anchor",
            Self::Plane | Self::Sphere => "surface",
        }
    }

    /// Returns the names of its coordinates, as used in parameter names.
    pub fn fields(self) -> &'static [&'static str] {
        match self {
            Self::Point | Self::Anchor => &["x", "y", "z"],
            Self::Plane => &["rx", "ry", "d"],
            Self::Sphere => &["x", "y", "z", "radius"],
        }
    }

    /// Returns the keys that declare one of its coordinates.
    pub fn declared_by(self, axis: usize) -> &'static str {
        match (self, axis) {
            (Self::Plane, _) => "normal and at_m",
            (Self::Sphere, 3) => "radius_m",
            _ => "at_m",
        }
    }

    /// Returns the unit of one of its coordinates.
    pub fn unit(self, axis: usize) -> Unit {
        if self == Self::Plane && axis < 2 { Unit::Angle } else { Unit::Length }
    }
}

/// Known distance between two points: `[[distance]]`.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownDistance {
    /// Indices of the two points in [`Problem::fixtures`](super::Problem::fixtures).
    pub between: [usize; 2],
    /// Distance \[m\].
    pub length: f64,
    /// Standard deviation of the distance \[m\].
    pub sigma: f64,
    /// Place in the file, for errors.
    pub location: Location,
}

/// Quantity that a row measures; fixtures are indices into
/// [`Problem::fixtures`](super::Problem::fixtures).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Default)]
pub enum Observation {
    /// Position of the target in the measuring frame: three residuals, six with its orientation.
    #[default]
    Position,
    /// Contact of the target with a point: three residuals.
    Point(usize),
    /// Distance from the target to an anchor: one residual.
    Distance(usize),
    /// Distance of the target from a surface, 0 in contact: one residual.
    Surface(usize),
    /// Tilts of the x and y axes of a frame against the horizontal: two residuals. Frame 0 is the
    /// arm's base, frame i that of joint i.
    Tilt(usize),
    /// Distance between two points, in which the arm takes no part: one residual. The indices are
    /// narrow to keep the enum small.
    Between(u32, u32),
}

impl Observation {
    /// Returns the number of measured coordinates, without those of an orientation.
    pub fn coordinates(self) -> usize {
        match self {
            Self::Position | Self::Point(_) => 3,
            Self::Tilt(_) => 2,
            Self::Distance(_) | Self::Surface(_) | Self::Between(..) => 1,
        }
    }

    /// Returns the square root of [`coordinates`](Self::coordinates).
    pub(crate) fn root(self) -> f64 {
        (self.coordinates() as f64).sqrt()
    }

    /// Returns the name of its kind in results.
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

    /// Returns the fixture that the target is measured against, if there is one.
    pub fn fixture(self) -> Option<usize> {
        self.fixtures()[0].filter(|_| self.is_of_arm())
    }

    /// Returns the fixtures that take part in the observation.
    pub fn fixtures(self) -> [Option<usize>; 2] {
        match self {
            Self::Position | Self::Tilt(_) => [None; 2],
            Self::Point(fixture) | Self::Distance(fixture) | Self::Surface(fixture) => {
                [Some(fixture), None]
            }
            Self::Between(first, second) => [Some(first as usize), Some(second as usize)],
        }
    }

    /// Returns numbers that are equal exactly for equal observations.
    pub(crate) fn key(self) -> [usize; 3] {
        let [first, second] =
            self.fixtures().map(|fixture| fixture.map_or(0, |fixture| fixture + 1));
        let frame = if let Self::Tilt(frame) = self { frame + 1 } else { 0 };
        [first, second, 4 * frame + self.coordinates()]
    }

    /// Returns true if its numbers are angles \[rad\], false if they are lengths \[m\].
    pub fn is_angle(self) -> bool {
        matches!(self, Self::Tilt(_))
    }

    /// Returns true if it measures a position in the measuring frame.
    pub fn is_position(self) -> bool {
        self == Self::Position
    }

    /// Returns true for a contact with a point. Its residual is expressed along the axes of the
    /// arm's base and therefore does not depend on a common displacement of arm and point.
    pub fn is_point(self) -> bool {
        matches!(self, Self::Point(_))
    }

    /// Returns true if the arm takes part in the observation.
    pub fn is_of_arm(self) -> bool {
        !matches!(self, Self::Between(..))
    }
}

/// Returns the frame that a word names: `base`, a joint by its name, or `joint3`. The word `tool`
/// means the frame of joint `tool` (counted from 0).
///
/// # Errors
/// The word names no frame.
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

/// Returns a word that names a frame: the joint's name if it is unambiguous, otherwise `joint3`.
pub(crate) fn frame_word(place: usize, joints: &[Joint], tool: usize) -> String {
    let Some(joint) = place.checked_sub(1).and_then(|joint| joints.get(joint)) else {
        return "base".to_owned();
    };
    let is_it = frame(&joint.name, joints, tool).is_ok_and(|named| named == place);
    if is_it { joint.name.clone() } else { format!("joint{place}") }
}

/// Reads the name of a fixture or target, which parameter names contain; `what` is used in
/// messages.
pub(super) fn name_of(item: &Item<'_, '_>, what: &'static str) -> Result<String, InputError> {
    let name = item.text()?.trim().to_owned();
    let barred = |c: char| c.is_control() || c.is_whitespace() || ".*[]\"".contains(c);
    if name.is_empty() || name.contains(barred) {
        return Err(item.error(InputErrorKind::NotAFixtureName { what, name }));
    }
    Ok(name)
}

/// Reads all fixtures in the order point, anchor, surface, and the known distances.
pub(super) fn read(
    root: &mut Section<'_, '_>,
) -> Result<(Vec<Fixture>, Vec<KnownDistance>), InputError> {
    let mut fixtures: Vec<Fixture> = Vec::new();
    for table in ["point", "anchor", "surface"] {
        for mut section in root.sections(table)? {
            let item = section.require("name", "name = \"…\"")?;
            let name = name_of(&item, "a fixture")?;
            if let Some(first) =
                fixtures.iter().find(|fixture| fixture.kind.word() == table && fixture.name == name)
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

/// Kind of a fixture with its declared coordinates.
type Coordinates = (FixtureKind, Vec<Option<f64>>);

fn place(section: &mut Section<'_, '_>, kind: FixtureKind) -> Result<Coordinates, InputError> {
    let at = section.vector("at", Unit::Length)?;
    Ok((kind, at.map_or(vec![None; 3], |at| at.iter().map(|x| Some(*x)).collect())))
}

fn surface(section: &mut Section<'_, '_>) -> Result<Coordinates, InputError> {
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

/// Returns the coordinates (rx, ry) of a plane from its unit normal \[rad\]; see
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
        .filter(|fixture| fixture.kind == FixtureKind::Point)
        .map(|fixture| &*fixture.name)
        .collect();
    let mut between = Vec::new();
    for point in &points {
        let name = point.text()?;
        let known = fixtures
            .iter()
            .position(|fixture| fixture.kind == FixtureKind::Point && fixture.name == name);
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
        sigma: sigma.unwrap_or(DEFAULT_DISTANCE_SIGMA),
        location: section.location(),
    })
}

/// Returns the error for a word that names no fixture.
pub fn unknown(what: &'static str, name: &str, names: &[&str]) -> InputErrorKind {
    let known = names.iter().map(|&name| name.to_owned()).collect();
    InputErrorKind::UnknownFixture { what, name: name.to_owned(), known }
}
