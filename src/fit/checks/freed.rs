//! Fit repeated with some held parameters free, and whether chance explains that it fits better.

use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use crate::fit::{Identification, IdentifyError};
use crate::problem::{ParameterRule, Problem};

/// Largest p-value of the F test at which free parameters improve a fit significantly.
pub(super) const MAX_CHANCE_PROBABILITY: f64 = 1e-4;

/// Fit of a problem with some held parameters free.
pub(super) struct Freed {
    pub problem: Problem,
    pub fitted: Identification,
    /// Reduced χ² of the fit.
    pub reduced_chi2: f64,
    /// Number of measured coordinates beyond the unknowns of the fit.
    pub freedom: f64,
    /// Decrease of χ² by the freed parameters.
    pub gain: f64,
    /// Probability of such a decrease by chance (F test).
    pub chance: f64,
}

impl Freed {
    /// Frees the parameters `names` of a fit `found`; `None` if the fit does not converge or has no
    /// χ². `fit` repeats the fit with another problem.
    pub fn new(
        (problem, found): (&Problem, &Identification),
        names: &[String],
        fit: impl Fn(&Problem) -> Result<Identification, IdentifyError>,
    ) -> Option<Self> {
        let before = found.reduced_chi2?;
        let mut freed = problem.clone();
        let rules = names.iter().map(|name| ParameterRule::free(name.clone(), problem));
        freed.parameters.extend(rules);
        let fitted = fit(&freed).ok().filter(|fitted| fitted.termination.converged())?;
        let after = fitted.reduced_chi2?;
        let count = fitted.unknowns.len().saturating_sub(found.unknowns.len()) as f64;
        let freedom = fitted.coordinates.saturating_sub(fitted.unknowns.len()) as f64;
        let gain = before * (freedom + count) - after * freedom;
        let ratio = gain.max(0.0) / (count * after);
        let chance = FisherSnedecor::new(count, freedom).ok()?.sf(ratio);
        Some(Self { problem: freed, fitted, reduced_chi2: after, freedom, gain, chance })
    }
}
