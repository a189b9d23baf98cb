//! What is true of the effects that the problem of a study declares.

use super::study::{Source, Study};
use crate::error::{InputError, InputErrorKind};
use crate::model::effect::Columns;
use crate::model::parameter::{ArmField, EffectParameter, Parameter, ParameterSite};
use crate::problem::{Effect, PoseRanges, Problem};
use crate::rig::{Cause, TrueEffect, Truth, standard_normals};

/// True values of the parameters of declared effects, SI.
pub(super) struct Strengths(Vec<(String, f64)>);

impl Strengths {
    /// As the truth gives them; else drawn from their priors, where the study draws them, each by
    /// itself; else no effect.
    pub fn draw(study: &Study, seed: u64) -> Self {
        let own: Vec<_> = study
            .problem
            .effects
            .iter()
            .flat_map(|own| own.effect.parameters(&study.problem))
            .collect();
        let given = given(&study.truth, &study.problem);
        let value = |(own, normal): (EffectParameter, f64)| {
            let stated = given.iter().find(|(name, _)| *name == own.name).map(|(_, value)| *value);
            // The rig is always in equilibrium.
            let at_rest = (study.source == Source::Rig
                && own.site == ParameterSite::Arm(ArmField::Mixing))
            .then_some(1.0);
            let free = study.parameters.iter().find(|parameter| parameter.name == own.name);
            let drawn = || drawn(free.filter(|_| study.draws_effects)?, normal);
            (own.name, stated.or(at_rest).or_else(drawn).unwrap_or(own.nominal))
        };
        let normals = standard_normals(own.len(), seed);
        Self(own.into_iter().zip(normals).map(value).collect())
    }

    /// True value of a parameter of that name, if it is one of an effect.
    pub fn of(&self, name: &str) -> Option<f64> {
        self.0.iter().find(|(own, _)| own == name).map(|(_, value)| *value)
    }

    /// What the rig has to be told besides the effects of the truth: those that are declared, at
    /// these values.
    pub fn for_rig(&self, study: &Study) -> Vec<TrueEffect> {
        let given = given(&study.truth, &study.problem);
        let effect = |effect: &Effect| {
            let cause = Cause::Catalogued(effect.clone());
            let names = names(effect, &study.problem);
            if *effect == Effect::DeflectedEquilibrium
                || names.iter().all(|name| is_in(&given, name))
            {
                return None;
            }
            let value = |name: &String| {
                if is_in(&given, name) { 0.0 } else { self.of(name).unwrap_or(0.0) }
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

/// A value drawn from a prior; `None` where there is none.
fn drawn(parameter: &Parameter, normal: f64) -> Option<f64> {
    Some(parameter.value(parameter.sigma? * normal))
}

fn is_in(given: &[(String, f64)], name: &str) -> bool {
    given.iter().any(|(own, _)| own == name)
}

/// Names of an effect's parameters in the order of its law, which is that of the strengths in a
/// truth.
fn names(effect: &Effect, problem: &Problem) -> Vec<String> {
    effect.parameters(problem).into_iter().map(|parameter| parameter.name).collect()
}

/// The strengths that a truth gives, by the names of the parameters that they are the values of.
fn given(truth: &Truth, problem: &Problem) -> Vec<(String, f64)> {
    let of = |own: &TrueEffect| match own.cause() {
        Cause::Catalogued(effect) => {
            names(effect, problem).into_iter().zip(own.values().iter().copied()).collect()
        }
        Cause::Outside { .. } => Vec::new(),
    };
    truth.effects.iter().flat_map(of).collect::<Vec<_>>()
}

/// Refuses a study whose poses cannot show a declared effect, and one by the model whose truth has
/// an effect that nothing declares: `undeclared` makes the error of that.
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
    let own: Vec<String> =
        problem.effects.iter().flat_map(|own| names(&own.effect, problem)).collect();
    let is_declared = |effect: &TrueEffect| match effect.cause() {
        Cause::Catalogued(effect) => names(effect, problem).iter().all(|name| own.contains(name)),
        Cause::Outside { .. } => false,
    };
    if source == Source::Model && !truth.effects.iter().all(is_declared) {
        Err(undeclared())
    } else {
        Ok(())
    }
}
