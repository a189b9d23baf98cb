//! Export of identified origins as YAML.

use std::f64::consts::FRAC_PI_2;
use std::fmt::Write as _;

use nalgebra::Vector3;

use super::branch::Steps;
use crate::error::{InputError, Location, UrdfErrorKind};
use crate::mechanics::Arm;
use crate::problem::{JointKind, Problem};
use crate::spatial::Frame;

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
        let found = universal_robots_origins(&nominal, &steps);
        let wrong_form = |why: String| {
            Location::file(&problem.data.location.file).error(UrdfErrorKind::NotUr { why })
        };
        let frames = found.map_err(wrong_form)?;
        return Ok(UNIVERSAL_ROBOTS_LINKS
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
            "# Each frame seen from the one before [m, rad]; each joint turns about, or slides \
             along, its z.\n"
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

/// Names of the links in the calibration file of Universal Robots. Each row of the table is the
/// origin of a link in the frame of the previous one \[m\], \[rad\], in the description that the
/// manufacturer publishes.
///
/// | link | x y z | roll pitch yaw, nominal |
/// |---|---|---|
/// | shoulder | 0 0 d₁ | 0 0 0 |
/// | upper_arm | 0 0 0 | π/2 0 0 |
/// | forearm | a₂ 0 0 | 0 0 0 |
/// | wrist_1 | a₃ 0 d₄ | 0 0 0 |
/// | wrist_2 | 0 −d₅ 0 | π/2 0 0 |
/// | wrist_3 | 0 d₆ 0 | −π/2 0 0 |
const UNIVERSAL_ROBOTS_LINKS: [&str; 6] =
    ["shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"];
/// Nominal roll of each link \[rad\].
const ROLLS: [f64; 6] = [0.0, FRAC_PI_2, 0.0, 0.0, FRAC_PI_2, -FRAC_PI_2];
/// Largest deviation of the nominal arm from the table of its links \[rad\] or \[m\].
const FORM_TOLERANCE: f64 = 1e-6;

/// Returns the origins of the six links of an identified arm, in the gauges in which the nominal
/// arm has the origins of the table.
///
/// # Errors
/// Returns a description of the difference if the nominal arm cannot have these origins.
fn universal_robots_origins(
    nominal: &Steps,
    identified: &Steps,
) -> Result<Vec<Frame<f64>>, String> {
    if nominal.before.len() != UNIVERSAL_ROBOTS_LINKS.len() {
        return Err(format!("it has {} moving joints, not 6", nominal.before.len()));
    }
    // The base of a problem is that of the controller, or base_link, which is turned by 180°.
    let mut half = Frame::identity();
    half.rotate_z((0.0, -1.0));
    let gauges = gauges(nominal, &Frame::identity()).or_else(|_| gauges(nominal, &half))?;
    let pairs = gauges.iter().zip(gauges.iter().skip(1));
    Ok(identified
        .before
        .iter()
        .zip(pairs)
        .map(|(step, (before, after))| before.compose(step).compose(&after.inverse()))
        .collect())
}

/// Returns the gauge of each axis, after that of the base, in which the nominal arm has the origins
/// of the table. `base` is the gauge of the base.
fn gauges(nominal: &Steps, base: &Frame<f64>) -> Result<Vec<Frame<f64>>, String> {
    let mut gauges = vec![*base];
    let mut before = *base;
    for (k, (step, (roll, link))) in
        nominal.before.iter().zip(ROLLS.into_iter().zip(UNIVERSAL_ROBOTS_LINKS)).enumerate()
    {
        let frame = before.compose(step);
        let mut turned = Frame::identity();
        turned.rotate_x(roll.sin_cos());
        // The remainder is a rotation about the axis and a shift of the origin along it.
        let remainder = turned.inverse().compose(&frame);
        if remainder.axes[2].xy().norm() > FORM_TOLERANCE || remainder.axes[2].z < 0.0 {
            return Err(format!("the axis of {link} does not lie as that maker's arms have it"));
        }
        let next = nominal.before.get(k + 1);
        let along = match k {
            // The origin is at the point nearest to the next axis, so that the next origin has no
            // shift along this axis.
            0 | 3 | 4 => remainder.origin.z + next.map_or(0.0, nearest),
            5 => remainder.origin.z + nominal.end.origin.z,
            _ => 0.0,
        };
        let mut gauge = Frame::identity();
        gauge.rotate_z((remainder.axes[0].y, remainder.axes[0].x));
        gauge.translate_z(remainder.origin.z - along);
        before = gauge;
        gauges.push(gauge);
        let placed = frame.compose(&gauge.inverse()).origin;
        let off = match k {
            0 => placed.xy().norm(),
            1 => placed.norm(),
            2 => placed.yz().norm(),
            3 => placed.y.abs(),
            _ => placed.xz().norm(),
        };
        if off > FORM_TOLERANCE {
            return Err(format!(
                "{link} lies {:.3} mm off where that maker's arms have it",
                off * 1e3
            ));
        }
    }
    Ok(gauges)
}

/// Returns the z coordinate \[m\] of the point on the reference z axis that is nearest to the z
/// axis of `frame`; 0 if the axes are parallel.
fn nearest(frame: &Frame<f64>) -> f64 {
    let (z, p) = (&frame.axes[2], &frame.origin);
    let square = z.xy().norm_squared();
    if square > FORM_TOLERANCE { (p.z - z.z * p.dot(z)) / square } else { 0.0 }
}
