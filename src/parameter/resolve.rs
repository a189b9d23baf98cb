//! From the rules of `[parameters]` to free parameters.

use super::{BeamField, JointField, Parameter, Slot, Unit};
use crate::error::{InputError, InputErrorKind};
use crate::problem::pattern::matches;
use crate::problem::{Freedom, ParameterRule, Problem, Quantities};

/// A scalar of the model that a rule may free.
pub(super) struct Candidate {
    pub(super) name: String,
    /// The name without the session or target in brackets, which patterns may use as well.
    plain: String,
    pub(super) slot: Slot,
    pub(super) nominal: f64,
}

/// Free parameters of `problem` with one base per name in `bases` and one target per name in `targets`.
///
/// A single unnamed base or target (the empty word) goes without brackets: `base.x`.
///
/// # Errors
/// A rule matches nothing, or gives a quantity of the wrong kind.
pub fn resolve(problem: &Problem, bases: &[String], targets: &[String]) -> Result<Vec<Parameter>, InputError> {
    let candidates = candidates(problem, bases, targets);
    let mut decided: Vec<Option<&ParameterRule>> = vec![None; candidates.len()];
    for rule in &problem.parameters {
        let mut matched = false;
        for (candidate, decision) in candidates.iter().zip(&mut decided) {
            if matches(&rule.pattern, &candidate.name) || matches(&rule.pattern, &candidate.plain) {
                matched = true;
                *decision = Some(rule);
            }
        }
        if !matched {
            let mut known: Vec<String> = Vec::new();
            for Candidate { plain, .. } in candidates {
                if !known.contains(&plain) {
                    known.push(plain);
                }
            }
            return Err(rule.location.clone().error(InputErrorKind::MatchesNothing { known }));
        }
        check_kinds(rule, &candidates)?;
    }
    let mut parameters = Vec::new();
    for (candidate, rule) in candidates.into_iter().zip(decided) {
        let Some(ParameterRule { freedom: Freedom::Free { sigma, min, max }, .. }) = rule else { continue };
        let unit = candidate.slot.unit();
        let bound = |q: &Quantities| of_kind(q, unit).map(|v| if unit.is_relative() { v.ln() } else { v });
        parameters.push(Parameter {
            name: candidate.name,
            slot: candidate.slot,
            nominal: candidate.nominal,
            sigma: of_kind(sigma, unit),
            lower: bound(min).unwrap_or(f64::NEG_INFINITY),
            upper: bound(max).unwrap_or(f64::INFINITY),
        });
    }
    Ok(parameters)
}

/// Every scalar of the model, in a fixed order: joints, their beams, bases, targets.
pub(super) fn candidates(problem: &Problem, bases: &[String], targets: &[String]) -> Vec<Candidate> {
    let mut out = Vec::new();
    for (joint, declared) in problem.joints.iter().enumerate() {
        let nominal = [declared.alpha, declared.a, declared.theta, declared.d, declared.beta];
        let geometry = JointField::GEOMETRY.into_iter().zip(nominal);
        let stiffness = declared.stiffness.map(|k| (JointField::Stiffness, k));
        for (field, nominal) in geometry.chain(stiffness) {
            let name = format!("joint{}.{}", joint + 1, field.name());
            out.push(Candidate { plain: name.clone(), name, slot: Slot::Joint { joint, field }, nominal });
        }
    }
    for (joint, declared) in problem.joints.iter().enumerate() {
        let Some(beam) = &declared.beam else { continue };
        let bending = if beam.ei_y == beam.ei_z {
            [(BeamField::Bending, beam.ei_y), (BeamField::BendingZ, None)]
        } else {
            [(BeamField::BendingY, beam.ei_y), (BeamField::BendingZ, beam.ei_z)]
        };
        let all = [(BeamField::Axial, beam.ea), bending[0], bending[1], (BeamField::Twist, beam.gj)];
        for (field, nominal) in all {
            let Some(nominal) = nominal else { continue };
            let name = format!("{}.{}", beam.name, field.name());
            out.push(Candidate { plain: name.clone(), name, slot: Slot::Beam { joint, field }, nominal });
        }
    }
    let label = |what: &str, word: &str| if word.is_empty() { what.to_owned() } else { format!("{what}[{word}]") };
    let pose = problem.base.translation.iter().chain(problem.base.rotation.iter());
    for (base, word) in bases.iter().enumerate() {
        for (axis, (suffix, &nominal)) in ["x", "y", "z", "rx", "ry", "rz"].iter().zip(pose.clone()).enumerate() {
            let name = format!("{}.{suffix}", label("base", word));
            out.push(Candidate { name, plain: format!("base.{suffix}"), slot: Slot::Base { base, axis }, nominal });
        }
    }
    for (target, word) in targets.iter().enumerate() {
        for (axis, (suffix, &nominal)) in ["x", "y", "z"].iter().zip(&problem.tool.target).enumerate() {
            let name = format!("{}.{suffix}", label("tool", word));
            out.push(Candidate { name, plain: format!("tool.{suffix}"), slot: Slot::Target { target, axis }, nominal });
        }
    }
    out
}

/// Every quantity of a rule must fit a parameter that it matches, and every such parameter one quantity, if there are any.
fn check_kinds(rule: &ParameterRule, candidates: &[Candidate]) -> Result<(), InputError> {
    let Freedom::Free { sigma, min, max } = &rule.freedom else { return Ok(()) };
    let fail = |kind| Err(rule.location.clone().error(kind));
    let given = |unit| [sigma, min, max].iter().any(|q| of_kind(q, unit).is_some());
    let kinds = [Unit::Angle, Unit::Length, Unit::TorsionalStiffness];
    if !kinds.iter().any(|&unit| given(unit)) {
        return Ok(());
    }
    let matched: Vec<&Candidate> = candidates
        .iter()
        .filter(|candidate| matches(&rule.pattern, &candidate.name) || matches(&rule.pattern, &candidate.plain))
        .collect();
    if let Some(candidate) = matched.iter().find(|candidate| !given(candidate.slot.unit())) {
        let (parameter, suffixes) = (candidate.name.clone(), suffixes(candidate.slot.unit()));
        return fail(InputErrorKind::QuantityMissing { parameter, suffixes });
    }
    for unit in kinds {
        let fits = |candidate: &&Candidate| suffixes(candidate.slot.unit()) == suffixes(unit);
        if given(unit) && !matched.iter().any(fits) {
            return fail(InputErrorKind::QuantityUseless { suffixes: suffixes(unit) });
        }
    }
    Ok(())
}

fn suffixes(unit: Unit) -> &'static str {
    match unit {
        Unit::Angle => "_deg or _rad",
        Unit::Length => "_mm or _m",
        Unit::TorsionalStiffness | Unit::AxialRigidity | Unit::FlexuralRigidity => "_relative",
    }
}

fn of_kind(quantities: &Quantities, unit: Unit) -> Option<f64> {
    match unit {
        Unit::Angle => quantities.angle,
        Unit::Length => quantities.length,
        Unit::TorsionalStiffness | Unit::AxialRigidity | Unit::FlexuralRigidity => quantities.relative,
    }
}
