//! Hypotheses that explain a residual together.

use super::hypothesis::{Hypothesis, Law};
use crate::problem::Effect;

/// Hypotheses that may be at work together.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// Which; none: what is left is noise.
    pub hypotheses: Vec<Hypothesis>,
    /// Its probability among all explanations that were looked at.
    pub probability: f64,
    /// For each which of its functions, and 1 σ of their coefficients.
    pub(super) functions: Vec<(usize, f64)>,
}

impl Explanation {
    /// Its effects.
    pub fn effects(&self) -> Vec<Effect> {
        self.hypotheses.iter().filter_map(Hypothesis::effect).cloned().collect()
    }

    /// Whether it holds every limit of another one for wrong.
    ///
    /// A fit with an effect in the place of a limit that holds it may free others as well: it is no fair rival.
    pub(in crate::diagnose) fn frees_as(&self, other: &Self) -> bool {
        let is_limit = |own: &&Hypothesis| matches!(own.law, Law::Limit(_));
        other.hypotheses.iter().filter(is_limit).all(|limit| self.hypotheses.contains(limit))
    }

    /// Its functions without a law, each with which one of its hypothesis it is.
    pub(in crate::diagnose) fn without_law(&self) -> Vec<(Hypothesis, usize)> {
        let all = self.hypotheses.iter().zip(&self.functions).filter(|(own, _)| own.effect().is_none());
        all.map(|(own, (variant, _))| (own.clone(), *variant)).collect()
    }
}
