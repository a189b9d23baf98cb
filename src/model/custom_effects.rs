//! Checks of the parameters of custom effects.

use super::effect;
use crate::error::{InputError, InputErrorKind};
use crate::model::parameter::{
    BeamField, EffectParameter, JointField, ParameterSite, Quantity, Regressor,
};
use crate::problem::{Effect, EffectDeclaration, Joint, JointKind, Problem};

/// Checks that every custom effect of `problem` has sites in the model besides all other
/// parameters.
pub(super) fn check_custom_effects(
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
    /// Checks that a custom effect has sites in the model of `problem` besides the declared
    /// parameters. Effects of the catalogue always have.
    ///
    /// # Errors
    /// Its name is taken, or the model has no site for one of its parameters.
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

/// Checks that the site of `parameter` exists and is free besides the declared arm and `others`.
fn check(
    problem: &Problem,
    bases: usize,
    targets: usize,
    others: &[EffectParameter],
    parameter: &EffectParameter,
) -> Result<(), InputErrorKind> {
    let name = || parameter.name.clone();
    if !has_site(problem, bases, targets, parameter) {
        return Err(InputErrorKind::SiteAbsent { name: name() });
    }
    if parameter.regressor.is_constant() {
        let same =
            |other: &EffectParameter| other.regressor.is_constant() && other.site == parameter.site;
        if is_declared(parameter.site) || others.iter().any(same) {
            return Err(InputErrorKind::SiteOccupied { name: name() });
        }
    } else if !can_evaluate(problem, parameter.site, parameter.regressor) {
        return Err(InputErrorKind::RegressorNotAllowed { name: name() });
    }
    let twin = |other: &EffectParameter| other.name == parameter.name;
    if others.iter().any(twin) {
        Err(InputErrorKind::SiteOccupied { name: name() })
    } else {
        Ok(())
    }
}

/// Returns true if the arm has the site of the parameter and the quantity of its regressor.
fn has_site(problem: &Problem, bases: usize, targets: usize, parameter: &EffectParameter) -> bool {
    let joints = problem.joints.len();
    let has_quantity = match parameter.regressor {
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
    has_quantity
        && match parameter.site {
            ParameterSite::Joint {
                joint,
                field: JointField::SpringRate | JointField::SpringPreload,
            } => problem
                .effects
                .iter()
                .any(|declared| declared.effect.compensated() == Some(joint + 1)),
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
                .is_some_and(|fixture| fixture.kind == kind && axis < kind.fields().len()),
            ParameterSite::Shift { axis } | ParameterSite::Turn { axis } => axis < 3,
            ParameterSite::Strain { entry } => entry < 6,
            ParameterSite::Arm(_) | ParameterSite::Scale => true,
        }
}

/// Returns true if the problem itself has parameters at the site.
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

/// Returns true if the model can evaluate the regressor at the site in every pose.
fn can_evaluate(problem: &Problem, site: ParameterSite, regressor: Regressor) -> bool {
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
