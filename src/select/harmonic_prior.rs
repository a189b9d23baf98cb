//! Common prior of the harmonics of all joints, used if a joint has a periodic error with many
//! orders.

use crate::model::effect;
use crate::model::parameter::{Regressor, rule_of};
use crate::problem::{Effect, Freedom, ParameterRule, Problem, Quantities};
use crate::quantity::Unit;

/// Smallest number of orders of a joint's harmonics that are treated as one periodic error, whose
/// coefficients have a common prior.
pub(super) const MIN_GEAR_ORDERS: usize = 12;

/// Common prior of the harmonics of all joints: for each order, 1 σ of its coefficients about 0.
#[derive(Debug, Clone, PartialEq)]
pub struct HarmonicPrior {
    /// Orders of the harmonics, ascending, each with 1 σ of its coefficients \[rad\].
    pub by_order: Vec<(u32, f64)>,
}

impl HarmonicPrior {
    /// Returns the prior as rules of `[parameters]`: pattern of parameter names and σ \[rad\].
    pub fn rules(&self) -> impl Iterator<Item = (String, f64)> {
        let of = |(order, sigma)| {
            ["sin", "cos"].map(|wave| (format!("joint-harmonic.{wave}{order}"), sigma))
        };
        self.by_order.iter().copied().flat_map(of)
    }

    /// Returns the prior with every σ multiplied by a factor and rounded to four digits.
    pub(super) fn scaled(&self, factor: f64) -> Self {
        let rounded = |sigma: f64| format!("{sigma:.3e}").parse().unwrap_or(sigma);
        Self {
            by_order: self
                .by_order
                .iter()
                .map(|&(order, sigma)| (order, rounded(factor * sigma)))
                .collect(),
        }
    }

    /// Returns σ of an order \[rad\]; `None` if the prior does not contain the order.
    pub(super) fn sigma(&self, order: u32) -> Option<f64> {
        let index = self.by_order.binary_search_by_key(&order, |entry| entry.0).ok()?;
        self.by_order.get(index).map(|entry| entry.1)
    }

    /// Adds the prior to the parameter rules of a problem.
    pub(super) fn add_to(&self, problem: &mut Problem) {
        let rule = |(pattern, sigma)| ParameterRule {
            pattern,
            freedom: Freedom::Free {
                sigma: Quantities { angle: Some(sigma), ..Quantities::default() },
                min: Quantities::default(),
                max: Quantities::default(),
            },
            location: problem.data.location.clone(),
        };
        let rules: Vec<ParameterRule> = self.rules().map(rule).collect();
        problem.parameters.extend(rules);
    }
}

/// Returns true if an effect is a periodic error of a joint with at least [`MIN_GEAR_ORDERS`]
/// orders, whose coefficients have a common prior.
pub(super) fn is_periodic_of_many_orders(effect: &Effect) -> bool {
    matches!(effect, Effect::JointHarmonic { orders, .. } if orders.len() >= MIN_GEAR_ORDERS)
}

/// Returns true if an effect is the periodic error with many orders at the joint `joint`, counted
/// from 1.
pub(super) fn is_periodic_of_many_orders_at(effect: &Effect, joint: usize) -> bool {
    is_periodic_of_many_orders(effect)
        && matches!(effect, Effect::JointHarmonic { joint: of, .. } if *of == joint)
}

/// Returns the order k of a regressor sin(kq) or cos(kq); `None` for others.
pub(super) fn harmonic_order(regressor: &Regressor) -> Option<u32> {
    match *regressor {
        Regressor::Sine(_, order) | Regressor::Cosine(_, order) => Some(order),
        _ => None,
    }
}

/// Returns true if a common prior on angles can apply to all harmonics: no declared harmonic
/// belongs to a prismatic joint, and no rule of `[parameters]` matches a harmonic.
pub(super) fn admits_common_prior(problem: &Problem) -> bool {
    let joints =
        (1..=problem.joints.len()).filter(|&joint| problem.joints[joint - 1].takes_angle());
    let possible = joints.flat_map(|joint| {
        Effect::JointHarmonic { joint, orders: vec![1, 2, 3] }.parameters(problem)
    });
    let declared = effect::parameters(problem);
    declared
        .iter()
        .chain(&possible.collect::<Vec<_>>())
        .filter(|parameter| harmonic_order(&parameter.regressor).is_some())
        .all(|parameter| parameter.unit() == Unit::Angle && rule_of(problem, parameter).is_none())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    #[test]
    fn a_rule_of_their_own_or_a_slide_keeps_harmonics_from_the_common_prior() {
        let admits = |kind: &str, rule: &str| {
            let text = format!(
                "name = 'arm'\n[[joint]]\n[[joint]]\nkind = '{kind}'\n[[effect]]\njoint-harmonic = {{ joint = 1, orders = [1, 2] }}\n\
                 [[effect]]\njoint-harmonic = {{ joint = 2, orders = [3] }}\n[parameters]\n'joint*.theta' = {{ free = true }}\n{rule}"
            );
            admits_common_prior(&Problem::parse(&text, Path::new("problem.toml")).unwrap())
        };
        assert!(admits("revolute", "") && admits("revolute", "'*.sin*' = { sigma_mm = 1 }"));
        assert!(!admits("prismatic", ""));
        for rule in [
            "'joint-harmonic.*' = { sigma_deg = 0.01 }",
            "'joint-harmonic[2].*' = { sigma_deg = 0.01 }",
            "'joint-harmonic[1].sin2' = { fixed = true }",
            "'*.cos3' = { free = true }",
        ] {
            assert!(!admits("revolute", rule), "{rule}");
        }
    }
}
