//! Rigid geometry as tables: modified and standard Denavit–Hartenberg parameters.

use std::fmt::Write as _;

use nalgebra::Vector3;

use super::error::ExportError;
use crate::mechanics::Arm;
use crate::problem::{JointKind, Problem};
use crate::spatial::Frame;
use crate::urdf::{YamlFormat, joint_origins, yaml_key};

/// Largest sine of the angle between two axes that count as parallel.
const MAX_PARALLEL_SINE: f64 = 1e-12;
/// Smallest offset along an axis at which a comment points out nearly parallel axes \[m\].
const MIN_COMMENTED_OFFSET: f64 = 10.0;

/// Returns the geometry as YAML in the form of the problem:
/// `T_i` = Rx(α) Tx(a) Rz(θ+q) Tz(d) Ry(β).
pub fn modified_dh(problem: &Problem, arm: &Arm<f64>) -> String {
    let mut text = "# Modified Denavit-Hartenberg parameters with Hayati's beta; q adds to theta, of a prismatic joint to d:\n\
                    # T_i = Rx(alpha) Tx(a) Rz(theta + q) Tz(d) Ry(beta)\nmdh:\n"
        .to_owned();
    for (declared, joint) in problem.joints.iter().zip(&arm.joints) {
        let _ = writeln!(text, "  {}:", yaml_key(&declared.name));
        if let Some(placed) = &joint.placement {
            let rpy = placed.rpy.each_ref().map(|angle| angle.value);
            let _ = writeln!(text, "    xyz_m: {}", list(placed.xyz.as_slice()));
            let _ = writeln!(text, "    rpy_rad: {}", list(&rpy));
        }
        for (name, value) in [
            ("alpha_rad", joint.alpha.value),
            ("a_m", joint.a),
            ("theta_rad", joint.theta),
            ("d_m", joint.d),
            ("beta_rad", joint.beta.value),
        ] {
            let _ = writeln!(text, "    {name}: {}", float(value));
        }
    }
    text
}

/// Returns the geometry as YAML in standard form, between a constant transform of the base and one
/// of the tool: base · Π Rz(θ+q) Tz(d) Tx(a) Rx(α) · tool.
///
/// # Errors
/// Returns an error if the joints branch.
pub fn standard_dh(problem: &Problem, arm: &Arm<f64>) -> Result<String, ExportError> {
    let frames: Vec<(String, Frame<f64>)> = joint_origins(problem, arm, YamlFormat::Ros)?
        .into_iter()
        .map(|origin| (origin.name, Frame::from_xyz_rpy(&origin.xyz, &origin.rpy)))
        .collect();
    let mut text =
        "# Standard Denavit-Hartenberg parameters; q adds to theta, of a prismatic joint to d:\n\
                    # base Rz(theta_1 + q_1) Tz(d_1) Tx(a_1) Rx(alpha_1) ... tool\n"
            .to_owned();
    let Some(((_, base), links)) = frames.split_first() else { return Ok(text) };
    let (mut rows, mut before) = (String::new(), Frame::identity());
    let moving = problem.joints.iter().filter(|joint| joint.kind != JointKind::Fixed);
    let last = links.len().saturating_sub(1);
    let mut largest_offset = 0.0_f64;
    for (k, ((_, link), joint)) in links.iter().zip(moving).enumerate() {
        let link = before.compose(link);
        // All transforms after the last axis belong to the tool.
        let ([theta, d, a, alpha], after) =
            if k < last { standard(&link) } else { ([0.0; 4], link) };
        largest_offset = largest_offset.max(d.abs());
        let _ = writeln!(rows, "  {}:", yaml_key(&joint.name));
        for (name, value) in [("theta_rad", theta), ("d_m", d), ("a_m", a), ("alpha_rad", alpha)] {
            let _ = writeln!(rows, "    {name}: {}", float(value));
        }
        before = after;
    }
    if largest_offset > MIN_COMMENTED_OFFSET {
        text.push_str("# Two axes are nearly parallel: their common normal lies far away, and rounding counts. Prefer mdh.\n");
    }
    for (name, frame) in [("base", base), ("tool", &before)] {
        let _ = writeln!(text, "{name}:\n  xyz_m: {}", list(frame.origin.as_slice()));
        let _ = writeln!(text, "  rpy_rad: {}", list(frame.roll_pitch_yaw().as_slice()));
    }
    let _ = write!(text, "dh:\n{rows}");
    Ok(text)
}

/// Returns θ, d, a and α of a transform C between two axes, and the remaining transform, a rotation
/// about and a shift along the second axis: C = Rz(θ) Tz(d) Tx(a) Rx(α) · remaining.
fn standard(link: &Frame<f64>) -> ([f64; 4], Frame<f64>) {
    let (z, p) = (link.axes[2], link.origin);
    let mut sine = z.xy().norm();
    let (mut theta, mut shift) = (p.y.atan2(p.x), 0.0);
    if sine > MAX_PARALLEL_SINE {
        theta = z.x.atan2(-z.y);
        // The common normal has two directions; the one nearer to x is used.
        if theta.abs() > std::f64::consts::FRAC_PI_2 {
            theta -= std::f64::consts::PI.copysign(theta);
            sine = -sine;
        }
        shift = -(Vector3::new(-theta.sin(), theta.cos(), 0.0).dot(&p)) / sine;
    } else if p.xy().norm() < MAX_PARALLEL_SINE {
        theta = 0.0;
    }
    let normal = Vector3::new(theta.cos(), theta.sin(), 0.0);
    let (a, d, alpha) = (normal.dot(&p), p.z - shift * z.z, sine.atan2(z.z));
    let mut near = Frame::identity();
    near.rotate_z(theta.sin_cos());
    near.translate_z(d);
    near.translate_x(a);
    near.rotate_x(alpha.sin_cos());
    ([theta, d, a, alpha], near.inverse().compose(link))
}

/// Returns a number that YAML reads as a float.
fn float(value: f64) -> String {
    format!("{:?}", (value * 1e15).round() / 1e15 + 0.0)
}

fn list(values: &[f64]) -> String {
    format!("[{}]", values.iter().map(|&value| float(value)).collect::<Vec<_>>().join(", "))
}
