//! Effects that the rig injects: what the catalogue names, one thing that it does not, and how strong they are.

use crate::problem::{Effect, Joint, JointKind};
use crate::quantity::suffix::{
    ANGLE, ANGLE_PER_DEGREE, COMPLIANCE, CUBIC_COMPLIANCE, CURVATURE_PER_DEGREE, FLEXIBILITY, Kind, LENGTH,
    LENGTH_PER_DEGREE, MASS, PER_LENGTH, RELATIVE, SPEED, STRAIN_PER_DEGREE,
};

/// What makes the arm differ from its declared model.
#[derive(Debug, Clone, PartialEq)]
pub enum Cause {
    /// An effect of the catalogue.
    Catalogued(Effect),
    /// Something that no catalogue holds: a smooth error of one joint's coordinate.
    Outside {
        /// Number of the joint, from 1.
        joint: usize,
        /// Its course over q.
        shape: Shape,
    },
}

/// Course of an error over q, with u = (q − centre)/width.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// height · exp(−u²/2)
    Bump,
    /// height · tanh u
    Step,
}

/// A cause and its strength.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueEffect {
    cause: Cause,
    values: Vec<f64>,
}

/// A strength of the wrong shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the effect takes {expected} values, not {found}")]
pub struct ValueCount {
    expected: usize,
    found: usize,
}

impl TrueEffect {
    /// A cause with its values in SI units, in the order of [`TrueEffect::keys`].
    ///
    /// # Errors
    /// Too many values or too few.
    pub fn new(cause: Cause, values: &[f64], joints: &[Joint]) -> Result<Self, ValueCount> {
        let expected = keys(&cause, joints).len();
        if values.len() == expected {
            Ok(Self { cause, values: values.to_vec() })
        } else {
            Err(ValueCount { expected, found: values.len() })
        }
    }

    /// The cause.
    pub fn cause(&self) -> &Cause {
        &self.cause
    }

    /// Its values, SI.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Names of the values in the order of the law, with the suffix of their SI unit.
    pub fn keys(cause: &Cause, joints: &[Joint]) -> Vec<String> {
        keys(cause, joints).into_iter().map(|(name, kind)| format!("{name}_{}", kind.si_suffix())).collect()
    }

    /// The effect of the catalogue with its values, where it is one.
    pub(super) fn parts(&self) -> Option<(&Effect, &[f64])> {
        match &self.cause {
            Cause::Catalogued(effect) => Some((effect, &self.values)),
            Cause::Outside { .. } => None,
        }
    }
}

/// What the values of a cause are called and measured in, in the order of the law in FORMAT.
pub(super) fn keys(cause: &Cause, joints: &[Joint]) -> Vec<(String, &'static Kind)> {
    let slides = |joint: &usize| joints.get(joint - 1).is_some_and(|joint| joint.kind == JointKind::Prismatic);
    let coordinate = |joint| if slides(joint) { &LENGTH } else { &ANGLE };
    let about_xy = |kind| named(&[("about_x", kind), ("about_y", kind)]);
    let xyz = |kind| named(&[("x", kind), ("y", kind), ("z", kind)]);
    let effect = match cause {
        Cause::Outside { joint, .. } => {
            let kind = coordinate(joint);
            return named(&[("height", kind), ("centre", kind), ("width", kind)]);
        }
        Cause::Catalogued(effect) => effect,
    };
    match effect {
        Effect::JointHarmonic { joint, orders } => orders
            .iter()
            .flat_map(|order| ["sin", "cos"].map(|wave| (format!("{wave}{order}"), coordinate(joint))))
            .collect(),
        Effect::JointCompliance { .. } => named(&[("compliance", &COMPLIANCE)]),
        Effect::GearRatio { .. } | Effect::HoistForce | Effect::TrackerScale => named(&[("error", &RELATIVE)]),
        Effect::Backlash { joint } => named(&[("width", coordinate(joint))]),
        Effect::JointNonlinearStiffness { .. } => named(&[("cubic", &CUBIC_COMPLIANCE)]),
        Effect::JointLateralCompliance { .. } | Effect::BaseCompliance => about_xy(&COMPLIANCE),
        Effect::JointThermalDrift { joint } => {
            named(&[("rate", if slides(joint) { &LENGTH_PER_DEGREE } else { &ANGLE_PER_DEGREE })])
        }
        Effect::JointCoupling { .. } => named(&[("factor", &RELATIVE)]),
        Effect::LinkBending { .. } => named(&[("flexibility", &FLEXIBILITY)]),
        Effect::LinkThermalBending { .. } => {
            named(&[("about_y", &CURVATURE_PER_DEGREE), ("about_z", &CURVATURE_PER_DEGREE)])
        }
        Effect::LinkThermalExpansion { .. } => named(&[("strain", &STRAIN_PER_DEGREE)]),
        Effect::UnmodelledMass { .. } => named(&[("mass", &MASS), ("at", &LENGTH)]),
        Effect::PayloadMass => named(&[("mass", &MASS)]),
        Effect::HoistDirection => named(&[("lean_x", &RELATIVE), ("lean_y", &RELATIVE), ("trolley", &PER_LENGTH)]),
        Effect::GravityDirection => about_xy(&ANGLE),
        Effect::DeflectedEquilibrium => named(&[("lambda", &RELATIVE)]),
        Effect::TrackerDrift => xyz(&SPEED),
        Effect::StationShift { .. } => xyz(&LENGTH),
    }
}

fn named(keys: &[(&str, &'static Kind)]) -> Vec<(String, &'static Kind)> {
    keys.iter().map(|(name, kind)| ((*name).to_owned(), *kind)).collect()
}
