//! Which parameters of effects the model has room for.

use crate::error::InputError;
use crate::model::parameter::{BeamField, Driver, EffectParameter, JointField, Quantity, Slot};
use crate::problem::{JointKind, Problem};

/// Why a model cannot take a parameter of an effect.
#[derive(Debug, thiserror::Error)]
pub enum TermsError {
    /// The rules of the problem do not fit the parameters there are.
    #[error(transparent)]
    Input(#[from] InputError),
    /// Another parameter is that very quantity.
    #[error("{name} enters where another parameter is already")]
    Occupied {
        /// Name of the parameter.
        name: String,
    },
    /// Its driver changes from pose to pose, and the quantity is the same in all of them.
    #[error("{name} is driven, and only the coordinate of a moving joint and a shift of the measurement may be")]
    NotDrivable {
        /// Name of the parameter.
        name: String,
    },
    /// The arm has no such joint, beam, base or target.
    #[error("{name} enters where the arm has nothing")]
    Nowhere {
        /// Name of the parameter.
        name: String,
    },
}

/// Whether `parameter` finds room beside the declared arm and `others`.
pub(super) fn check(
    problem: &Problem,
    bases: usize,
    targets: usize,
    others: &[EffectParameter],
    parameter: &EffectParameter,
) -> Result<(), TermsError> {
    let name = || parameter.name.clone();
    if !exists(problem, bases, targets, parameter) {
        return Err(TermsError::Nowhere { name: name() });
    }
    if parameter.driver.is_constant() {
        let same = |other: &EffectParameter| other.driver.is_constant() && other.slot == parameter.slot;
        if is_declared(parameter.slot) || others.iter().any(same) {
            return Err(TermsError::Occupied { name: name() });
        }
    } else if !is_drivable(problem, parameter.slot) {
        return Err(TermsError::NotDrivable { name: name() });
    }
    let twin = |other: &EffectParameter| other.name == parameter.name;
    if others.iter().any(twin) { Err(TermsError::Occupied { name: name() }) } else { Ok(()) }
}

/// Whether the arm has what the parameter enters and what drives it.
fn exists(problem: &Problem, bases: usize, targets: usize, parameter: &EffectParameter) -> bool {
    let joints = problem.joints.len();
    let driven = match parameter.driver {
        Driver::Command(joint)
        | Driver::Travel(joint)
        | Driver::Sine(joint, _)
        | Driver::Cosine(joint, _)
        | Driver::Spline { of: Quantity::Command(joint), .. } => joint < joints,
        _ => true,
    };
    driven
        && match parameter.slot {
            Slot::Joint { joint, .. } => joint < joints,
            Slot::Beam { joint, field } => problem.joints.get(joint).is_some_and(|joint| match field {
                BeamField::Flexibility => joint.a != 0.0,
                _ => joint.beam.is_some(),
            }),
            Slot::Base { base, axis } => base < bases && axis < 6,
            Slot::Target { target, axis } => target < targets && axis < 3,
            Slot::Shift { axis } => axis < 3,
            Slot::Arm(_) | Slot::Scale => true,
        }
}

/// Whether the problem's own parameters are there.
fn is_declared(slot: Slot) -> bool {
    match slot {
        Slot::Joint { field, .. } => JointField::GEOMETRY.contains(&field) || field == JointField::Stiffness,
        Slot::Beam { field, .. } => field.is_rigidity() && field != BeamField::Flexibility,
        Slot::Base { .. } | Slot::Target { .. } => true,
        Slot::Arm(_) | Slot::Shift { .. } | Slot::Scale => false,
    }
}

/// Whether the model can tell the quantity anew for every pose.
fn is_drivable(problem: &Problem, slot: Slot) -> bool {
    match slot {
        Slot::Joint { joint, field } => match problem.joints[joint].kind {
            JointKind::Revolute => field == JointField::Theta,
            JointKind::Prismatic => field == JointField::D,
            JointKind::Fixed => false,
        },
        Slot::Shift { .. } => true,
        _ => false,
    }
}
