//! Check of the orientations: a large error indicates that the declared convention is wrong.

use serde_json::json;

use super::checked_fit::CheckedFit;
use super::convention::{IN_RADIANS, MAX_EXPLAINED_RATIO, fitting_conventions};
use super::finding::{Finding, FindingCode};
use super::priors::MAX_NOISE_FACTOR;
use super::turned_rows::mistaken_orientations;
use crate::numeric::root_mean;

/// Smallest root mean squared error of orientation at which another convention or frame is
/// suspected \[rad\]: 2°.
const MIN_SUSPECT_ANGLE: f64 = 0.035;
/// Smallest root mean squared error of orientation, as a multiple of the declared σ of orientation,
/// at which another convention or frame is suspected.
const MIN_SIGMAS: f64 = 20.0;
/// Ratios of the scatter of orientations to the declared σ which suggest that σ is in radians.
const DEGREE_RATIOS: std::ops::Range<f64> = 40.0..80.0;

/// Checks that the predicted orientations of the fitted arm are near the measured ones.
pub(super) fn orientations_fit(fit: &CheckedFit) -> Option<Finding> {
    let sigma = fit.whole.declared_turn?;
    let fitting = fit.fitting;
    let rows = &fitting.split.identification;
    let turns = fitting.model.orientation_residuals(fitting.poses(rows), &fit.end.x);
    let squares =
        turns.iter().map(nalgebra::Matrix::norm_squared).filter(|square| square.is_finite());
    let rms = root_mean(squares);
    if !(rms > MIN_SUSPECT_ANGLE && rms > MIN_SIGMAS * sigma) {
        return of_sigma(fit, rms / 3_f64.sqrt(), sigma);
    }
    let conventions = fitting_conventions(fit, rms);
    let text = format!(
        "the fitted arm misses the measured orientations by {:.1}° rms, {:.0} times the \
         declared σ",
        rms.to_degrees(),
        rms / sigma
    );
    let numbers = [rms.into(), sigma.into(), json!(conventions)];
    let finding = Finding::new(FindingCode::OrientationMisfit, numbers, text);
    let remedy = match conventions.first() {
        Some(convention) if convention == IN_RADIANS => {
            Some(format!("the columns fit as {convention}: call them rx_rad, ry_rad and rz_rad"))
        }
        Some(convention) => Some(format!(
            "the measured orientations fit if the columns are read as {convention}: correct \
             the order or the meaning of the columns"
        )),
        None => mistaken_orientations(fit, MAX_EXPLAINED_RATIO * rms),
    };
    Some(finding.with_remedy_of(remedy))
}

/// Returns the finding that the orientations scatter by far more than their declared `sigma`
/// \[rad\], although all rows together do not contradict the declared noise. `rms` is that of a
/// coordinate \[rad\].
fn of_sigma(fit: &CheckedFit, rms: f64, sigma: f64) -> Option<Finding> {
    let ratio = rms / sigma;
    if ratio.powi(2) <= MAX_NOISE_FACTOR || fit.noise_factor > MAX_NOISE_FACTOR {
        return None;
    }
    let text = format!(
        "the measured orientations scatter by {:.2e}° about the fitted arm, {ratio:.0} times the \
         declared σ of {:.2e}°",
        rms.to_degrees(),
        sigma.to_degrees()
    );
    let numbers = [rms.into(), sigma.into(), json!([])];
    let finding = Finding::new(FindingCode::OrientationMisfit, numbers, text);
    let is_in_radians = DEGREE_RATIOS.contains(&ratio);
    Some(finding.with_remedy(if is_in_radians {
        format!(
            "orientation_sigma_deg is probably in radians: write {:.3}",
            sigma.to_degrees().to_degrees()
        )
    } else {
        "check size and unit of orientation_sigma_deg".to_owned()
    }))
}
