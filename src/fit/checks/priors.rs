//! Checks of the priors: how much of the result they decide, and whether their widths fit.

use serde_json::json;

use super::checked_fit::{Check, CheckedFit};
use super::finding::{Finding, FindingCode};

/// Checks that the poses measure as many coordinates as parameters are fitted.
pub(super) struct DataDecide;

impl Check for DataDecide {
    fn check(&self, fit: &CheckedFit) -> Vec<Finding> {
        let (poses, coordinates) = (fit.poses.poses, fit.poses.coordinates);
        let parameters = fit.whole.unknowns.len();
        if coordinates >= parameters {
            return Vec::new();
        }
        let noun = if poses == 1 { "pose measures" } else { "different poses measure" };
        let text = format!(
            "{poses} {noun} {coordinates} coordinates, fewer than the {parameters} parameters that are fitted: priors decide \
             most of it"
        );
        let numbers = [poses.into(), coordinates.into(), parameters.into()];
        vec![Finding::new(FindingCode::PriorsDecide, numbers, text).with_remedy(String::new())]
    }
}

/// Reports rules of `[parameters]` whose σ the fitted deviations contradict.
pub(super) struct PriorWidths;

impl Check for PriorWidths {
    fn check(&self, fit: &CheckedFit) -> Vec<Finding> {
        let finding = |size: &crate::fit::PriorSize| {
            let text = format!(
                "the fitted {} of {} joints deviate as if the σ of their prior were {:.2} times the declared one",
                size.pattern,
                size.count,
                size.found / size.declared
            );
            let numbers = [json!(size.pattern), size.declared.into(), size.found.into()];
            Finding::new(FindingCode::PriorWidth, numbers, text)
        };
        fit.prior_sizes.iter().map(finding).collect()
    }
}
