//! Effects that the rig applies, with their true values: those of the catalogue, and smooth joint
//! errors that it does not contain.

use crate::problem::{Effect, Joint, JointKind, Mount, law_unit};
use crate::quantity::Unit;

/// Cause of a deviation of the arm from its declared model.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Cause {
    /// Effect of the catalogue.
    Catalogued(Effect),
    /// Smooth error of one joint coordinate that no catalogue effect describes.
    Outside {
        /// Number of the joint, from 1.
        joint: usize,
        /// Shape of the error over q.
        shape: Shape,
    },
}

/// Shape of a joint error as a function of the command q, with u = (q − centre)/width.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Shape {
    /// Bell curve, height · exp(−u²/2).
    Bump,
    /// Smooth step, height · tanh u.
    Step,
}

/// Cause with its true values.
#[derive(Debug, Clone, PartialEq)]
pub struct TrueEffect {
    cause: Cause,
    values: Vec<f64>,
}

/// Error of an effect with the wrong number of values.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the effect takes {expected} values, not {found}")]
pub struct ValueCount {
    expected: usize,
    found: usize,
}

impl TrueEffect {
    /// Creates an effect with values in SI units, in the order of [`TrueEffect::keys`].
    ///
    /// # Errors
    /// Returns an error if the number of values is wrong.
    pub fn new(cause: Cause, values: &[f64], joints: &[Joint]) -> Result<Self, ValueCount> {
        let expected = keys(&cause, joints).len();
        if values.len() == expected {
            Ok(Self { cause, values: values.to_vec() })
        } else {
            Err(ValueCount { expected, found: values.len() })
        }
    }

    /// Returns the cause of the effect.
    pub fn cause(&self) -> &Cause {
        &self.cause
    }

    /// Returns the values, SI units.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// Returns the names of the values of a cause, with the suffix of their SI unit, in the order
    /// in which docs/truth.md lists them.
    pub fn keys(cause: &Cause, joints: &[Joint]) -> Vec<String> {
        keys(cause, joints)
            .into_iter()
            .map(|(name, unit)| format!("{name}_{}", unit.si_suffix()))
            .collect()
    }

    /// Returns the catalogue effect with its values, or `None` if the cause is outside the
    /// catalogue.
    pub(super) fn catalogued(&self) -> Option<(&Effect, &[f64])> {
        match &self.cause {
            Cause::Catalogued(effect) => Some((effect, &self.values)),
            Cause::Outside { .. } => None,
        }
    }
}

