//! Rigid geometry as modified Denavit–Hartenberg parameters, and format of numbers in YAML files.

use std::fmt::Write as _;

use crate::mechanics::Arm;
use crate::problem::Problem;
use crate::urdf::yaml_key;

/// Returns the geometry of `arm` as YAML, with the parameters that a problem file has: `T_i` =
/// Rx(α) Tx(a) Rz(θ+q) Tz(d) Ry(β).
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

/// Returns a number in a form that YAML reads as a float, rounded to 10⁻¹⁵.
pub(super) fn float(value: f64) -> String {
    format!("{:?}", (value * 1e15).round() / 1e15 + 0.0)
}

/// Returns a YAML list of numbers.
pub(super) fn list(values: &[f64]) -> String {
    format!("[{}]", values.iter().map(|&value| float(value)).collect::<Vec<_>>().join(", "))
}
