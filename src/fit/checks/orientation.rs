//! Check of the orientations: a large error indicates that the declared convention is wrong.

use serde_json::json;

use super::checked_fit::{Check, CheckedFit};
use super::convention::{IN_RADIANS, fitting_conventions};
use super::finding::{Finding, FindingCode};

/// Smallest root mean squared error of orientation at which another convention or frame is
/// suspected \[rad\]: 2°.
const MIN_SUSPECT_ANGLE: f64 = 0.035;
/// Smallest root mean squared error of orientation, as a multiple of the declared σ of orientation,
/// at which another convention or frame is suspected.
const MIN_SIGMAS: f64 = 20.0;

/// Checks that the predicted orientations of the fitted arm are near the measured ones.
pub(super) struct OrientationsFit;

impl Check for OrientationsFit {
    fn check(&self, fit: &CheckedFit) -> Vec<Finding> {
        let Some(sigma) = fit.whole.declared_turn else { return Vec::new() };
        let fitting = fit.fitting;
        let rows = &fitting.split.identification;
        let turns = fitting.model.orientation_residuals(fitting.poses(rows), &fit.end.x);
        let lengths: Vec<f64> = turns
            .iter()
            .map(nalgebra::Matrix::norm_squared)
            .filter(|square| square.is_finite())
            .collect();
        let rms = (lengths.iter().sum::<f64>() / lengths.len().max(1) as f64).sqrt();
        if !(rms > MIN_SUSPECT_ANGLE && rms > MIN_SIGMAS * sigma) {
            return Vec::new();
        }
        let conventions = fitting_conventions(fit, rms);
        let text = format!(
            "the fitted arm misses the measured orientations by {:.1}° rms, {:.0} times the declared σ",
            rms.to_degrees(),
            rms / sigma
        );
        let numbers = [rms.into(), sigma.into(), json!(conventions)];
        let finding = Finding::new(FindingCode::OrientationMisfit, numbers, text);
        vec![match conventions.first() {
            Some(convention) if convention == IN_RADIANS => finding.with_remedy(format!(
                "the columns fit as {convention}: call them rx_rad, ry_rad and rz_rad"
            )),
            Some(convention) => finding.with_remedy(format!(
                "the measured orientations fit if the columns are read as {convention}: correct the order or the meaning of the columns"
            )),
            None => finding,
        }]
    }
}
