//! Misreadings that explain why an arm does not fit its measurements.

use super::Misreading;
use crate::problem::{Effect, ParameterRule, Problem};

/// Misreading with whose correction a full fit explains the measurements.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::fit) struct Explanation {
    /// Description of the misreading, with the size that the fit found.
    pub words: String,
    /// Root mean squared error of the full fit \[m\]. Deviations from priors, in units of the prior
    /// σ, are included like errors in units of the noise σ.
    pub rms: f64,
    /// Effect with which the model fits the table as it was read, and the fitted value of its
    /// parameter; `None` if no effect expresses the misreading.
    pub effect: Option<(Effect, f64)>,
    /// Cross-validation misfit, by which the probabilities of misreadings are compared.
    pub left_out: LeftOutMisfit,
}

/// Cross-validation misfit of a fit: squared errors of rows that are left out one configuration at
/// a time, and the deviations from the priors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::fit) struct LeftOutMisfit {
    /// Mean squared length of the error of a row \[m²\].
    pub mean_square: f64,
    /// Sum of the squared deviations from nominal, in units of the prior σ.
    pub deviations: f64,
    /// Number of rows.
    pub rows: usize,
}

impl LeftOutMisfit {
    /// Returns −2 ln of the predictive density of the rows, up to a constant, for noise with
    /// standard deviation `sigma` of a coordinate \[m\].
    fn deviance(&self, sigma: f64) -> f64 {
        self.mean_square * self.rows as f64 / sigma.powi(2) + self.deviations
    }
}

/// Misreadings that would explain the misfit of a fit, best first.
#[derive(Clone, Default)]
pub(in crate::fit) struct Explanations {
    /// Misreadings with whose correction the registered nominal arm has a far smaller error.
    pub near: Vec<Misreading>,
    /// Root mean squared error of the registered nominal arm after correcting the misreading that
    /// lowers it most, the first of `near` \[m\], \[rad\] or \[px\].
    pub near_error: f64,
    /// Misreadings with whose correction a full fit has a far smaller error.
    pub fitted: Vec<Explanation>,
    /// Root mean squared error of the fit of table and problem as read \[m\], with the deviations
    /// from priors as in [`Explanation::rms`].
    pub as_read: f64,
}

/// Effect that expresses the misreading of a table: a model with this effect fits the table as it
/// was read.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct MisreadEffect {
    /// Effect, which has one parameter.
    pub effect: Effect,
    /// Fitted value of the effect's parameter.
    pub size: f64,
    /// Posterior probability of this misreading among all that explain the measurements.
    pub probability: f64,
}

impl MisreadEffect {
    /// Returns the names of the effect's parameters.
    pub fn parameters(&self, problem: &Problem) -> Vec<String> {
        self.effect.parameters(problem).into_iter().map(|parameter| parameter.name).collect()
    }

    /// Frees the effect's parameters in `problem` without priors, because the priors of the
    /// catalogue are for small errors.
    pub fn free_in(&self, problem: &mut Problem) {
        let names = self.parameters(problem).into_iter();
        let rules: Vec<_> = names.map(|name| ParameterRule::free(name, problem)).collect();
        problem.parameters.extend(rules);
    }
}

impl Explanations {
    /// Returns the effect that expresses the most probable misreading, with its probability; `None`
    /// if no effect expresses it, or if no misreading has a finite deviance. Each misreading has
    /// the same prior probability; `sigma` is the declared noise of a coordinate \[m\].
    ///
    /// The probability follows from predictions of configurations that are left out [Geisser and
    /// Eddy 1979]. The noise is `sigma`, or the rms error of a coordinate with the best misreading
    /// if that is larger.
    pub fn effect(&self, sigma: f64) -> Option<MisreadEffect> {
        let squares = self.fitted.iter().map(|explanation| explanation.left_out.mean_square / 3.0);
        let sigma = squares.fold(f64::INFINITY, f64::min).sqrt().max(sigma);
        let deviances: Vec<f64> =
            self.fitted.iter().map(|explanation| explanation.left_out.deviance(sigma)).collect();
        let finite = deviances.iter().enumerate().filter(|(_, deviance)| deviance.is_finite());
        let (best, &least) = finite.min_by(|a, b| a.1.total_cmp(b.1))?;
        let (effect, size) = self.fitted[best].effect.clone()?;
        let finite = deviances.iter().filter(|deviance| deviance.is_finite());
        let weights = finite.map(|deviance| ((least - deviance) / 2.0).exp());
        Some(MisreadEffect { effect, size, probability: weights.sum::<f64>().recip() })
    }
}

/// Maximum number of misreadings that the text of the finding names.
const MAX_NAMED: usize = 4;
/// Number of words beyond which a text names no third misreading.
const MAX_NAMED_WORDS: usize = 30;

/// Joins descriptions of misreadings, the best first: two, and up to [`MAX_NAMED`] short ones.
/// States how many others there are.
pub(in crate::fit) fn first_of(words: &[String]) -> String {
    let length = |count: usize| words[..count].join(" ").split(' ').count();
    let is_short = |count: &usize| *count <= 2 || length(*count) <= MAX_NAMED_WORDS;
    let count = (0..=words.len().min(MAX_NAMED)).rev().find(is_short).unwrap_or(0);
    let more = (words.len() > count).then(|| format!("{} more", words.len() - count));
    let named = words[..count].iter().cloned().chain(more);
    named.collect::<Vec<_>>().join(", or ")
}