/// Returns names and units of the values of a cause, in the order in which docs/truth.md lists
/// them.
pub(super) fn keys(cause: &Cause, joints: &[Joint]) -> Vec<(String, Unit)> {
    let slides = |joint: &usize| {
        joints.get(joint - 1).is_some_and(|joint| joint.kind == JointKind::Prismatic)
    };
    let coordinate = |joint| if slides(joint) { Unit::Length } else { Unit::Angle };
    let about_xy = |unit| named(&[("about_x", unit), ("about_y", unit)]);
    let xyz = |unit| named(&[("x", unit), ("y", unit), ("z", unit)]);
    let effect = match cause {
        Cause::Outside { joint, .. } => {
            let unit = coordinate(joint);
            return named(&[("height", unit), ("centre", unit), ("width", unit)]);
        }
        Cause::Catalogued(effect) => effect,
    };
    match effect {
        Effect::JointHarmonic { joint, orders } => orders
            .iter()
            .flat_map(|order| {
                ["sin", "cos"].map(|wave| (format!("{wave}{order}"), coordinate(joint)))
            })
            .collect(),
        Effect::JointWave { joint, .. } => {
            named(&[("sin", coordinate(joint)), ("cos", coordinate(joint))])
        }
        Effect::JointCompliance { .. } => named(&[("compliance", Unit::Compliance)]),
        Effect::GearRatio { .. } | Effect::HoistForce | Effect::TrackerScale => {
            named(&[("error", Unit::Ratio)])
        }
        Effect::Backlash { joint } => named(&[("width", coordinate(joint))]),
        Effect::PayloadBacklash { joint } => named(&[(
            "width",
            if slides(joint) { Unit::LengthPerMass } else { Unit::AnglePerMass },
        )]),
        Effect::JointNonlinearStiffness { .. } => named(&[("cubic", Unit::CubicCompliance)]),
        Effect::JointLateralCompliance { .. } | Effect::BaseCompliance => {
            about_xy(Unit::Compliance)
        }
        Effect::GravityCompensator { .. } => {
            named(&[("rate", Unit::ForcePerLength), ("preload", Unit::Force)])
        }
        Effect::JointHysteresis { .. } => named(&[("amplitude", Unit::Angle)]),
        Effect::JointThermalDrift { joint } | Effect::JointThermalDriftLag { joint, .. } => named(
            &[("rate", if slides(joint) { Unit::LengthPerDegree } else { Unit::AnglePerDegree })],
        ),
        Effect::JointCoupling { .. } => named(&[("factor", Unit::Ratio)]),
        Effect::LinkBending { .. } | Effect::SlideBending { .. } => {
            named(&[("flexibility", Unit::Flexibility)])
        }
        Effect::TwistBending { .. } => {
            named(&[("about_y", Unit::Flexibility), ("about_z", Unit::Flexibility)])
        }
        Effect::LinkThermalBending { .. } | Effect::LinkThermalBendingLag { .. } => {
            named(&[("about_y", Unit::CurvaturePerDegree), ("about_z", Unit::CurvaturePerDegree)])
        }
        Effect::ArmThermalExpansion
        | Effect::LinkThermalExpansion { .. }
        | Effect::LinkThermalExpansionLag { .. } => named(&[("strain", Unit::PerDegree)]),
        Effect::UnmodelledMass { .. } => named(&[("mass", Unit::Mass), ("at", Unit::Length)]),
        Effect::PayloadMass | Effect::BodyMass { .. } => named(&[("mass", Unit::Mass)]),
        Effect::HoistDirection => {
            named(&[("lean_x", Unit::Ratio), ("lean_y", Unit::Ratio), ("trolley", Unit::PerLength)])
        }
        Effect::GravityDirection => about_xy(Unit::Angle),
        Effect::DeflectedEquilibrium => named(&[("lambda", Unit::Ratio)]),
        Effect::TrackerDrift => xyz(Unit::Speed),
        Effect::RollingShutter { .. } => named(&[("delay", Unit::Time), ("row", Unit::Time)]),
        Effect::LensThermalDrift { .. } => named(&[("rate", Unit::Pixel)]),
        Effect::LensSag { .. } => {
            named(&["cx_sin", "cx_cos", "cy_sin", "cy_cos"].map(|name| (name, Unit::Pixel)))
        }
        Effect::PayloadPosition | Effect::StationShift { .. } | Effect::TrackerSettling { .. } => {
            xyz(Unit::Length)
        }
        Effect::StationMove { .. } => {
            let turns = ["rx", "ry", "rz"].map(|name| (name, Unit::Angle));
            named(&[["x", "y", "z"].map(|name| (name, Unit::Length)), turns].concat())
        }
        Effect::FrameStrain => {
            named(&["xx", "yy", "zz", "xy", "xz", "yz"].map(|name| (name, Unit::Ratio)))
        }
        Effect::Covariate { joint: Mount::Joint(joint), .. } => {
            named(&[("rate", if slides(joint) { Unit::LengthPerUnit } else { Unit::AnglePerUnit })])
        }
        Effect::Covariate { joint: Mount::Base, .. } => {
            let turns = ["rx", "ry", "rz"].map(|name| (name, Unit::AnglePerUnit));
            named(&[turns, ["x", "y", "z"].map(|name| (name, Unit::LengthPerUnit))].concat())
        }
        Effect::Law(law) => {
            let unit = law_unit(law.at(), law.joint(), joints);
            (1..=law.formulas().len()).map(|number| (format!("c{number}"), unit)).collect()
        }
    }
}

/// Returns the keys with owned names.
fn named(keys: &[(&str, Unit)]) -> Vec<(String, Unit)> {
    keys.iter().map(|(name, unit)| ((*name).to_owned(), *unit)).collect()
}
