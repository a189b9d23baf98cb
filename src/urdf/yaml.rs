//! Export of identified origins as YAML.

use std::fmt::Write as _;

use super::export::Steps;
use super::universal_robots;
use crate::error::{InputError, Location, UrdfErrorKind};
use crate::mechanics::Arm;
use crate::problem::{JointKind, Problem};
use crate::spatial::Frame;
use nalgebra::Vector3;

/// Program for which the file is written, which determines its form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum YamlFormat {
    /// Calibration file of a Universal Robots driver: six links by name.
    UniversalRobots,
    /// All joints by name, for ROS.
    Ros,
}

/// Pose of a joint's frame at zero command, relative to the previous frame. The joint's axis is the
/// z axis of its frame.
#[derive(Debug, Clone, PartialEq)]
pub struct JointOrigin {
    /// Name of the joint, or of the link after it.
    pub name: String,
    /// Origin in the previous frame \[m\].
    pub xyz: Vector3<f64>,
    /// Roll, pitch and yaw \[rad\].
    pub rpy: Vector3<f64>,
}

/// Returns the origins of the joints of `arm`, which is the identified arm of `problem`.
///
/// For ROS the frames are those of the problem, and a last origin leads to the tip. For Universal
/// Robots they are those of the manufacturer's description, from base_link_inertia to wrist_3_link.
/// Joint angles of zero are those of the problem.
///
/// # Errors
/// Returns an error if the form is Universal Robots' and the arm does not have it.
pub fn joint_origins(
    problem: &Problem,
    arm: &Arm<f64>,
    form: YamlFormat,
) -> Result<Vec<JointOrigin>, InputError> {
    problem.require_chain("export to YAML")?;
    let steps = Steps::new(arm);
    let origin = |(name, frame): (String, Frame<f64>)| JointOrigin {
        name,
        xyz: frame.origin,
        rpy: frame.roll_pitch_yaw(),
    };
    if form == YamlFormat::UniversalRobots {
        let nominal = Steps::new(&Arm::nominal(problem));
        let found = universal_robots::origins(&nominal, &steps);
        let wrong_form = |why: String| {
            Location::file(&problem.data.location.file).error(UrdfErrorKind::NotUr { why })
        };
        let frames = found.map_err(wrong_form)?;
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
    let mut origins: Vec<JointOrigin> = moving.zip(steps.before).map(origin).collect();
    let tip = problem.urdf.as_ref().map_or("tip", |ends| ends.tip.as_str()).to_owned();
    origins.push(origin((tip, steps.end)));
    Ok(origins)
}

/// Returns the origins as the text of a YAML file.
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

/// Returns a number in a form that YAML reads as a float, rounded to 10⁻¹³.
fn float(value: f64) -> String {
    let rounded = (value * 1e13).round() / 1e13 + 0.0;
    let text = rounded.to_string();
    if text.contains('.') { text } else { format!("{text}.0") }
}

/// Returns a YAML key, quoted if needed.
pub(crate) fn key(name: &str) -> String {
    let plain = name.starts_with(|c: char| c.is_ascii_alphabetic())
        && name.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c));
    if plain {
        name.to_owned()
    } else {
        format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\""))
    }
}
