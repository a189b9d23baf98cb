//! Chosen poses against a tolerance of the error over the workspace.

use super::next::{NextPoses, NextStep};
use super::workspace_error::normal_bound;
use crate::fit::Noise;

/// Smallest ratio of the assumed to the attainable error at which a text says that it is larger.
const MIN_STATED_EXCESS: f64 = 1.05;

impl NextPoses {
    /// Returns the number of chosen poses after which the error bound is expected to be at most
    /// `tolerance` \[m\]; `None` without a tolerance, or if no number suffices.
    pub(crate) fn enough_after(&self, tolerance: Option<f64>) -> Option<usize> {
        let is_below =
            |step: &NextStep| step.error.zip(tolerance).is_some_and(|(of, most)| of.bound <= most);
        self.steps.iter().position(is_below).map(|step| step + 1)
    }

    /// Returns true if no number of poses is expected to bring the bound below the tolerance.
    #[doc(hidden)]
    pub fn is_out_of_reach(&self, tolerance: Option<f64>) -> bool {
        self.error.zip(tolerance).is_some_and(|(error, most)| error.least_bound > most)
    }

    /// Returns true if the declared noise alone exceeds the tolerance \[m\] with a probability of
    /// more than 1 − `level`.
    #[doc(hidden)]
    pub fn noise_exceeds(&self, tolerance: Option<f64>, level: f64) -> bool {
        let bound = normal_bound(level) * 3_f64.sqrt() * self.noise;
        let is_below = |most| most < bound;
        self.found.noise == Noise::Declared && tolerance.is_some_and(is_below)
    }

    /// Returns true if noise and assumed misfit together exceed the error that no number of poses
    /// lowers further.
    #[doc(hidden)]
    pub fn assumes_more_than_attainable(&self) -> bool {
        let assumed = 3_f64.sqrt() * self.noise.hypot(self.misfit);
        self.attainable.is_some_and(|least| assumed > MIN_STATED_EXCESS * least)
    }

    /// Returns true if the misfit of the model is known to exceed the noise. Without a declared σ
    /// the data do not tell them apart.
    #[doc(hidden)]
    pub fn has_large_misfit(&self) -> bool {
        self.found.noise == Noise::Declared && self.error.is_some() && self.misfit > self.noise
    }
}
