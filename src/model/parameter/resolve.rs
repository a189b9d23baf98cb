//! Free parameters from the rules of `[parameters]`.

use super::{BeamField, JointField, Parameter, ParameterSite, Regressor, unit};
use crate::error::{InputError, InputErrorKind};
use crate::laws::NAMES;
use crate::problem::effect;
use crate::problem::pattern::matches;
use crate::problem::{Fixture, Freedom, ParameterRule, Placement, Problem, Quantities};
use crate::quantity::Unit;

/// Scalar of the model that a rule may free.
pub(super) struct Candidate {
    pub(super) name: String,
    /// Name without the session or target in brackets. Patterns of rules may match it as well as
    /// the full name.
    plain: String,
    pub(super) site: ParameterSite,
    pub(super) regressor: Regressor,
    pub(super) nominal: f64,
    /// Default 1 σ of the prior of an effect's parameter, SI. The parameter is free unless a rule
    /// holds it.
    effect_sigma: Option<f64>,
    /// Bounds of a parameter of an effect, SI.
    limits: (f64, f64),
    /// True for a number of a fixture that the problem does not declare: it is free, and no rule
    /// may fix it.
    unknown: bool,
}

impl Candidate {
    pub(super) fn unit(&self) -> Unit {
        unit(self.site, &self.regressor)
    }

    fn matches(&self, rule: &ParameterRule) -> bool {
        matches_name(rule, &self.name, &self.plain)
    }
}

/// Parameter of an effect, declared or not.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectParameter {
    /// Name such as `gear-ratio[3].error`.
    pub name: String,
    /// Name without the place in brackets: `gear-ratio.error`.
    pub plain: String,
    /// Site of the model at which the parameter acts.
    pub site: ParameterSite,
    /// Factor that multiplies the parameter at its site.
    pub regressor: Regressor,
    /// Nominal value, SI, at which the effect vanishes; for a position or time of an effect, its
    /// start value.
    pub nominal: f64,
    /// Standard deviation (1 σ) of a prior wide enough for every realistic size, in SI units or ln.
    pub sigma: f64,
    /// Smallest value that the parameter may have, SI.
    pub lower: f64,
    /// Largest value that the parameter may have, SI.
    pub upper: f64,
}

impl EffectParameter {
    /// Returns the unit of the parameter's value.
    pub fn unit(&self) -> Unit {
        unit(self.site, &self.regressor)
    }

    fn is_named_by(&self, rule: &ParameterRule) -> bool {
        matches_name(rule, &self.name, &self.plain)
    }
}

/// Returns true if the rule's pattern matches the name or the plain name (without brackets) of a
/// parameter.
fn matches_name(rule: &ParameterRule, name: &str, plain: &str) -> bool {
    matches(&rule.pattern, name) || matches(&rule.pattern, plain)
}

