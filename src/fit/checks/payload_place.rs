//! Check of the position at which a payload acts if the problem does not declare it.

use crate::fit::stages::placement::Placement;
use crate::fit::{FindingCode, Identification, IdentifyError};
use crate::measurement::Dataset;
use crate::model::Model;
use crate::problem::Problem;

use super::finding::Finding;

/// Smallest decrease of the deviance (−2 ln of the posterior density) at which the measurements
/// favour the other position of the payload. It corresponds to a likelihood ratio of 90, or three
/// standard errors.
const MIN_FALL_OF_DEVIANCE: f64 = 9.0;

/// Compares the fit with one whose payload hangs at the identified target instead of the nominal
/// one. Returns a finding if the measurements favour the identified target.
///
/// `fit` repeats the fit with another problem. Returns `None` without a comparison if the problem
/// declares the position of the payload, there is no payload, the arm is rigid, or the target is
/// not identified. The same holds with a robust loss, several targets, or fitted orientations.
pub(in crate::fit) fn payload_finding(
    problem: &Problem,
    data: &Dataset,
    found: &Identification,
    fit: impl FnOnce(&Problem) -> Result<Identification, IdentifyError>,
) -> Option<Finding> {
    let measurements = &data.measurements;
    let is_carried = match &measurements.payload {
        Some(masses) => data.split.identification.iter().any(|&row| masses[row] > 0.0),
        None => problem.tool.payload_mass > 0.0,
    };
    let is_of_target = |name: &String| name.starts_with("tool.");
    if problem.tool.payload_is_declared
        || !(is_carried && problem.is_elastic() && problem.targets.is_empty())
        || problem.robust.is_some()
        || problem.data.fits_orientation
        || !found.unknowns.iter().any(is_of_target)
    {
        return None;
    }
    let mut following = problem.clone();
    following.tool.payload_follows = true;
    let fit_following = fit(&following).ok()?;
    let before = deviance(problem, data, found, found.noise_factor)?;
    let after = deviance(&following, data, &fit_following, found.noise_factor)?;
    let is_better = fit_following.termination.converged() && before - after > MIN_FALL_OF_DEVIANCE;
    is_better.then(|| {
        let text = format!(
            "the measurements fit better if the payload hangs at the fitted target instead of the \
             nominal one: χ² with the priors falls from {before:.1} to {after:.1}"
        );
        Finding::new(FindingCode::PayloadAtTarget, [before.into(), after.into()], text)
    })
}

/// Returns χ² of the residuals for the declared variance times `noise_factor`, plus the squared
/// deviations from nominal in units of the prior σ. Returns `None` unless every identification row
/// measures a position.
fn deviance(
    problem: &Problem,
    data: &Dataset,
    found: &Identification,
    noise_factor: f64,
) -> Option<f64> {
    let placement = Placement::of(&data.measurements);
    let model = Model::new(problem, &placement.bases, &placement.targets).ok()?;
    let model = found.strategy.model(model);
    let poses = placement.poses(&data.measurements, &data.split.identification, found.sigma);
    if !poses.iter().all(|pose| pose.observation.is_position()) {
        return None;
    }
    let sigmas: Vec<f64> = poses.iter().map(|pose| pose.sigma).collect();
    let residuals = model.residuals(poses, &found.x);
    let of_rows: f64 =
        residuals.iter().zip(&sigmas).map(|(r, sigma)| r.norm_squared() / sigma.powi(2)).sum();
    let deviations = model.parameters.iter().zip(found.x.iter());
    let of_priors: f64 = deviations.filter_map(|(p, x)| Some((x / p.sigma?).powi(2))).sum();
    Some(of_rows / noise_factor.max(f64::MIN_POSITIVE) + of_priors)
}
