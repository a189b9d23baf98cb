//! Checks of single identification rows and touched points: outliers, influential rows, points that
//! moved.

use serde_json::json;

use super::checked_fit::CheckedFit;
use super::finding::{Finding, FindingCode, OF_MISFIT};
use super::outliers::{InfluentialRows, outliers_as_json};
use super::point_spread::PointSpread;
use super::row_kind::{MAX_LISTED, listed};
use crate::fit::Identification;
use crate::problem::Observation;

/// Checks that no identification row has a residual too large to be noise.
pub(super) fn no_outliers(fit: &CheckedFit) -> Option<Finding> {
    let (count, of) = (fit.outliers.len(), fit.rows().len());
    if count == 0 {
        return None;
    }
    let verb = if count == 1 { "stands" } else { "stand" };
    let text = format!("{count} of {of} identification rows {verb} out from the others");
    let numbers = [outliers_as_json(fit.outliers), of.into()];
    Some(Finding::new(FindingCode::Outliers, numbers, text))
}

/// Codes of findings that explain a misfit by another reading of the whole table.
const READINGS: [FindingCode; 2] = [FindingCode::Misread, FindingCode::ColumnDoubted];

impl Identification {
    /// Takes over few rows that cause most of the misfit with a finding about them, and states
    /// these rows as its cause in the errors about the misfit. An explanation by another reading of
    /// the whole table is removed if it leaves more error than the fit without these rows.
    /// `leading` is the leading kind of rows.
    pub(in crate::fit) fn state_influential_rows(
        &mut self,
        influential: InfluentialRows,
        leading: Observation,
    ) {
        let InfluentialRows { rows, reduced_chi2, sigma_taken, .. } = &influential;
        let (cause, them) = if influential.is_one() { ("causes", "it") } else { ("cause", "them") };
        let counted = influential.counted("row");
        let mut text = format!("{counted} too far off to be noise {cause} most of the misfit");
        let code = if influential.views.is_empty() {
            FindingCode::InfluentialRows
        } else {
            text = format!("{text}: {}", listed(&influential.places()));
            FindingCode::ViewsDoubted
        };
        let without = sigma_taken * leading.expected_norm();
        let is_beaten = |finding: &Finding| {
            READINGS.contains(&finding.code)
                && finding.number("after").is_some_and(|after| after > without)
        };
        let others = self.findings.iter().filter(|finding| !is_beaten(finding));
        // Without another error, the fit would be trusted although the rows count in full.
        if others.clone().any(|finding| OF_MISFIT.contains(&finding.code)) {
            let mut findings: Vec<Finding> = others.cloned().collect();
            let remedy = format!(
                "{} {cause} most of it: correct {them}, or leave {them} out",
                listed(&influential.places())
            );
            // That finding says also what is wrong in the rows.
            let has_doubted_rows =
                findings.iter().any(|finding| finding.code == FindingCode::RowsDoubted);
            // Another reading of the whole table explains many rows better.
            let has_readings = |finding: &Finding| {
                rows.len() > MAX_LISTED
                    && finding.value("explanations").is_some_and(|of| of != &json!([]))
            };
            let is_read_otherwise = findings.iter().any(has_readings);
            for finding in &mut findings {
                if OF_MISFIT.contains(&finding.code) && !has_doubted_rows && !is_read_otherwise {
                    finding.remedy.clone_from(&remedy);
                }
            }
            if !findings.iter().any(|finding| finding.code == FindingCode::Misread) {
                self.misread = None;
            }
            self.findings = findings;
        }
        let numbers = [outliers_as_json(rows), json!(reduced_chi2)];
        self.findings.push(Finding::new(code, numbers, text));
        self.influential_rows = Some(influential);
    }
}

/// Checks that at no touched point the predicted target scatters far more than at the others and
/// along one direction, as it does if the point moved.
pub(super) fn steady_points(fit: &CheckedFit) -> Vec<Finding> {
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