/// Returns the free parameters of `problem` with one base per name in `bases` and one target per
/// name in `targets`.
///
/// A single base or target with an empty name has no brackets: `base.x`.
///
/// # Errors
/// Returns an error if a rule matches nothing, or gives a quantity of the wrong unit.
pub fn resolve(
    problem: &Problem,
    bases: &[String],
    targets: &[String],
    effects: &[EffectParameter],
) -> Result<Vec<Parameter>, InputError> {
    let candidates = candidates(problem, bases, targets, effects);
    let mut decided: Vec<Option<&ParameterRule>> = vec![None; candidates.len()];
    for rule in &problem.parameters {
        let mut matched = false;
        for (candidate, decision) in candidates.iter().zip(&mut decided) {
            if candidate.matches(rule) {
                matched = true;
                if candidate.effect_sigma.is_some() && !applies_to_unit(rule, candidate.unit()) {
                    continue;
                }
                *decision = Some(rule);
            }
        }
        if !matched {
            let mut plain_names: Vec<String> = Vec::new();
            for Candidate { plain, .. } in &candidates {
                if !plain_names.contains(plain) {
                    plain_names.push(plain.clone());
                }
            }
            let undeclared = undeclared_effect_error(problem, &rule.pattern, &plain_names);
            // Undeclared effects that a rule fixes are not searched for.
            if undeclared.is_some() && matches!(rule.freedom, Freedom::Fixed) {
                continue;
            }
            let kind = undeclared.or_else(|| named_by_frame(problem, &rule.pattern));
            let kind = kind.unwrap_or(InputErrorKind::MatchesNothing {
                pattern: rule.pattern.clone(),
                known: plain_names,
            });
            return Err(rule.location.clone().error(kind));
        }
        check_units(rule, &candidates)?;
    }
    let mut parameters = Vec::new();
    for (candidate, rule) in candidates.into_iter().zip(decided) {
        if let (true, Some(rule), ParameterSite::Fixture { kind, axis, .. }) =
            (candidate.unknown, rule, candidate.site)
            && !matches!(&rule.freedom, Freedom::Free { sigma, .. } if sigma.of_kind(candidate.unit()).is_none())
        {
            let kind = InputErrorKind::UnknownPlaceHeld {
                parameter: candidate.name,
                write: kind.declared_by(axis),
            };
            return Err(rule.location.clone().error(kind));
        }
        let none = Quantities::default();
        let (sigma, min, max) = match (rule.map(|rule| &rule.freedom), candidate.effect_sigma) {
            (Some(Freedom::Free { sigma, min, max }), _) => {
                (sigma.of_kind(candidate.unit()), min, max)
            }
            // A σ that is not finite belongs to a parameter of unknown unit, which gets no prior.
            (None, Some(sigma)) => (Some(sigma).filter(|sigma| sigma.is_finite()), &none, &none),
            (None, None) if candidate.unknown => (None, &none, &none),
            (Some(Freedom::Fixed), _) | (None, None) => continue,
        };
        if candidate.site.turns_target() && !problem.data.fits_orientation {
            continue;
        }
        let unit = candidate.unit();
        let bound =
            |q: &Quantities| q.of_kind(unit).map(|v| if unit.is_relative() { v.ln() } else { v });
        parameters.push(Parameter {
            name: candidate.name,
            site: candidate.site,
            regressor: candidate.regressor,
            nominal: candidate.nominal,
            sigma,
            lower: bound(min).unwrap_or(candidate.limits.0 - candidate.nominal),
            upper: bound(max).unwrap_or(candidate.limits.1 - candidate.nominal),
        });
    }
    Ok(parameters)
}

/// Returns the last rule in `[parameters]` whose pattern and unit match a parameter of an effect,
/// declared or not; `None` if none matches.
pub fn rule_of<'a>(problem: &'a Problem, parameter: &EffectParameter) -> Option<&'a ParameterRule> {
    problem
        .parameters
        .iter()
        .rev()
        .find(|rule| parameter.is_named_by(rule) && applies_to_unit(rule, parameter.unit()))
}

/// Returns the error of a pattern that begins with the name of a joint instead of its number.
fn named_by_frame(problem: &Problem, pattern: &str) -> Option<InputErrorKind> {
    let (name, rest) = pattern.split_once('.')?;
    let joint = problem.joints.iter().position(|joint| joint.name == name)?;
    Some(InputErrorKind::NamedByFrame { write: format!("joint{}.{rest}", joint + 1) })
}

/// Returns the error for a pattern that matches no parameter in `names` but effects which the
/// problem does not declare; `None` if it matches no effect.
fn undeclared_effect_error(
    problem: &Problem,
    pattern: &str,
    names: &[String],
) -> Option<InputErrorKind> {
    // The word before the dot or bracket of `hoist-force.error`, `gear-ratio[3].error`.
    let head = |name: &str| name.split(['.', '[']).next().unwrap_or_default().to_owned();
    let wanted = head(pattern);
    if names.iter().any(|name| matches(&wanted, &head(name))) {
        return None;
    }
    let effects: Vec<&str> = NAMES.iter().copied().filter(|name| matches(&wanted, name)).collect();
    let write = effect::example(effects.first()?, problem);
    Some(InputErrorKind::EffectNotDeclared { effects: effects.join(", "), write })
}

