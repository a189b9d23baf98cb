//! Which parameters of custom effects the model has room for.

use super::effect;
use crate::error::{InputError, InputErrorKind};
use crate::model::parameter::{BeamField, Driver, EffectParameter, JointField, Quantity, Slot};
use crate::problem::{Effect, EffectDeclaration, Joint, JointKind, Problem};

/// Whether the custom effects among those of `problem` find room in its model beside everything else.
pub(super) fn check_customs(problem: &Problem, bases: usize, targets: usize) -> Result<(), InputError> {
    for (k, EffectDeclaration { effect, location }) in problem.effects.iter().enumerate() {
        let others: Vec<EffectParameter> = problem
            .effects
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != k)
            .flat_map(|(_, other)| other.effect.parameters(problem))
            .collect();
        check_custom(problem, bases, targets, others, effect).map_err(|kind| location.clone().error(kind))?;
    }
    Ok(())
}

impl Effect {
    /// Whether a custom effect finds room in the model of `problem` beside what is declared; others always do.
    ///
    /// # Errors
    /// Its name is taken, or one of its parameters enters where the model has no room for it.
    pub fn check_room(&self, problem: &Problem) -> Result<(), InputErrorKind> {
        check_custom(problem, 1, 1, effect::parameters(problem), self)
    }
}

fn check_custom(
    problem: &Problem,
    bases: usize,
    targets: usize,
    mut others: Vec<EffectParameter>,
    effect: &Effect,
) -> Result<(), InputErrorKind> {
    if !effect.is_custom() {
        return Ok(());
    }
    let name = effect.name();
    let of_beam = |joint: &Joint| joint.beam.as_ref().is_some_and(|beam| beam.name == name);
    if effect::FAMILIES.iter().any(|family| family.name == name) || problem.joints.iter().any(of_beam) {
        return Err(InputErrorKind::ReservedName { name: name.to_owned() });
    }
    for parameter in effect.parameters(problem) {
        check(problem, bases, targets, &others, &parameter)?;
        others.push(parameter);
    }
    Ok(())
}

/// Whether `parameter` finds room beside the declared arm and `others`.
fn check(
    problem: &Problem,
    bases: usize,
    targets: usize,
    others: &[EffectParameter],
    parameter: &EffectParameter,
) -> Result<(), InputErrorKind> {
    let name = || parameter.name.clone();
    if !exists(problem, bases, targets, parameter) {
        return Err(InputErrorKind::EntersNowhere { name: name() });
    }
    if parameter.driver.is_constant() {
        let same = |other: &EffectParameter| other.driver.is_constant() && other.slot == parameter.slot;
        if is_declared(parameter.slot) || others.iter().any(same) {
            return Err(InputErrorKind::Occupied { name: name() });
        }
    } else if !is_drivable(problem, parameter.slot, parameter.driver) {
        return Err(InputErrorKind::NotDrivable { name: name() });
    }
    let twin = |other: &EffectParameter| other.name == parameter.name;
    if others.iter().any(twin) { Err(InputErrorKind::Occupied { name: name() }) } else { Ok(()) }
}

/// Whether the arm has what the parameter enters and what drives it.
fn exists(problem: &Problem, bases: usize, targets: usize, parameter: &EffectParameter) -> bool {
    let joints = problem.joints.len();
    let driven = match parameter.driver {
        Driver::Command(joint)
        | Driver::Travel(joint)
        | Driver::LoadedSide { joint, .. }
        | Driver::Sine(joint, _)
        | Driver::Cosine(joint, _)
        | Driver::Wave { joint, .. }
        | Driver::Dragged { joint, .. }
        | Driver::Spline { of: Quantity::Command(joint), .. }
        | Driver::Bump { of: Quantity::Command(joint), .. }
        | Driver::Step { of: Quantity::Command(joint), .. } => joint < joints,
        Driver::Spline { .. }
        | Driver::Bump { .. }
        | Driver::Step { .. }
        | Driver::Constant
        | Driver::Unit
        | Driver::Warming { .. }
        | Driver::Lagging { .. }
        | Driver::Elapsed
        | Driver::Since(_)
        | Driver::Settling(_) => true,
        Driver::Covariate(which) => which < problem.data.covariates.len(),
    };
    driven
        && match parameter.slot {
            Slot::Joint { joint, field: JointField::SpringRate | JointField::SpringPreload } => {
                problem.effects.iter().any(|own| own.effect.compensated() == Some(joint + 1))
            }
            Slot::Joint { joint, .. } => joint < joints,
            Slot::Beam { joint, field } => problem.joints.get(joint).is_some_and(|joint| match field {
                BeamField::Flexibility => joint.a != 0.0,
                _ => joint.beam.is_some(),
            }),
            Slot::Base { base, axis } => base < bases && axis < 6,
            Slot::Target { target, axis } => target < targets && axis < 3,
            Slot::Fixture { fixture, kind, axis } => {
                problem.fixtures.get(fixture).is_some_and(|own| own.kind == kind && axis < kind.fields().len())
            }
            Slot::Shift { axis } | Slot::Turn { axis } => axis < 3,
            Slot::Strain { entry } => entry < 6,
            Slot::Arm(_) | Slot::Scale => true,
        }
}

/// Whether the problem's own parameters are there.
fn is_declared(slot: Slot) -> bool {
    match slot {
        Slot::Joint { field, .. } => field.is_geometry() || field == JointField::Stiffness,
        Slot::Beam { field, .. } => field.is_declared(),
        Slot::Base { .. } | Slot::Target { .. } | Slot::Fixture { .. } => true,
        Slot::Arm(_) | Slot::Shift { .. } | Slot::Turn { .. } | Slot::Scale | Slot::Strain { .. } => false,
    }
}

/// Whether the model can tell the quantity anew for every pose.
fn is_drivable(problem: &Problem, slot: Slot, driver: Driver) -> bool {
    match slot {
        Slot::Joint { joint, field } => match problem.joints[joint].kind {
            JointKind::Revolute => field == JointField::Theta,
            JointKind::Prismatic => field == JointField::D,
            JointKind::Fixed => false,
        },
        Slot::Beam { field, .. } => field.is_strain() && !driver.follows_commands(),
        Slot::Shift { .. } | Slot::Turn { .. } => true,
        _ => false,
    }
}
