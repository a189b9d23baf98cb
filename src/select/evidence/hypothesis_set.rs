//! Hypotheses that explain a residual together.

use super::hypothesis::Hypothesis;
use crate::problem::Effect;

/// Hypotheses that may be at work together.
#[derive(Debug, Clone, PartialEq)]
pub struct HypothesisSet {
    /// Which; none: what is left is noise.
    pub hypotheses: Vec<Hypothesis>,
    /// Its probability among all explanations that were looked at.
    pub probability: f64,
    /// For each which of its functions, and 1 σ of their coefficients.
    pub(super) functions: Vec<(usize, f64)>,
}

impl HypothesisSet {
    /// Its effects.
    pub fn effects(&self) -> Vec<Effect> {
        self.hypotheses.iter().filter_map(Hypothesis::effect).cloned().collect()
    }

    /// Its functions without a law, each with which one of its hypothesis it is.
    pub(in crate::select) fn without_law(&self) -> Vec<(Hypothesis, usize)> {
        let all =
            self.hypotheses.iter().zip(&self.functions).filter(|(own, _)| own.effect().is_none());
        all.map(|(own, (variant, _))| (own.clone(), *variant)).collect()
    }
}
