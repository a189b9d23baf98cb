//! Harmonics of joints, once many were found: all orders, with one prior.
//!
//! Where a joint covers part of its turn, harmonics of neighbouring orders hardly differ there.
//! Which of them are picked is chance; they cancel where it was measured and part beyond. With
//! every order in the model and one Gaussian prior on all coefficients, predictions go to zero
//! where nothing was measured.
//!
//! Joints of one arm have gears of a kind, which err at like orders. So σₖ = s hₖ is common to all
//! joints: its course over the orders, hₖ, is that of the coefficients of all joints, smoothed over
//! neighbouring orders, and its scale, s, the one that predicts best when whole parts of a joint's
//! range are left out.

use std::collections::BTreeSet;

use super::super::candidates::joined;
use super::super::data::Data;
use super::super::fitted::Fitted;
use super::super::neighbourhood::PartSquares;
use super::super::rules::SelectionRules;
use super::rounds::{Retested, Rounds};
use crate::fit::IdentifyError;
use crate::model::effect;
use crate::model::parameter::{EffectParameter, Regressor, rule_of};
use crate::problem::{Effect, Freedom, ParameterRule, Problem, Quantities};
use crate::quantity::Unit;

/// Estimates of σₖ from the coefficients and of these by σₖ: the first ones find its course, later
/// ones hardly change it.
const PASSES: usize = 2;

/// The prior that harmonics of all joints share: 1 σ of each order's coefficients about 0.
#[derive(Debug, Clone, PartialEq)]
pub struct HarmonicPrior {
    /// Orders, ascending, and σ \[rad\].
    pub by_order: Vec<(u32, f64)>,
}

impl HarmonicPrior {
    /// Patterns of the rules that say so in a problem, and σ \[rad\].
    pub fn rules(&self) -> impl Iterator<Item = (String, f64)> {
        let of = |(order, sigma)| {
            ["sin", "cos"].map(|wave| (format!("joint-harmonic.{wave}{order}"), sigma))
        };
        self.by_order.iter().copied().flat_map(of)
    }

    /// The same times a factor, to the digits that mean something.
    fn scaled(&self, factor: f64) -> Self {
        let rounded = |sigma: f64| format!("{sigma:.3e}").parse().unwrap_or(sigma);
        Self {
            by_order: self
                .by_order
                .iter()
                .map(|&(order, sigma)| (order, rounded(factor * sigma)))
                .collect(),
        }
    }

    /// σ of an order \[rad\].
    fn sigma(&self, order: u32) -> Option<f64> {
        let place = self.by_order.binary_search_by_key(&order, |own| own.0).ok()?;
        self.by_order.get(place).map(|own| own.1)
    }
}

/// The fit with every order of the joints whose harmonics are many, and their prior; the fit,
/// settled, where they are few or no common prior can hold them.
pub(super) fn filled(
    rounds: &Rounds,
    fitted: Fitted,
) -> Result<(Fitted, Option<HarmonicPrior>), IdentifyError> {
    let rules = rounds.data.rules;
    let coefficients = coefficients(&fitted);
    let all = |own| all_orders(own, &rounds.declared, rules.several_orders);
    let effects = rounds
        .added(&fitted)
        .into_iter()
        .map(all)
        .fold(rounds.declared.clone(), |all, own| joined(&all, &own));
    let dense = fitted.with_effects(&effects);
    if coefficients.len() < rules.many_coefficients || !takes_prior(&dense) {
        return Ok((fitted.settled(rounds.data, rounds.options)?, None));
    }
    let squares: f64 =
        coefficients.iter().map(|&(j, _)| fitted.found.x[fitted.unknowns[j]].powi(2)).sum();
    let found = (squares / coefficients.len() as f64).sqrt();
    let alike = HarmonicPrior {
        by_order: orders(&dense).into_iter().map(|order| (order, found)).collect(),
    };
    let first = rounds.fit_on(with_prior(dense.clone(), &alike), &fitted)?;
    let prior = best_prior(&first, rounds.data, alike);
    let mut filled = rounds.fit_towards(with_prior(dense, &prior), &first)?;
    // What more harmonics explain need not be explained by anything else.
    loop {
        let leaves = |tested: &Retested| {
            tested.p >= rules.leaving_level
                && !matches!(tested.effect, Effect::JointHarmonic { .. })
        };
        let leaving: Vec<Effect> =
            rounds.tested(&filled).into_iter().filter(leaves).map(|tested| tested.effect).collect();
        if leaving.is_empty() {
            let provisional = filled.found.provisional;
            let whole =
                if provisional { filled.settled(rounds.data, rounds.options)? } else { filled };
            return Ok((whole, Some(prior)));
        }
        let kept = rounds.added(&filled).into_iter().filter(|own| !leaving.contains(own));
        let effects = kept.fold(rounds.declared.clone(), |all, own| joined(&all, &own));
        filled = rounds.fit_towards(filled.with_effects(&effects), &filled)?;
    }
}

