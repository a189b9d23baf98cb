//! Checks of single identification rows and touched points: outliers, influential rows, points that
//! moved.

use serde_json::json;

use super::checked_fit::{Check, CheckedFit};
use super::finding::{Finding, FindingCode};
use super::outliers::{InfluentialRows, outliers_as_json};
use super::point_spread::PointSpread;

/// Checks that no identification row has a residual too large to be noise.
pub(super) struct NoOutliers;

impl Check for NoOutliers {
    fn check(&self, fit: &CheckedFit) -> Vec<Finding> {
        let (count, of) = (fit.outliers.len(), fit.fitting.split.identification.len());
        if count == 0 {
            return Vec::new();
        }
        let verb = if count == 1 { "is" } else { "are" };
        let text = format!("{count} of {of} identification rows {verb} too far off to be noise");
        let numbers = [outliers_as_json(fit.outliers), of.into()];
        vec![Finding::new(FindingCode::Outliers, numbers, text)]
    }
}

/// Creates the finding about few rows that cause most of the misfit of a fit.
pub(in crate::fit) fn influential_finding(found: &InfluentialRows) -> Finding {
    let text = match found.rows.len() {
        1 => "1 row too far off to be noise causes most of the misfit".to_owned(),
        count => format!("{count} rows too far off to be noise cause most of the misfit"),
    };
    let numbers = [outliers_as_json(&found.rows), json!(found.reduced_chi2)];
    Finding::new(FindingCode::InfluentialRows, numbers, text)
}

/// Checks that at no touched point the predicted target scatters far more than at the others and
/// along one direction, as it does if the point moved.
pub(super) struct SteadyPoints;

impl Check for SteadyPoints {
    fn check(&self, fit: &CheckedFit) -> Vec<Finding> {
        let finding = |(spread, times): (&PointSpread, f64)| {
            let point = &spread.point;
            let text = format!(
                "the predictions at point {point} scatter {times:.1} times as far as at the median point, {:.0} % of it along one \
                 direction",
                100.0 * spread.share
            );
            let numbers = [json!(point), times.into(), spread.share.into()];
            Finding::new(FindingCode::UnsteadyPoint, numbers, text)
        };
        let fitted = fit.spreads.iter().map(|(_, fitted, _)| fitted);
        PointSpread::unsteady(fitted).into_iter().map(finding).collect()
    }
}
