//! Harmonics of joints, once many were found: all orders, with one prior.
//!
//! Where a joint covers part of its turn, harmonics of neighbouring orders hardly differ there. Which of them are picked is
//! chance; they cancel where it was measured and part beyond. With every order in the model and one Gaussian prior on all
//! coefficients, predictions go to zero where nothing was measured. The prior's σ is the one that predicts best when whole
//! parts of a joint's range are left out.

use super::super::candidates::joined;
use super::super::data::Data;
use super::super::fitted::Fitted;
use super::super::neighbourhood::PartSquares;
use super::rounds::{Retested, Rounds};
use crate::identify::IdentifyError;
use crate::model::effect;
use crate::model::parameter::{Driver, EffectParameter, rule_of};
use crate::problem::{Effect, Freedom, ParameterRule, Problem, Quantities};
use crate::quantity::Unit;

/// Pattern of the rule that gives all harmonics of joints one prior.
pub const HARMONICS: &str = "joint-harmonic.*";

/// The fit with every order of the joints whose harmonics are many, and 1 σ of their prior \[rad\]; the fit, settled, where
/// they are few or no common prior can hold them.
pub(super) fn filled(rounds: &Rounds, fitted: Fitted) -> Result<(Fitted, Option<f64>), IdentifyError> {
    let rules = rounds.data.rules;
    let coefficients = coefficients(&fitted);
    let all = |own| all_orders(own, &rounds.declared, rules.several_orders);
    let effects =
        rounds.added(&fitted).into_iter().map(all).fold(rounds.declared.clone(), |all, own| joined(&all, &own));
    let dense = fitted.with_effects(&effects);
    if coefficients.len() < rules.many_coefficients || !takes_prior(&dense) {
        return Ok((fitted.settled(rounds.data, rounds.options)?, None));
    }
    let squares: f64 = coefficients.iter().map(|&j| fitted.found.x[fitted.unknowns[j]].powi(2)).sum();
    let found = (squares / coefficients.len() as f64).sqrt();
    let first = rounds.fit_on(with_scale(dense.clone(), found), &fitted)?;
    let scale = best_scale(&first, rounds.data, found);
    let mut filled = rounds.fit_towards(with_scale(dense, scale), &first)?;
    // What more harmonics explain need not be explained by anything else.
    loop {
        let leaves = |tested: &Retested| {
            tested.p >= rules.leaving_level && !matches!(tested.effect, Effect::JointHarmonic { .. })
        };
        let leaving: Vec<Effect> =
            rounds.tested(&filled).into_iter().filter(leaves).map(|tested| tested.effect).collect();
        if leaving.is_empty() {
            let in_passing = filled.found.in_passing;
            let whole = if in_passing { filled.settled(rounds.data, rounds.options)? } else { filled };
            return Ok((whole, Some(scale)));
        }
        let kept = rounds.added(&filled).into_iter().filter(|own| !leaving.contains(own));
        let effects = kept.fold(rounds.declared.clone(), |all, own| joined(&all, &own));
        filled = rounds.fit_towards(filled.with_effects(&effects), &filled)?;
    }
}

fn is_harmonic(driver: Driver) -> bool {
    matches!(driver, Driver::Sine(..) | Driver::Cosine(..))
}

/// Places of the coefficients of harmonics among the unknowns.
fn coefficients(fitted: &Fitted) -> Vec<usize> {
    let driver = |j: usize| fitted.model.parameters[fitted.unknowns[j]].driver;
    (0..fitted.unknowns.len()).filter(|&j| is_harmonic(driver(j))).collect()
}

/// Whether one prior in angles can hold all harmonics of a problem: none is of a joint that slides, and no rule speaks of any.
fn takes_prior(problem: &Problem) -> bool {
    let takes = |own: &EffectParameter| own.unit() == Unit::Angle && rule_of(problem, own).is_none();
    effect::parameters(problem).iter().filter(|own| is_harmonic(own.driver)).all(takes)
}

/// Several orders of a joint that were found become all of them up to the highest but those declared.
fn all_orders(effect: Effect, declared: &[Effect], several: usize) -> Effect {
    match effect {
        Effect::JointHarmonic { joint, orders } if orders.len() >= several => {
            let highest = orders.into_iter().max().unwrap_or(1);
            let is_known = |&order: &u32| {
                let one = Effect::JointHarmonic { joint, orders: vec![order] };
                declared.iter().any(|known| known.covers(&one))
            };
            Effect::JointHarmonic { joint, orders: (1..=highest).filter(|order| !is_known(order)).collect() }
        }
        other => other,
    }
}