/// Order of a harmonic.
fn order(regressor: &Regressor) -> Option<u32> {
    match *regressor {
        Regressor::Sine(_, order) | Regressor::Cosine(_, order) => Some(order),
        _ => None,
    }
}

/// Places of the coefficients of harmonics among the unknowns, and their orders.
fn coefficients(fitted: &Fitted) -> Vec<(usize, u32)> {
    let order = |j: usize| order(&fitted.model.parameters[fitted.unknowns[j]].regressor);
    (0..fitted.unknowns.len()).filter_map(|j| Some((j, order(j)?))).collect()
}

/// Orders of all harmonics of a problem.
fn orders(problem: &Problem) -> BTreeSet<u32> {
    effect::parameters(problem).iter().filter_map(|own| order(&own.regressor)).collect()
}

/// Whether one prior in angles can hold all harmonics of a problem: none is of a joint that slides,
/// and no rule speaks of any.
fn takes_prior(problem: &Problem) -> bool {
    let takes =
        |own: &EffectParameter| own.unit() == Unit::Angle && rule_of(problem, own).is_none();
    effect::parameters(problem).iter().filter(|own| order(&own.regressor).is_some()).all(takes)
}

/// Several orders of a joint that were found become all of them up to the highest but those
/// declared.
fn all_orders(effect: Effect, declared: &[Effect], several: usize) -> Effect {
    match effect {
        Effect::JointHarmonic { joint, orders } if orders.len() >= several => {
            let highest = orders.into_iter().max().unwrap_or(1);
            let is_known = |&order: &u32| {
                let one = Effect::JointHarmonic { joint, orders: vec![order] };
                declared.iter().any(|known| known.covers(&one))
            };
            Effect::JointHarmonic {
                joint,
                orders: (1..=highest).filter(|order| !is_known(order)).collect(),
            }
        }
        other => other,
    }
}

/// The problem with a prior for all harmonics.
fn with_prior(mut problem: Problem, prior: &HarmonicPrior) -> Problem {
    let rule = |(pattern, sigma)| ParameterRule {
        pattern,
        freedom: Freedom::Free {
            sigma: Quantities { angle: Some(sigma), ..Quantities::default() },
            min: Quantities::default(),
            max: Quantities::default(),
        },
        location: problem.data.location.clone(),
    };
    let rules: Vec<ParameterRule> = prior.rules().map(rule).collect();
    problem.parameters.extend(rules);
    problem
}

