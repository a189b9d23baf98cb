//! Fixtures: objects around the arm that are touched or measured against instead of a tracked
//! target. Reads `[[point]]`, `[[anchor]]`, `[[surface]]`, and `[[distance]]` between points.
//!
//! All coordinates are in the measuring frame, except those of cameras and markers on the arm.

use std::f64::consts::PI;

use nalgebra::Vector3;

use super::Problem;
use super::camera::{Carriers, DeclaredFixture, read_camera, read_marker};
use super::frame::frame_word;
use super::item::name_of;
use super::section::Section;
use crate::error::{InputError, InputErrorKind, Location};
use crate::laws::NamedCamera;
use crate::observation::{Content, Field, FixtureKind, Observation};
use crate::quantity::Unit;
use crate::spatial::MAX_NORMAL_TILT;

/// Standard deviation of a known distance if the file states none: one micrometre \[m\].
const DEFAULT_DISTANCE_SIGMA: f64 = 1e-6;

/// Index of the focal length along x in the numbers of a camera.
pub(crate) const FOCAL_X: usize = 6;
/// Index of the image centre along x in the numbers of a camera.
pub(crate) const CENTRE_X: usize = 8;
/// Index of the first coefficient of distortion in the numbers of a camera.
pub(crate) const FIRST_COEFFICIENT: usize = 10;

/// Object around the arm or on it, against which rows are measured. Its position may be declared or
/// unknown.
#[derive(Debug, Clone, PartialEq)]
pub struct Fixture {
    /// Name of the fixture, as used in columns.
    pub name: String,
    /// Kind of the fixture.
    pub kind: FixtureKind,
    /// Declared numbers in the order of [`FixtureKind::fields`], SI; `None` for a number that is
    /// not declared.
    pub known: Vec<Option<f64>>,
    /// Frame of the arm that carries the fixture: 0 is the base, i that of joint i; `None` if it is
    /// at rest in the measuring frame.
    pub carrier: Option<usize>,
    /// Points of a marker in its frame \[m\]; empty for others.
    pub points: Vec<Vector3<f64>>,
    /// 1 σ of a coordinate that a camera measures \[px\]; `None` for others.
    pub sigma: Option<f64>,
    /// Width and height of a camera's image \[px\]; `None` if they are not declared, and for others.
    pub image: Option<[f64; 2]>,
    /// Place in the file, for errors.
    pub location: Location,
}

/// Known distance between two points: `[[distance]]`.
#[derive(Debug, Clone, PartialEq)]
pub struct KnownDistance {
    /// Indices of the two points in [`Problem::fixtures`](super::Problem::fixtures).
    pub between: [usize; 2],
    /// Known distance between the points \[m\].
    pub length: f64,
    /// Standard deviation of the distance \[m\].
    pub sigma: f64,
    /// Place in the file, for errors.
    pub location: Location,
}

/// Returns the columns that name the fixtures or the frame of a row, each with the content of its
/// cell.
pub(crate) fn reference_cells(
    problem: &Problem,
    observation: Observation,
) -> impl Iterator<Item = (&'static Field, String)> + '_ {
    observation.references().map(|(field, index)| {
        let word = match field.content {
            Content::Frame => frame_word(index, &problem.joints, problem.tool.joint),
            Content::Index => index.to_string(),
            _ => problem.fixtures.get(index).map_or(String::new(), |known| known.name.clone()),
        };
        (field, word)
    })
}

/// Returns the names of the cameras among `fixtures`, each with the names of its numbers.
pub(crate) fn named_cameras(fixtures: &[Fixture]) -> Vec<NamedCamera> {
    let cameras = fixtures.iter().filter(|fixture| fixture.kind.word() == "camera");
    cameras.map(|camera| (camera.name.clone(), camera.kind.fields())).collect()
}

/// Returns the word of the frame that carries a camera or marker, "world" for the measuring frame.
pub(crate) fn carrier_word(problem: &Problem, fixture: &Fixture) -> String {
    let word = |carrier| frame_word(carrier, &problem.joints, problem.tool.joint);
    fixture.carrier.map_or_else(|| "world".to_owned(), word)
}

/// Reads all fixtures in the order point, anchor, surface, camera, marker, and the known distances.
pub(super) fn read(
    root: &mut Section<'_, '_>,
    carriers: Carriers,
) -> Result<(Vec<Fixture>, Vec<KnownDistance>), InputError> {
    let mut fixtures: Vec<Fixture> = Vec::new();
    for table in ["point", "anchor", "surface", "camera", "marker"] {
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
            let declared = match table {
                "point" => DeclaredFixture::new(FixtureKind::Point, read_place(&mut section)?),
                "anchor" => DeclaredFixture::new(FixtureKind::Anchor, read_place(&mut section)?),
                "surface" => read_surface(&mut section)?,
                "camera" => read_camera(&mut section, carriers)?,
                _ => read_marker(&mut section, carriers)?,
            };
            section.finish()?;
            let DeclaredFixture { kind, known, carrier, points, sigma, image } = declared;
            let location = section.location();
            fixtures.push(Fixture { name, kind, known, carrier, points, sigma, image, location });
        }
    }
    let distances =
        root.sections("distance")?.into_iter().map(|section| read_distance(section, &fixtures));
    let distances = distances.collect::<Result<_, _>>()?;
    Ok((fixtures, distances))
}

fn read_place(section: &mut Section<'_, '_>) -> Result<Vec<Option<f64>>, InputError> {
    let at = section.vector("at", Unit::Length)?;
    Ok(at.map_or(vec![None; 3], |at| at.iter().map(|x| Some(*x)).collect()))
}

fn read_surface(section: &mut Section<'_, '_>) -> Result<DeclaredFixture, InputError> {
    section.require("kind", "kind = \"plane\" or \"sphere\"")?;
    let kinds = [FixtureKind::Plane, FixtureKind::Sphere];
    let kind = section.word("kind", &["plane", "sphere"], &kinds)?.unwrap_or(FixtureKind::Plane);
    if kind == FixtureKind::Sphere {
        let mut numbers = read_place(section)?;
        numbers.push(
            section
                .positive("radius", Unit::Length, |value| InputErrorKind::NotPositive { value })?,
        );
        return Ok(DeclaredFixture::new(kind, numbers));
    }
    let at = section.vector("at", Unit::Length)?;
    let Some(item) = section.get("normal") else {
        return Ok(DeclaredFixture::new(kind, vec![None; 3]));
    };
    let normal = item.vector()?;
    let length = normal.norm();
    if length == 0.0 {
        return Err(item.error(InputErrorKind::NoDirection));
    }
    let [rx, ry] = lean(&(normal / length));
    let distance = at.map(|at| at.dot(&normal) / length);
    Ok(DeclaredFixture::new(kind, vec![Some(rx), Some(ry), distance]))
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

fn read_distance(
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
        let index = fixtures
            .iter()
            .position(|fixture| fixture.kind == FixtureKind::Point && fixture.name == name);
        between.push(index.ok_or_else(|| point.error(unknown("point", name, &names)))?);
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

/// Returns the error for a name that is none of the `names`; `what` is the noun for a fixture in
/// the message.
pub fn unknown(what: &'static str, name: &str, names: &[&str]) -> InputErrorKind {
    let known = names.iter().map(|&name| name.to_owned()).collect();
    InputErrorKind::UnknownFixture { what, name: name.to_owned(), known }
}