/// Returns true if the rules of `problem` hold (fix) all `parameters` of an undeclared effect.
pub fn are_all_fixed(problem: &Problem, parameters: &[EffectParameter]) -> bool {
    let held = |parameter| {
        rule_of(problem, parameter).is_some_and(|rule| matches!(rule.freedom, Freedom::Fixed))
    };
    !parameters.is_empty() && parameters.iter().all(held)
}

/// Returns true if a rule of `problem` would be an error once an effect with these parameters is
/// declared: it matches only effects and gives no quantity in their unit.
pub fn makes_rule_invalid(problem: &Problem, parameters: &[EffectParameter]) -> bool {
    let none = [String::new()];
    let is_for_arm = |rule| {
        candidates(problem, &none, &none, &[]).iter().any(|candidate| candidate.matches(rule))
    };
    let misses = |rule: &ParameterRule| {
        parameters.iter().any(|parameter| {
            parameter.is_named_by(rule) && !applies_to_unit(rule, parameter.unit())
        })
    };
    problem.parameters.iter().any(|rule| misses(rule) && !is_for_arm(rule))
}

/// Returns every scalar of the model that a rule may free, in a fixed order: joints, their beams,
/// bases, targets, fixtures, effects.
pub(super) fn candidates(
    problem: &Problem,
    bases: &[String],
    targets: &[String],
    effects: &[EffectParameter],
) -> Vec<Candidate> {
    let mut out = Vec::new();
    let declared = |name: String, plain: String, site, nominal| Candidate {
        name,
        plain,
        site,
        regressor: Regressor::Constant,
        nominal,
        effect_sigma: None,
        limits: (f64::NEG_INFINITY, f64::INFINITY),
        unknown: false,
    };
    for (joint, declared_joint) in problem.joints.iter().enumerate() {
        let geometry: Vec<(JointField, f64)> = match &declared_joint.placement {
            Some(Placement { xyz, rpy }) => JointField::PLACEMENT
                .into_iter()
                .zip(xyz.iter().chain(rpy.iter()).copied())
                .collect(),
            None => JointField::GEOMETRY
                .into_iter()
                .zip([
                    declared_joint.alpha,
                    declared_joint.a,
                    declared_joint.theta,
                    declared_joint.d,
                    declared_joint.beta,
                ])
                .collect(),
        };
        let stiffness = declared_joint.stiffness.map(|k| (JointField::Stiffness, k));
        for (field, nominal) in geometry.into_iter().chain(stiffness) {
            let name = format!("joint{}.{}", joint + 1, field.name());
            out.push(declared(name.clone(), name, ParameterSite::Joint { joint, field }, nominal));
        }
    }
    for (joint, declared_joint) in problem.joints.iter().enumerate() {
        let Some(beam) = &declared_joint.beam else { continue };
        let bending = if beam.ei_y == beam.ei_z {
            [(BeamField::Bending, beam.ei_y), (BeamField::BendingZ, None)]
        } else {
            [(BeamField::BendingY, beam.ei_y), (BeamField::BendingZ, beam.ei_z)]
        };
        let rigidities =
            [(BeamField::Axial, beam.ea), bending[0], bending[1], (BeamField::Twist, beam.gj)];
        for (field, nominal) in rigidities {
            let Some(nominal) = nominal else { continue };
            let name = format!("{}.{}", beam.name, field.name());
            out.push(declared(name.clone(), name, ParameterSite::Beam { joint, field }, nominal));
        }
    }
    let place = |what: &str, word: &str, axis: usize, site, nominal| {
        let suffix = ["x", "y", "z", "rx", "ry", "rz"][axis];
        let label = if word.is_empty() { what.to_owned() } else { format!("{what}[{word}]") };
        declared(format!("{label}.{suffix}"), format!("{what}.{suffix}"), site, nominal)
    };
    let pose = problem.base.translation.iter().chain(problem.base.rotation.iter());
    for (base, word) in bases.iter().enumerate() {
        let base_of = |(axis, &nominal): (usize, &f64)| {
            place("base", word, axis, ParameterSite::Base { base, axis }, nominal)
        };
        out.extend(pose.clone().enumerate().map(base_of));
    }
    for (target, word) in targets.iter().enumerate() {
        // The constructor of the model refuses a word that names no target.
        let Ok(declared_target) = problem.target(word) else { continue };
        let rotation =
            declared_target.rotation.iter().filter(|_| problem.data.orientation_sigma.is_some());
        let pose = declared_target.at.iter().chain(rotation);
        let target_of = |(axis, &nominal): (usize, &f64)| {
            place("tool", word, axis, ParameterSite::Target { target, axis }, nominal)
        };
        out.extend(pose.enumerate().map(target_of));
    }
    for (fixture, Fixture { name, kind, known, .. }) in problem.fixtures.iter().enumerate() {
        for (axis, (field, known)) in kind.fields().iter().zip(known).enumerate() {
            let site = ParameterSite::Fixture { fixture, kind: *kind, axis };
            let (word, nominal) = (kind.word(), known.unwrap_or(0.0));
            let candidate = declared(
                format!("{word}[{name}].{field}"),
                format!("{word}.{field}"),
                site,
                nominal,
            );
            out.push(Candidate { unknown: known.is_none(), ..candidate });
        }
    }
    out.extend(effects.iter().cloned().map(|effect| Candidate {
        name: effect.name,
        plain: effect.plain,
        site: effect.site,
        regressor: effect.regressor,
        nominal: effect.nominal,
        effect_sigma: Some(effect.sigma),
        limits: (effect.lower, effect.upper),
        unknown: false,
    }));
    out
}

