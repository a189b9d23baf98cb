//! Identified cameras as YAML for ROS, OpenCV and Kalibr.

use std::fmt::Write as _;

use nalgebra::DVector;

use super::error::ExportError;
use crate::error::InputErrorKind;
use crate::model::Model;
use crate::observation::{FixtureKind, FixtureValues};
use crate::problem::Problem;
use crate::problem::fixture::{Fixture, carrier_word};
use crate::spatial::Frame;
use crate::urdf::yaml_key;

/// Program for which a camera is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraFormat {
    /// Calibration file of ROS (`camera_info`): one camera.
    Ros,
    /// File storage of OpenCV: one camera and its pose.
    OpenCv,
    /// Camera chain of Kalibr: all cameras.
    Kalibr,
}

/// Returns the identified camera `name` as YAML; in the form of Kalibr, all cameras. `x` is the
/// full parameter vector of the model. The name may be left out if the problem declares one camera.
///
/// # Errors
/// Returns an error if the problem has no such camera, the camera does not state the size of its
/// image, or Kalibr's lens model lacks a coefficient.
pub fn camera_yaml(
    problem: &Problem,
    (model, x): (&Model, &DVector<f64>),
    format: CameraFormat,
    name: Option<&str>,
) -> Result<String, ExportError> {
    let values = model.fixtures(x.as_slice());
    let cameras: Vec<(&Fixture, &FixtureValues<f64>)> = problem
        .fixtures
        .iter()
        .zip(&values)
        .filter(|(fixture, _)| fixture.kind.word() == "camera")
        .collect();
    let names = cameras.iter().map(|(fixture, _)| fixture.name.clone());
    let is_wanted = |fixture: &Fixture| name.is_none_or(|name| fixture.name == name);
    let mut chosen = cameras.iter().filter(|(fixture, _)| is_wanted(fixture));
    let Some((fixture, camera)) = chosen.next() else {
        return Err(ExportError::NoCamera { known: names.collect() });
    };
    if format == CameraFormat::Kalibr {
        return kalibr(problem, &cameras);
    }
    if chosen.next().is_some() {
        return Err(ExportError::SeveralCameras { known: names.collect() });
    }
    let [width, height] = image(fixture)?;
    let Lens { matrix, coefficients, model } = Lens::of(camera);
    let place = format!(
        "# Pose of the camera (z forward, x right, y down) in {}: position {} m, rotation vector \
         {} rad.\n",
        carrier_label(problem, fixture),
        list(&camera.numbers[..3]),
        list(&camera.numbers[3..6])
    );
    let size = format!("image_width: {width}\nimage_height: {height}\n");
    let count = coefficients.len();
    if format == CameraFormat::Ros {
        let [fx, _, cx, _, fy, cy, ..] = matrix;
        let entry = |name: &str, (rows, columns): (usize, usize), data: &[f64]| {
            format!("{name}:\n  rows: {rows}\n  cols: {columns}\n  data: {}\n", list(data))
        };
        return Ok([
            place,
            size,
            format!("camera_name: {}\n", yaml_key(&fixture.name)),
            entry("camera_matrix", (3, 3), &matrix),
            format!("distortion_model: {model}\n"),
            entry("distortion_coefficients", (1, count), &coefficients),
            entry("rectification_matrix", (3, 3), &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]),
            entry(
                "projection_matrix",
                (3, 4),
                &[fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
            ),
        ]
        .concat());
    }
    let entry = |name: &str, (rows, columns): (usize, usize), data: &[f64]| {
        format!(
            "{name}: !!opencv-matrix\n   rows: {rows}\n   cols: {columns}\n   dt: d\n   data: {}\n",
            list(data)
        )
    };
    Ok([
        "%YAML:1.0\n---\n".to_owned(),
        place,
        format!("camera_name: \"{}\"\n{size}", fixture.name),
        format!("distortion_model: \"{model}\"\n"),
        entry("camera_matrix", (3, 3), &matrix),
        entry("distortion_coefficients", (1, count), &coefficients),
        format!("carrier: \"{}\"\n", carrier_label(problem, fixture)),
        entry("carrier_from_camera", (4, 4), &rows(&camera.frame())),
    ]
    .concat())
}

