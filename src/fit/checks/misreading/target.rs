//! Fit with a free target, for a target that is declared far from where it is.

use nalgebra::Vector3;

use super::Misreading;
use super::search::Trial;
use crate::fit::checks::checked_fit::CheckedFit;
use crate::fit::checks::parameter_limits::{MAX_PRIOR_SIGMAS, prior_sigmas};
use crate::model::parameter::ParameterSite;
use crate::numeric::root_mean;

impl CheckedFit<'_> {
    /// Returns the place of the target of `[tool]` in its frame \[m\] from a fit without its prior,
    /// and the rms residual of that fit \[m\].
    ///
    /// `None` for a problem with several targets, if the target stays within its declared prior, or
    /// if another parameter of that fit deviates far beyond its prior. With its prior, a target that
    /// is declared far off deviates together with all parameters that act alike.
    pub fn freed_target(&self) -> Option<(Vector3<f64>, f64)> {
        if !self.has_further_fits || !self.problem.targets.is_empty() {
            return None;
        }
        Trial::new(self).with_corrected(&Misreading::held_target(), false, |fitting, _| {
            let end = fitting.refitted()?;
            let mut target = self.problem.tool.target;
            let mut is_far = false;
            for (parameter, x) in fitting.model.parameters.iter().zip(&end.x) {
                if prior_sigmas(parameter, *x).is_some_and(|sigmas| sigmas > MAX_PRIOR_SIGMAS) {
                    return None;
                }
                if let ParameterSite::Target { axis: axis @ 0..3, .. } = parameter.site {
                    target[axis] += x;
                    let declared = self.fitting.model.parameters.iter();
                    let mut declared = declared.filter(|other| other.site == parameter.site);
                    is_far |= declared.any(|of| {
                        prior_sigmas(of, *x).is_none_or(|sigmas| sigmas > MAX_PRIOR_SIGMAS)
                    });
                }
            }
            if !is_far {
                return None;
            }
            let rows = &fitting.split.identification;
            let errors = fitting.position_errors(rows, &end.x);
            Some((target, root_mean(errors.iter().map(nalgebra::Matrix::norm_squared))))
        })
    }
}