/// The prior on harmonics whose course over the orders all of them show, and with whose scale parts
/// of the joints' ranges that are left out are predicted best, in the linear neighbourhood of the
/// fit.
fn best_prior(fitted: &Fitted, data: &Data, first: HarmonicPrior) -> HarmonicPrior {
    let linearised = fitted.linearised(data, &[]);
    let parts = parts_of_ranges(&fitted.problem, data);
    let squares = PartSquares::new(linearised.fitted(), linearised.residual(), &parts);
    let parameters =
        fitted.unknowns.iter().map(|&k| (fitted.found.x[k], fitted.model.parameters[k].sigma));
    let all = parameters.chain(linearised.relaxed().iter().map(|&sigma| (0.0, sigma)));
    // Weighed as fitted: where that took a σ larger than the declared one, priors counted for more.
    let weight = fitted.found.noise_factor.max(1.0).sqrt();
    let priors: Vec<(f64, Option<f64>)> =
        all.map(|(x, sigma)| (x, sigma.map(|sigma| sigma / weight))).collect();
    let own = coefficients(fitted);
    let with = |prior: &HarmonicPrior| {
        let mut priors = priors.clone();
        for &(j, order) in &own {
            priors[j].1 = prior.sigma(order).map(|sigma| sigma / weight);
        }
        priors
    };
    let tried = |prior: &HarmonicPrior, powers: &[f64]| {
        let error = |&power: &f64| {
            let prior = prior.scaled(power.exp2());
            Some((squares.left_out(&with(&prior))?, prior))
        };
        powers.iter().filter_map(error).min_by(|a, b| a.0.total_cmp(&b.0))
    };
    let finer = |(least, prior): (f64, HarmonicPrior), step: f64| {
        tried(&prior, &[-step, step]).filter(|other| other.0 < least).unwrap_or((least, prior))
    };
    // Looser than that, coefficients of neighbouring orders are large and cancel: they would not
    // show their course.
    let coarse: Vec<f64> = data.rules.prior_scales.clone().map(f64::from).collect();
    let Some(alike) = tried(&first, &coarse).map(|own| finer(finer(own, 0.5), 0.25)) else {
        return first;
    };
    let course = (0..PASSES).fold(alike.1.clone(), |prior, _| {
        let Some((x, variances)) = squares.posterior(&with(&prior)) else { return prior };
        let expected: Vec<(u32, f64)> = own
            .iter()
            .map(|&(j, order)| (order, x[j].powi(2) + weight.powi(2) * variances[j]))
            .collect();
        smoothed(&prior, &expected, data.rules)
    });
    let best = tried(&course, &[0.0]).map(|own| finer(finer(own, 0.5), 0.25));
    best.filter(|own| own.0 < alike.0).unwrap_or(alike).1
}

/// σₖ of every order from expected squares of the coefficients of all joints: their mean over
/// neighbouring orders, σₖ² ∝ (Σ w c² + m c̄²) / (Σ w + m), w = exp(−(k' − k)² / (2
/// `order_width`²)), with `common_values` m squares of the mean size c̄²; of the same mean square
/// over the coefficients as before.
fn smoothed(
    prior: &HarmonicPrior,
    expected: &[(u32, f64)],
    rules: &SelectionRules,
) -> HarmonicPrior {
    let count = expected.len().max(1) as f64;
    let mean = expected.iter().map(|own| own.1).sum::<f64>() / count;
    let of = |order: u32| {
        let near = |own: u32| {
            (-0.5 * ((f64::from(own) - f64::from(order)) / rules.order_width).powi(2)).exp()
        };
        let add = |(sum, weight): (f64, f64), own: &(u32, f64)| {
            (sum + near(own.0) * own.1, weight + near(own.0))
        };
        let (sum, weight) =
            expected.iter().fold((rules.common_values * mean, rules.common_values), add);
        (sum / weight).sqrt()
    };
    let course = HarmonicPrior {
        by_order: prior.by_order.iter().map(|&(order, _)| (order, of(order))).collect(),
    };
    let size = |prior: &HarmonicPrior| {
        let squares =
            expected.iter().filter_map(|own| prior.sigma(own.0)).map(|sigma| sigma.powi(2));
        (squares.sum::<f64>() / count).sqrt()
    };
    let (before, after) = (size(prior), size(&course));
    if before > 0.0 && after > 0.0 { course.scaled(before / after) } else { prior.clone() }
}

/// Identification poses in each part of the range of each joint that moves, as many in each.
fn parts_of_ranges(problem: &Problem, data: &Data) -> Vec<Vec<usize>> {
    let (rows, conditions) = (data.rows(), data.conditions(problem));
    let coordinate = |pose: usize, joint: usize| data.measurements.configuration(rows[pose])[joint];
    let of_joint = |joint: usize| {
        let mut order: Vec<usize> = (0..rows.len()).collect();
        order.sort_by(|&a, &b| coordinate(a, joint).total_cmp(&coordinate(b, joint)));
        order
            .chunks(rows.len().div_ceil(data.rules.range_parts).max(1))
            .map(<[usize]>::to_vec)
            .collect::<Vec<_>>()
    };
    (0..data.measurements.joints)
        .filter(|&joint| conditions.moves(joint))
        .flat_map(of_joint)
        .collect()
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
