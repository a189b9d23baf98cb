//! True values of the effects that the problem of a study declares.

use super::definition::{Source, Study};
use crate::error::{InputError, InputErrorKind};
use crate::laws::At;
use crate::model::effect::Columns;
use crate::model::parameter::{ArmField, EffectParameter, Parameter, ParameterSite};
use crate::problem::{Effect, PoseRanges, Problem};
use crate::rig::{Cause, TrueEffect, Truth, standard_normals};

/// True values of the parameters of declared effects, by parameter name, SI units.
pub(super) struct Strengths(Vec<(String, f64)>);

impl Strengths {
    /// Determines the true values of one repetition, whose seed is `seed`. A value is the one that
    /// the truth states, else drawn from the prior if the study draws effects, else nominal (no
    /// effect).
    pub fn draw(study: &Study, seed: u64) -> Self {
        let parameters: Vec<_> = study
            .problem
            .effects
            .iter()
            .flat_map(|declared| declared.effect.parameters(&study.problem))
            .collect();
        let values = given(&study.truth, &study.problem);
        let value = |(parameter, normal): (EffectParameter, f64)| {
            let stated =
                values.iter().find(|(name, _)| *name == parameter.name).map(|(_, value)| *value);
            // The rig always computes the loads on the deflected arm, so its mixing factor is 1.
            let mixing_factor = (study.source == Source::Rig
                && parameter.site == ParameterSite::Arm(ArmField::Mixing))
            .then_some(1.0);
            let free = study.parameters.iter().find(|free| free.name == parameter.name);
            let drawn = || drawn(free.filter(|_| study.draws_effects)?, normal);
            let value = stated.or(mixing_factor).or_else(drawn).unwrap_or(parameter.nominal);
            (parameter.name, value)
        };
        let normals = standard_normals(parameters.len(), seed);
        Self(parameters.into_iter().zip(normals).map(value).collect())
    }

    /// Returns the true value of an effect parameter in SI units, or `None` if no effect has a
    /// parameter of that name.
    pub fn get(&self, name: &str) -> Option<f64> {
        self.0.iter().find(|(parameter, _)| parameter == name).map(|(_, value)| *value)
    }

    /// Returns the declared effects that the rig must simulate in addition to those of the truth,
    /// with the true values that the truth does not state.
    pub fn for_rig(&self, study: &Study) -> Vec<TrueEffect> {
        let given = given(&study.truth, &study.problem);
        let effect = |effect: &Effect| {
            let cause = Cause::Catalogued(effect.clone());
            let names = names(effect, &study.problem);
            if effect.acts_at(At::Arm(ArmField::Mixing))
                || names.iter().all(|name| is_in(&given, name))
            {
                return None;
            }
            let value = |name: &String| {
                if is_in(&given, name) { 0.0 } else { self.get(name).unwrap_or(0.0) }
            };
            TrueEffect::new(
                cause,
                &names.iter().map(value).collect::<Vec<_>>(),
                &study.problem.joints,
            )
            .ok()
        };
        study.problem.effects.iter().filter_map(|declared| effect(&declared.effect)).collect()
    }
}

/// Returns the value that lies `normal` standard deviations of a parameter's prior from its nominal
/// value; `None` if the parameter has no prior.
fn drawn(parameter: &Parameter, normal: f64) -> Option<f64> {
    Some(parameter.value(parameter.sigma? * normal))
}

/// Returns true if `given` contains a value of the parameter `name`.
fn is_in(given: &[(String, f64)], name: &str) -> bool {
    given.iter().any(|(parameter, _)| parameter == name)
}

/// Returns the names of an effect's parameters, in the order in which a truth lists its values.
fn names(effect: &Effect, problem: &Problem) -> Vec<String> {
    effect.parameters(problem).into_iter().map(|parameter| parameter.name).collect()
}

/// Returns the effect values that a truth states, with the names of their parameters.
fn given(truth: &Truth, problem: &Problem) -> Vec<(String, f64)> {
    let of = |true_effect: &TrueEffect| match true_effect.cause() {
        Cause::Catalogued(effect) => {
            names(effect, problem).into_iter().zip(true_effect.values().iter().copied()).collect()
        }
        Cause::Outside { .. } => Vec::new(),
    };
    truth.effects.iter().flat_map(of).collect::<Vec<_>>()
}

/// Checks that the poses of a study can show every declared effect. If the fitted model is the
/// source, it also checks that every effect of the truth is declared.
///
/// `undeclared` creates the error for an effect that is not declared.
pub(super) fn check(
    problem: &Problem,
    truth: &Truth,
    source: Source,
    undeclared: impl FnOnce() -> InputError,
) -> Result<(), InputError> {
    let PoseRanges { temperature, approach, ref covariates, .. } = truth.poses;
    let columns = Columns {
        temperature: temperature.is_some(),
        approach,
        time: true,
        covariates: !covariates.is_empty(),
        velocities: false,
    };
    for declared in &problem.effects {
        if declared.effect.is_thermal() && !columns.temperature {
            let write = "temperature_C = [from, to] in [poses] of the study";
            return Err(declared
                .location
                .clone()
                .error(InputErrorKind::NeedsTemperature { write }));
        }
        if let Some(write) = declared.effect.missing_column(problem, columns) {
            return Err(declared.location.clone().error(InputErrorKind::NeedsColumn { write }));
        }
    }
    let declared_names: Vec<String> =
        problem.effects.iter().flat_map(|declared| names(&declared.effect, problem)).collect();
    let is_declared = |effect: &TrueEffect| match effect.cause() {
        Cause::Catalogued(effect) => {
            names(effect, problem).iter().all(|name| declared_names.contains(name))
        }
        Cause::Outside { .. } => false,
    };
    if source == Source::Model && !truth.effects.iter().all(is_declared) {
        Err(undeclared())
    } else {
        Ok(())
    }
}