/// Checks a rule against the candidates that it matches: each quantity must fit the unit of one of
/// them, and each of them needs a quantity.
fn check_units(rule: &ParameterRule, candidates: &[Candidate]) -> Result<(), InputError> {
    let Freedom::Free { sigma, min, max } = &rule.freedom else { return Ok(()) };
    let fail = |kind| Err(rule.location.clone().error(kind));
    let given = |unit| [sigma, min, max].iter().any(|q| q.of_kind(unit).is_some());
    let kinds = [Unit::Angle, Unit::Length, Unit::Pixel, Unit::TorsionalStiffness];
    if !kinds.iter().any(|&unit| given(unit)) {
        return Ok(());
    }
    let matched: Vec<&Candidate> =
        candidates.iter().filter(|candidate| candidate.matches(rule)).collect();
    // A rule that also matches parameters other than those of effects does not change effects with
    // another unit.
    let all_of_effects = matched.iter().all(|candidate| candidate.effect_sigma.is_some());
    // A rule written for the tool's position leaves its orientation free without a prior.
    let has_position = matched.iter().any(|candidate| !candidate.site.turns_target());
    let missing = |candidate: &&&Candidate| {
        (all_of_effects || candidate.effect_sigma.is_none())
            && !given(candidate.unit())
            && !(has_position && candidate.site.turns_target())
    };
    if let Some(candidate) = matched.iter().find(missing) {
        let (parameter, suffixes) = (candidate.name.clone(), suffixes(candidate.unit()));
        return fail(InputErrorKind::QuantityMissing { parameter, suffixes });
    }
    for unit in kinds {
        let fits = |candidate: &&Candidate| suffixes(candidate.unit()) == suffixes(unit);
        if given(unit) && !matched.iter().any(fits) {
            return fail(InputErrorKind::QuantityUseless { suffixes: suffixes(unit) });
        }
    }
    Ok(())
}

/// Returns true if a rule can apply to a parameter of this unit. Such a rule holds the parameter,
/// frees it without quantities, or gives a quantity in its unit.
fn applies_to_unit(rule: &ParameterRule, unit: Unit) -> bool {
    let Freedom::Free { sigma, min, max } = &rule.freedom else { return true };
    let quantities = [sigma, min, max];
    quantities.iter().all(|q| **q == Quantities::default())
        || quantities.iter().any(|q| q.of_kind(unit).is_some())
}

fn suffixes(unit: Unit) -> &'static str {
    match unit {
        Unit::Angle => "_deg or _rad",
        Unit::Length => "_mm or _m",
        Unit::Pixel => "_px",
        Unit::TorsionalStiffness | Unit::AxialRigidity | Unit::FlexuralRigidity => "_relative",
        _ => "free = true or fixed = true",
    }
}
