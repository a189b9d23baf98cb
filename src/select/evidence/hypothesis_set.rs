//! Set of hypotheses that explain a residual together.

use super::hypothesis::{Hypothesis, HypothesisKind, Site};
use crate::problem::Effect;

/// Hypotheses that act together, with their probability.
#[derive(Debug, Clone, PartialEq)]
pub struct HypothesisSet {
    /// Members of the set; empty if the residual is only noise.
    pub hypotheses: Vec<Hypothesis>,
    /// Probability among all sets that were evaluated.
    pub probability: f64,
    /// For each member, index of its function (`Candidate::variant`), and 1 σ of the function's
    /// coefficients in units of σ of the noise.
    pub(super) functions: Vec<(usize, f64)>,
}

impl HypothesisSet {
    /// Returns the members of the set that are effects, those with a law.
    pub fn effects(&self) -> Vec<Effect> {
        self.hypotheses.iter().filter_map(Hypothesis::effect).cloned().collect()
    }

    /// Returns the periodic errors of the set: joint (from 1), highest order, and size. The size is
    /// the prior root mean square displacement by all coefficients, in units of σ.
    pub(in crate::select) fn gears(&self) -> Vec<(usize, u32, f64)> {
        let gear =
            |(member, (_, size)): (&Hypothesis, &(usize, f64))| match (&member.kind, member.site) {
                (HypothesisKind::Gear(highest), Site::Joint(joint)) => {
                    Some((joint + 1, *highest, *size))
                }
                _ => None,
            };
        self.hypotheses.iter().zip(&self.functions).filter_map(gear).collect()
    }

    /// Returns the members that are functions without a law, each with the index of the function
    /// chosen for it.
    pub(in crate::select) fn without_law(&self) -> Vec<(Hypothesis, usize)> {
        let without_effect = self
            .hypotheses
            .iter()
            .zip(&self.functions)
            .filter(|(member, _)| member.effect().is_none());
        without_effect.map(|(member, (variant, _))| (member.clone(), *variant)).collect()
    }
}