/// The problem with a prior for all harmonics.
fn with_scale(mut problem: Problem, sigma: f64) -> Problem {
    problem.parameters.push(ParameterRule {
        pattern: HARMONICS.to_owned(),
        freedom: Freedom::Free {
            sigma: Quantities { angle: Some(sigma), ..Quantities::default() },
            min: Quantities::default(),
            max: Quantities::default(),
        },
        location: problem.data.location.clone(),
    });
    problem
}

/// The scale \[rad\] of the prior on harmonics with which parts of the joints' ranges that are left out are predicted best,
/// in the linear neighbourhood of the fit.
fn best_scale(fitted: &Fitted, data: &Data, found: f64) -> f64 {
    let own = coefficients(fitted);
    let linearised = fitted.linearised(data, &[]);
    let parts = parts_of_ranges(&fitted.problem, data);
    let squares = PartSquares::new(&linearised.fitted(), linearised.residual(), &parts);
    let parameters = fitted.unknowns.iter().map(|&k| (fitted.found.x[k], fitted.model.parameters[k].sigma));
    let all = parameters.chain(linearised.relaxed().iter().map(|&sigma| (0.0, sigma)));
    // Weighed as fitted: where that took a σ larger than the declared one, priors counted for more.
    let weight = fitted.found.noise_factor.max(1.0).sqrt();
    let priors: Vec<(f64, Option<f64>)> = all.map(|(x, sigma)| (x, sigma.map(|sigma| sigma / weight))).collect();
    let error = |scale: f64| {
        let mut priors = priors.clone();
        for &j in &own {
            priors[j].1 = Some(scale / weight);
        }
        squares.left_out(&priors)
    };
    let best = |powers: &[f64]| {
        let tried = powers.iter().filter_map(|&power| Some((power, error(found * power.exp2())?)));
        tried.min_by(|a, b| a.1.total_cmp(&b.1))
    };
    let coarse: Vec<f64> = data.rules.prior_scales.clone().map(f64::from).collect();
    let finer = |(power, least): (f64, f64), step: f64| {
        best(&[power - step, power + step]).filter(|other| other.1 < least).unwrap_or((power, least))
    };
    let finest = best(&coarse).map(|own| finer(finer(own, 0.5), 0.25));
    finest.map_or(found, |(power, _)| found * power.exp2())
}

/// Identification poses in each part of the range of each joint that moves, as many in each.
fn parts_of_ranges(problem: &Problem, data: &Data) -> Vec<Vec<usize>> {
    let (rows, conditions) = (data.rows(), data.conditions(problem));
    let coordinate = |pose: usize, joint: usize| data.measurements.configuration(rows[pose])[joint];
    let of_joint = |joint: usize| {
        let mut order: Vec<usize> = (0..rows.len()).collect();
        order.sort_by(|&a, &b| coordinate(a, joint).total_cmp(&coordinate(b, joint)));
        order.chunks(rows.len().div_ceil(data.rules.range_parts).max(1)).map(<[usize]>::to_vec).collect::<Vec<_>>()
    };
    (0..data.measurements.joints).filter(|&joint| conditions.moves(joint)).flat_map(of_joint).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn a_rule_of_their_own_or_a_slide_keeps_harmonics_from_the_common_prior() {
        let takes = |kind: &str, rule: &str| {
            let text = format!(
                "name = 'arm'\n[[joint]]\n[[joint]]\nkind = '{kind}'\n[[effect]]\njoint-harmonic = {{ joint = 1, orders = [1, 2] }}\n\
                 [[effect]]\njoint-harmonic = {{ joint = 2, orders = [3] }}\n[parameters]\n'joint*.theta' = {{ free = true }}\n{rule}"
            );
            takes_prior(&Problem::parse(&text, Path::new("problem.toml")).unwrap())
        };
        assert!(takes("revolute", "") && takes("revolute", "'*.sin*' = { sigma_mm = 1 }"));
        assert!(!takes("prismatic", ""));
        for rule in [
            "'joint-harmonic.*' = { sigma_deg = 0.01 }",
            "'joint-harmonic[2].*' = { sigma_deg = 0.01 }",
            "'joint-harmonic[1].sin2' = { fixed = true }",
            "'*.cos3' = { free = true }",
        ] {
            assert!(!takes("revolute", rule), "{rule}");
        }
    }
}
