//! Parameters of an arm by name, for setting their true values.

use crate::problem::{Fixture, Placement, Problem, Target};
use crate::quantity::Unit;

/// Parameter with its nominal and true value, SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueParameter {
    /// Name as in the problem file.
    pub name: String,
    /// Unit of the quantity.
    pub unit: Unit,
    /// Value that the problem declares, SI.
    pub nominal: f64,
    /// Value of the true arm, SI.
    pub value: f64,
}

/// Returns the true value for a given deviation from `nominal`: a factor if the unit is relative
/// (of stiffnesses and rigidities), else a difference.
pub(super) fn true_value(unit: Unit, nominal: f64, deviation: f64) -> f64 {
    if unit.is_relative() { nominal * deviation } else { nominal + deviation }
}

/// Returns a random true value from 1 σ and a standard normal number; for a relative unit σ is that
/// of ln(value / nominal).
pub(super) fn random_value(unit: Unit, nominal: f64, sigma: f64, normal: f64) -> f64 {
    if unit.is_relative() { nominal * (sigma * normal).exp() } else { nominal + sigma * normal }
}

/// Calls `set` for every parameter of an arm, in a fixed order, with name, unit and value; `set`
/// may change the value.
pub(super) fn visit(problem: &mut Problem, mut set: impl FnMut(String, Unit, &mut f64)) {
    use Unit::{Angle, AxialRigidity, FlexuralRigidity, Length, TorsionalStiffness};
    for (index, joint) in problem.joints.iter_mut().enumerate() {
        let fields = if let Some(Placement { xyz, rpy }) = &mut joint.placement {
            let lengths = ["x", "y", "z"].into_iter().zip(xyz.iter_mut());
            let angles = ["roll", "pitch", "yaw"].into_iter().zip(rpy.iter_mut());
            let lengths = lengths.map(|(field, value)| (field, Length, value));
            lengths.chain(angles.map(|(field, value)| (field, Angle, value))).collect()
        } else {
            vec![
                ("alpha", Angle, &mut joint.alpha),
                ("a", Length, &mut joint.a),
                ("theta", Angle, &mut joint.theta),
                ("d", Length, &mut joint.d),
                ("beta", Angle, &mut joint.beta),
            ]
        };
        let stiffness = joint
            .stiffness
            .iter_mut()
            .map(|stiffness| ("stiffness", TorsionalStiffness, stiffness));
        for (field, unit, value) in fields.into_iter().chain(stiffness) {
            set(format!("joint{}.{field}", index + 1), unit, value);
        }
    }
    for beam in problem.joints.iter_mut().filter_map(|joint| joint.beam.as_mut()) {
        let name = &beam.name;
        let mut rigidity = |field: &str, unit, value: &mut Option<f64>| {
            if let Some(value) = value {
                set(format!("{name}.{field}"), unit, value);
            }
        };
        rigidity("EA", AxialRigidity, &mut beam.ea);
        // Equal rigidities of both planes are one parameter, as in the problem file.
        if beam.ei_y == beam.ei_z {
            rigidity("EI", FlexuralRigidity, &mut beam.ei_y);
            beam.ei_z = beam.ei_y;
        } else {
            rigidity("EIy", FlexuralRigidity, &mut beam.ei_y);
            rigidity("EIz", FlexuralRigidity, &mut beam.ei_z);
        }
        rigidity("GJ", FlexuralRigidity, &mut beam.gj);
    }
    let mut targets = Vec::new();
    for Target { name, at, rotation, .. } in &mut problem.targets {
        targets.push((format!("tool[{name}]"), at, rotation));
    }
    if targets.is_empty() {
        targets.push(("tool".to_owned(), &mut problem.tool.target, &mut problem.tool.rotation));
    }
    for (name, at, _) in &mut targets {
        for (axis, value) in ["x", "y", "z"].into_iter().zip(at.iter_mut()) {
            set(format!("{name}.{axis}"), Length, value);
        }
    }
    for (axis, value) in ["x", "y", "z"].into_iter().zip(problem.base.translation.iter_mut()) {
        set(format!("base.{axis}"), Length, value);
    }
    for (axis, value) in ["rx", "ry", "rz"].into_iter().zip(problem.base.rotation.iter_mut()) {
        set(format!("base.{axis}"), Angle, value);
    }
    // Rotations come last, so that the other parameters are drawn as without them.
    if problem.data.orientation_sigma.is_some() {
        for (name, _, rotation) in targets {
            for (axis, value) in ["rx", "ry", "rz"].into_iter().zip(rotation.iter_mut()) {
                set(format!("{name}.{axis}"), Angle, value);
            }
        }
    }
    visit_fixtures(&mut problem.fixtures, set);
    if problem.tool.payload_follows && problem.targets.is_empty() {
        problem.tool.payload_at = problem.tool.target;
    }
}

/// Calls `set` for every number of the fixtures; one without a declared value starts at 0.
fn visit_fixtures(fixtures: &mut [Fixture], mut set: impl FnMut(String, Unit, &mut f64)) {
    for Fixture { name, kind, known, .. } in fixtures {
        for (axis, (field, number)) in kind.fields().iter().zip(known).enumerate() {
            let mut value = number.unwrap_or(0.0);
            set(format!("{}[{name}].{field}", kind.word()), kind.unit(axis), &mut value);
            *number = Some(value);
        }
    }
}

/// Returns every parameter of a problem at its nominal value.
pub(super) fn nominal(problem: &Problem) -> Vec<TrueParameter> {
    let mut parameters = Vec::new();
    visit(&mut problem.clone(), |name, unit, value| {
        parameters.push(TrueParameter { name, unit, nominal: *value, value: *value });
    });
    parameters
}
