//! The parameters of an arm by name, to be given true values.

use crate::problem::Problem;
use crate::units::{ANGLE, Kind, LENGTH, RELATIVE};

/// What kind of quantity a parameter is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ParameterKind {
    /// [rad]; its deviation adds.
    Angle,
    /// [m]; its deviation adds.
    Length,
    /// A stiffness or rigidity, SI; its deviation multiplies.
    Relative,
}

/// A parameter with its nominal and its true value, SI.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueParameter {
    /// Name as in the problem file.
    pub name: String,
    /// Kind of quantity.
    pub kind: ParameterKind,
    /// Declared value.
    pub nominal: f64,
    /// True value.
    pub value: f64,
}

impl ParameterKind {
    pub(super) const ALL: [Self; 3] = [Self::Angle, Self::Length, Self::Relative];

    /// Units that a deviation is given in.
    pub(super) fn units(self) -> &'static Kind {
        match self {
            Self::Angle => &ANGLE,
            Self::Length => &LENGTH,
            Self::Relative => &RELATIVE,
        }
    }

    /// The true value from the nominal one and its deviation.
    pub(super) fn deviate(self, nominal: f64, deviation: f64) -> f64 {
        match self {
            Self::Angle | Self::Length => nominal + deviation,
            Self::Relative => nominal * deviation,
        }
    }
}

/// Calls `see` on every parameter, in the order of the file format: name, kind, and the value that may be changed.
pub(super) fn visit(problem: &mut Problem, mut see: impl FnMut(String, ParameterKind, &mut f64)) {
    use ParameterKind::{Angle, Length, Relative};
    for (index, joint) in problem.joints.iter_mut().enumerate() {
        let fields = [
            ("alpha", Angle, &mut joint.alpha),
            ("a", Length, &mut joint.a),
            ("theta", Angle, &mut joint.theta),
            ("d", Length, &mut joint.d),
            ("beta", Angle, &mut joint.beta),
        ];
        let stiffness = joint.stiffness.iter_mut().map(|stiffness| ("stiffness", Relative, stiffness));
        for (field, kind, value) in fields.into_iter().chain(stiffness) {
            see(format!("joint{}.{field}", index + 1), kind, value);
        }
    }
    for beam in problem.joints.iter_mut().filter_map(|joint| joint.beam.as_mut()) {
        let name = &beam.name;
        let mut rigidity = |field: &str, value: &mut Option<f64>| {
            if let Some(value) = value {
                see(format!("{name}.{field}"), Relative, value);
            }
        };
        rigidity("EA", &mut beam.ea);
        // One parameter where both planes are declared alike, as in the problem file.
        if beam.ei_y == beam.ei_z {
            rigidity("EI", &mut beam.ei_y);
            beam.ei_z = beam.ei_y;
        } else {
            rigidity("EIy", &mut beam.ei_y);
            rigidity("EIz", &mut beam.ei_z);
        }
        rigidity("GJ", &mut beam.gj);
    }
    for (axis, value) in ["x", "y", "z"].into_iter().zip(problem.tool.target.iter_mut()) {
        see(format!("tool.{axis}"), Length, value);
    }
    for (axis, value) in ["x", "y", "z"].into_iter().zip(problem.base.translation.iter_mut()) {
        see(format!("base.{axis}"), Length, value);
    }
    for (axis, value) in ["rx", "ry", "rz"].into_iter().zip(problem.base.rotation.iter_mut()) {
        see(format!("base.{axis}"), Angle, value);
    }
}

/// Every parameter of a problem at its nominal value.
pub(super) fn nominal(problem: &Problem) -> Vec<TrueParameter> {
    let mut all = Vec::new();
    visit(&mut problem.clone(), |name, kind, value| {
        all.push(TrueParameter { name, kind, nominal: *value, value: *value });
    });
    all
}
