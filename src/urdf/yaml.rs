//! Identified origins as YAML.

use std::fmt::Write as _;

use super::export::Steps;
use super::universal_robots;
use crate::error::{InputError, Location, UrdfErrorKind};
use crate::mechanics::Arm;
use crate::problem::{JointKind, Problem};
use crate::spatial::Frame;
use nalgebra::Vector3;

/// For whom the file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum YamlFormat {
    /// The calibration of a Universal Robots driver: six links by name.
    UniversalRobots,
    /// Every joint by its name.
    Ros,
}

/// The origin of a joint whose axis is the z of its frame, seen from the frame before it.
#[derive(Debug, Clone, PartialEq)]
pub struct JointOrigin {
    /// Name of the joint, or of the link behind it.
    pub name: String,
    /// \[m\]
    pub xyz: Vector3<f64>,
    /// Roll, pitch and yaw \[rad\].
    pub rpy: Vector3<f64>,
}

/// Origins of the joints of `arm`, which is `problem` as identified.
///
/// For ROS the frames are those of the problem, and a last origin leads to the tip. For Universal
/// Robots they are those of that maker's description, from base_link_inertia to wrist_3_link; zero
/// positions are those of the problem.
///
/// # Errors
/// For Universal Robots: the arm is not of that form.
pub fn joint_origins(
    problem: &Problem,
    arm: &Arm<f64>,
    form: YamlFormat,
) -> Result<Vec<JointOrigin>, InputError> {
    problem.require_chain("export to YAML")?;
    let steps = Steps::of(arm);
    let origin = |(name, frame): (String, Frame<f64>)| JointOrigin {
        name,
        xyz: frame.origin,
        rpy: frame.roll_pitch_yaw(),
    };
    if form == YamlFormat::UniversalRobots {
        let nominal = Steps::of(&Arm::nominal(problem));
        let found = universal_robots::origins(&nominal, &steps);
        let mistake = |why: String| {
            Location::file(&problem.data.location.file).error(UrdfErrorKind::NotUr { why }.into())
        };
        let frames = found.map_err(mistake)?;
        return Ok(universal_robots::LINKS
            .map(str::to_owned)
            .into_iter()
            .zip(frames)
            .map(origin)
            .collect());
    }
    let moving = problem
        .joints
        .iter()
        .filter(|joint| joint.kind != JointKind::Fixed)
        .map(|joint| joint.name.clone());
    let mut all: Vec<JointOrigin> = moving.zip(steps.before).map(origin).collect();
    let tip = problem.urdf.as_ref().map_or("tip", |ends| ends.tip.as_str()).to_owned();
    all.push(origin((tip, steps.end)));
    Ok(all)
}

/// The origins as a file.
pub fn yaml(origins: &[JointOrigin], form: YamlFormat) -> String {
    let mut text = match form {
        YamlFormat::UniversalRobots => {
            "# hash: put in that of the controller (calibration/conf of the robot, or the driver's own file):\n\
                                  # with another one the driver reports a mismatch.\n"
                .to_owned()
        }
        YamlFormat::Ros => {
            "# Each frame seen from the one before [m, rad]; each joint turns about, or slides along, its z.\n"
                .to_owned()
        }
    };
    text.push_str("kinematics:\n");
    for JointOrigin { name, xyz, rpy } in origins {
        let _ = writeln!(text, "  {}:", key(name));
        let fields =
            ["x", "y", "z", "roll", "pitch", "yaw"].into_iter().zip(xyz.iter().chain(rpy.iter()));
        for (field, value) in fields {
            let _ = writeln!(text, "    {field}: {}", float(*value));
        }
    }
    if form == YamlFormat::UniversalRobots {
        text.push_str("  hash: \"\"\n");
    }
    text
}

/// A number that YAML takes for a float.
fn float(value: f64) -> String {
    let rounded = (value * 1e13).round() / 1e13 + 0.0;
    let text = rounded.to_string();
    if text.contains('.') { text } else { format!("{text}.0") }
}

/// A key as it is, or in quotes.
fn key(name: &str) -> String {
    let plain = name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c));
    if plain {
        name.to_owned()
    } else {
        format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\""))
    }
}