/// Returns the name of the frame in which the pose of a camera is stated: the link of the URDF for
/// the last frame and the base of an arm that was read from one. The frame of a joint between them
/// is that of the problem, which need not be that of a link.
fn carrier_label(problem: &Problem, fixture: &Fixture) -> String {
    match (&problem.urdf, fixture.carrier) {
        (Some(ends), Some(0)) => ends.base.clone(),
        (Some(ends), Some(frame)) if frame == problem.joints.len() => ends.tip.clone(),
        (Some(_), Some(_)) => format!("{} of problem.toml", carrier_word(problem, fixture)),
        _ => carrier_word(problem, fixture),
    }
}

/// Lens of a camera as ROS and OpenCV describe it.
struct Lens {
    /// Camera matrix, row by row \[px\].
    matrix: [f64; 9],
    /// Distortion coefficients, in the order of OpenCV.
    coefficients: Vec<f64>,
    /// Name of the distortion model in ROS.
    model: &'static str,
}

impl Lens {
    fn of(camera: &FixtureValues<f64>) -> Self {
        let [_, _, _, _, _, _, fx, fy, cx, cy, ..] = camera.numbers;
        let count = camera.kind.fields().len();
        let coefficients = camera.numbers[10..count].to_vec();
        let is_fisheye = camera.kind == FixtureKind::Fisheye;
        let model = if is_fisheye { "equidistant" } else { "plumb_bob" };
        Self { matrix: [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0], coefficients, model }
    }
}

/// Returns the camera chain of Kalibr. A camera's pose relative to the previous one is written if
/// both are mounted on the same frame.
fn kalibr(
    problem: &Problem,
    cameras: &[(&Fixture, &FixtureValues<f64>)],
) -> Result<String, ExportError> {
    let mut text = String::new();
    for (k, (fixture, camera)) in cameras.iter().enumerate() {
        let [width, height] = image(fixture)?;
        let Lens { matrix: [fx, _, cx, _, fy, cy, ..], coefficients, model } = Lens::of(camera);
        // Kalibr's radial-tangential model only has k1, k2, p1 and p2.
        if coefficients.get(4).is_some_and(|k3| *k3 != 0.0) {
            return Err(ExportError::ThirdRadial { camera: fixture.name.clone() });
        }
        let model = if model == "equidistant" { model } else { "radtan" };
        let _ =
            writeln!(text, "cam{k}:\n  # {} on {}", fixture.name, carrier_label(problem, fixture));
        let _ =
            writeln!(text, "  camera_model: pinhole\n  intrinsics: {}", list(&[fx, fy, cx, cy]));
        let _ = writeln!(text, "  distortion_model: {model}");
        let _ = writeln!(text, "  distortion_coeffs: {}", list(&coefficients[..4]));
        let _ = writeln!(text, "  resolution: [{width}, {height}]");
        let _ = writeln!(text, "  rostopic: /{}/image_raw", fixture.name);
        let previous = k.checked_sub(1).and_then(|before| cameras.get(before));
        if let Some((_, before)) = previous.filter(|(other, _)| other.carrier == fixture.carrier) {
            text.push_str("  T_cn_cnm1:\n");
            let relative = camera.frame().inverse().compose(&before.frame());
            for row in rows(&relative).chunks(4) {
                let _ = writeln!(text, "  - {}", list(row));
            }
        }
    }
    Ok(text)
}

/// Returns width and height of a camera's image \[px\].
fn image(fixture: &Fixture) -> Result<[f64; 2], ExportError> {
    fixture.image.ok_or_else(|| {
        let write = "image_px = [width, height]".to_owned();
        let mut location = fixture.location.clone();
        location.key = location.key.map(|key| format!("{key}.image_px"));
        location.error(InputErrorKind::MissingKey { write, near: None }).into()
    })
}

/// Returns the 4 × 4 matrix of a frame, row by row.
fn rows(frame: &Frame<f64>) -> Vec<f64> {
    let row = |i: usize| {
        let [x, y, z] = frame.axes.each_ref().map(|axis| axis[i]);
        [x, y, z, frame.origin[i]]
    };
    [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]].concat()
}

/// Returns numbers as a list in YAML.
fn list(values: &[f64]) -> String {
    let number = |value: &f64| format!("{:?}", value + 0.0);
    format!("[{}]", values.iter().map(number).collect::<Vec<_>>().join(", "))
}
