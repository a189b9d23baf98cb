//! Reader of `[[camera]]` and `[[marker]]`: cameras and the markers that they observe.

use nalgebra::Vector3;

use super::frame::frame;
use super::item::Item;
use super::joint::Joint;
use super::section::Section;

use crate::error::{InputError, InputErrorKind};
use crate::observation::FixtureKind;
use crate::quantity::Unit;

/// Maximum number of points of a marker.
const MAX_MARKER_POINTS: usize = 10_000;

/// Arm whose frames may carry a camera or a marker: its joints, and the index of the joint that
/// carries the tool.
#[derive(Clone, Copy)]
pub(super) struct Carriers<'a> {
    pub joints: &'a [Joint],
    pub tool: usize,
}

/// Declared properties of a fixture, with the fields of [`Fixture`](super::Fixture).
pub(super) struct DeclaredFixture {
    pub kind: FixtureKind,
    pub known: Vec<Option<f64>>,
    pub carrier: Option<usize>,
    pub points: Vec<Vector3<f64>>,
    pub sigma: Option<f64>,
    pub image: Option<[f64; 2]>,
}

impl DeclaredFixture {
    /// Creates the properties of a fixture that is at rest in the measuring frame.
    pub fn new(kind: FixtureKind, known: Vec<Option<f64>>) -> Self {
        Self { kind, known, carrier: None, points: Vec::new(), sigma: None, image: None }
    }
}

/// Reads the keys of a camera other than its name.
pub(super) fn read_camera(
    section: &mut Section<'_, '_>,
    carriers: Carriers,
) -> Result<DeclaredFixture, InputError> {
    let kinds = [FixtureKind::Camera, FixtureKind::Fisheye];
    let kind = section.word("model", &["pinhole", "fisheye"], &kinds)?;
    let kind = kind.unwrap_or(FixtureKind::Camera);
    section.word("mm_or_px", &["px"], &[()])?;
    let on = section.require("on", "on = \"joint6\", another frame of the arm, or \"world\"")?;
    let carrier = read_carrier(&on, carriers)?;
    let mut known = read_pose(section)?;
    let focal = read_positive_pair(&section.require("focal_px", "focal_px = [fx, fy]")?)?;
    let centre = section.require("centre_px", "centre_px = [cx, cy]")?.pair()?;
    known.extend(focal.into_iter().chain(centre).map(Some));
    let count = kind.fields().len() - known.len();
    let mut distortion = vec![0.0; count];
    if let Some(item) = section.get("distortion") {
        let numbers = item.list("a list of numbers")?;
        if numbers.len() != count {
            let names = kind.fields().get(known.len()..).unwrap_or_default().join(", ");
            let found = numbers.len();
            return Err(item.error(InputErrorKind::Coefficients { expected: count, names, found }));
        }
        for (coefficient, number) in distortion.iter_mut().zip(&numbers) {
            *coefficient = number.number()?;
        }
    }
    known.extend(distortion.into_iter().map(Some));
    let image = section.get("image_px").map(|item| read_image_size(&item)).transpose()?;
    let item = section.require("pixel_sigma", "pixel_sigma = 0.2, 1 σ of u and v in pixels")?;
    let sigma = item.number()?;
    if sigma <= 0.0 {
        return Err(item.error(InputErrorKind::NotPositive { value: sigma }));
    }
    Ok(DeclaredFixture { carrier, sigma: Some(sigma), image, ..DeclaredFixture::new(kind, known) })
}

/// Reads width and height of images, two whole numbers above zero.
fn read_image_size(item: &Item<'_, '_>) -> Result<[f64; 2], InputError> {
    let size = read_positive_pair(item)?;
    if size.iter().all(|pixels| pixels.fract() == 0.0) {
        Ok(size)
    } else {
        Err(item.wrong_type("whole numbers of pixels, [width, height]"))
    }
}

/// Reads two numbers above zero.
fn read_positive_pair(item: &Item<'_, '_>) -> Result<[f64; 2], InputError> {
    let pair = item.pair()?;
    match pair.iter().find(|number| **number <= 0.0) {
        Some(&value) => Err(item.error(InputErrorKind::NotPositive { value })),
        None => Ok(pair),
    }
}

/// Reads the keys of a marker other than its name.
pub(super) fn read_marker(
    section: &mut Section<'_, '_>,
    carriers: Carriers,
) -> Result<DeclaredFixture, InputError> {
    let carrier = section.get("on").map_or(Ok(None), |on| read_carrier(&on, carriers))?;
    let known = read_pose(section)?;
    let Some((item, suffix)) = section.quantity("points", Unit::Length)? else {
        return Err(section.missing("points_mm", "points_mm = [[x, y, z], …]"));
    };
    let listed = item.list("a list of points, each a list of 3 numbers")?;
    item.check_count("points", listed.len(), MAX_MARKER_POINTS)?;
    if listed.is_empty() {
        return Err(item.error(InputErrorKind::Empty));
    }
    let point = |point: &Item<'_, '_>| Ok(point.vector()?.map(suffix.to_si));
    let points = listed.iter().map(point).collect::<Result<_, InputError>>()?;
    Ok(DeclaredFixture { carrier, points, ..DeclaredFixture::new(FixtureKind::Marker, known) })
}

/// Reads the frame that carries an object: 0 is the base, i that of joint i, `None` the measuring
/// frame.
fn read_carrier(on: &Item<'_, '_>, carriers: Carriers) -> Result<Option<usize>, InputError> {
    let word = on.text()?;
    if word == "world" {
        return Ok(None);
    }
    frame(word, carriers.joints, carriers.tool).map(Some).map_err(|kind| on.error(kind))
}

/// Reads the numbers of a pose: position \[m\], then rotation vector \[rad\]. Numbers without the
/// keys `at` or `rotation` are `None`.
fn read_pose(section: &mut Section<'_, '_>) -> Result<Vec<Option<f64>>, InputError> {
    let at = section.vector("at", Unit::Length)?;
    let rotation = section.vector("rotation", Unit::Angle)?;
    let numbers = [at, rotation].map(|vector| {
        vector.map_or([None; 3], |vector| [Some(vector.x), Some(vector.y), Some(vector.z)])
    });
    Ok(numbers.concat())
}
