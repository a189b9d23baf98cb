//! Which parameters of custom effects the model has room for.

use super::effect;
use crate::error::{InputError, InputErrorKind};
use crate::model::parameter::{
    BeamField, EffectParameter, JointField, ParameterSite, Quantity, Regressor,
};
use crate::problem::{Effect, EffectDeclaration, Joint, JointKind, Problem};

/// Whether the custom effects among those of `problem` find room in its model beside everything
/// else.
pub(super) fn check_customs(
    problem: &Problem,
    bases: usize,
    targets: usize,
) -> Result<(), InputError> {
    for (k, EffectDeclaration { effect, location }) in problem.effects.iter().enumerate() {
        let others: Vec<EffectParameter> = problem
            .effects
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != k)
            .flat_map(|(_, other)| other.effect.parameters(problem))
            .collect();
        check_custom(problem, bases, targets, others, effect)
            .map_err(|kind| location.clone().error(kind))?;
    }
    Ok(())
}

impl Effect {
    /// Whether a custom effect finds room in the model of `problem` beside what is declared; others
    /// always do.
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
    if effect::FAMILIES.iter().any(|family| family.name == name)
        || problem.joints.iter().any(of_beam)
    {
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
        return Err(InputErrorKind::SiteAbsent { name: name() });
    }
    if parameter.regressor.is_constant() {
        let same =
            |other: &EffectParameter| other.regressor.is_constant() && other.site == parameter.site;
        if is_declared(parameter.site) || others.iter().any(same) {
            return Err(InputErrorKind::SiteOccupied { name: name() });
        }
    } else if !is_drivable(problem, parameter.site, parameter.regressor) {
        return Err(InputErrorKind::RegressorNotAllowed { name: name() });
    }
    let twin = |other: &EffectParameter| other.name == parameter.name;
    if others.iter().any(twin) {
        Err(InputErrorKind::SiteOccupied { name: name() })
    } else {
        Ok(())
    }
}

/// Whether the arm has what the parameter enters and what drives it.
fn exists(problem: &Problem, bases: usize, targets: usize, parameter: &EffectParameter) -> bool {
    let joints = problem.joints.len();
    let driven = match parameter.regressor {
        Regressor::Command(joint)
        | Regressor::Travel(joint)
        | Regressor::LoadedSide { joint, .. }
        | Regressor::Sine(joint, _)
        | Regressor::Cosine(joint, _)
        | Regressor::Wave { joint, .. }
        | Regressor::Dragged { joint, .. }
        | Regressor::Spline { of: Quantity::Command(joint), .. }
        | Regressor::Bump { of: Quantity::Command(joint), .. }
        | Regressor::Step { of: Quantity::Command(joint), .. } => joint < joints,
        Regressor::Spline { .. }
        | Regressor::Bump { .. }
        | Regressor::Step { .. }
        | Regressor::Constant
        | Regressor::Unit
        | Regressor::Warming { .. }
        | Regressor::Lagging { .. }
        | Regressor::Elapsed
        | Regressor::Since(_)
        | Regressor::Settling(_) => true,
        Regressor::Covariate(which) => which < problem.data.covariates.len(),
    };
    driven
        && match parameter.site {
            ParameterSite::Joint {
                joint,
                field: JointField::SpringRate | JointField::SpringPreload,
            } => problem.effects.iter().any(|own| own.effect.compensated() == Some(joint + 1)),
            ParameterSite::Joint { joint, .. } => joint < joints,
            ParameterSite::Beam { joint, field } => {
                problem.joints.get(joint).is_some_and(|joint| match field {
                    BeamField::Flexibility => joint.a != 0.0,
                    _ => joint.beam.is_some(),
                })
            }
            ParameterSite::Base { base, axis } => base < bases && axis < 6,
            ParameterSite::Target { target, axis } => target < targets && axis < 3,
            ParameterSite::Fixture { fixture, kind, axis } => problem
                .fixtures
                .get(fixture)
                .is_some_and(|own| own.kind == kind && axis < kind.fields().len()),
            ParameterSite::Shift { axis } | ParameterSite::Turn { axis } => axis < 3,
            ParameterSite::Strain { entry } => entry < 6,
            ParameterSite::Arm(_) | ParameterSite::Scale => true,
        }
}

/// Whether the problem's own parameters are there.
fn is_declared(site: ParameterSite) -> bool {
    match site {
        ParameterSite::Joint { field, .. } => field.is_geometry() || field == JointField::Stiffness,
        ParameterSite::Beam { field, .. } => field.is_declared(),
        ParameterSite::Base { .. }
        | ParameterSite::Target { .. }
        | ParameterSite::Fixture { .. } => true,
        ParameterSite::Arm(_)
        | ParameterSite::Shift { .. }
        | ParameterSite::Turn { .. }
        | ParameterSite::Scale
        | ParameterSite::Strain { .. } => false,
    }
}

/// Whether the model can tell the quantity anew for every pose.
fn is_drivable(problem: &Problem, site: ParameterSite, regressor: Regressor) -> bool {
    match site {
        ParameterSite::Joint { joint, field } => match problem.joints[joint].kind {
            JointKind::Revolute => field == JointField::Theta,
            JointKind::Prismatic => field == JointField::D,
            JointKind::Fixed => false,
        },
        ParameterSite::Beam { field, .. } => field.is_strain() && !regressor.follows_commands(),
        ParameterSite::Shift { .. } | ParameterSite::Turn { .. } => true,
        _ => false,
    }
}
