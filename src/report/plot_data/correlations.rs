//! Which estimates go together.

use super::states::{Arm, Sight};
use crate::identify::Identification;
use crate::least_squares::{Fit, Identifiability, Objective as _, Uncertainty};
use crate::model::PoseResiduals;
use nalgebra::DMatrix;

/// Correlations of the fitted parameters; those that rest on a bound are left out.
#[derive(Debug, Clone, PartialEq)]
pub struct Correlations {
    /// Names.
    pub names: Vec<String>,
    /// −1…1, shape = (names, names).
    pub matrix: DMatrix<f64>,
}

impl Correlations {
    /// From the covariance at the fit; active constraints between parameters are not taken into it.
    pub(super) fn of(arm: &Arm, sight: &Sight, found: &Identification, sigma: f64) -> Self {
        let parameters = &arm.model.parameters;
        let varied = |&k: &usize| found.unknowns.contains(&parameters[k].name);
        let unknowns: Vec<usize> = (0..parameters.len()).filter(varied).collect();
        let poses = sight.placement.poses(sight.measurements, &sight.split.identification, sigma);
        let residuals = PoseResiduals::new(&arm.model, poses, unknowns.clone(), arm.x.clone());
        let triangle = Fit::new(&residuals).linearise(&residuals.reduced(&arm.x)).triangle;
        let priors: Vec<Option<f64>> = unknowns.iter().map(|&k| parameters[k].sigma).collect();
        let at_bound = |name: &String| {
            found.estimates.iter().any(|estimate| estimate.name == *name && estimate.at_bound.is_some())
        };
        let held: Vec<bool> = unknowns.iter().map(|&k| at_bound(&parameters[k].name)).collect();
        // With a prior everywhere nothing is blind, and small directions must stay as the priors say.
        let gauge = if priors.iter().all(Option::is_some) {
            DMatrix::zeros(0, unknowns.len())
        } else {
            Identifiability::of(&triangle).gauge
        };
        let covariance = Uncertainty::of(&triangle, &priors, &gauge, &held, 1.0).covariance;
        let shown: Vec<usize> = (0..unknowns.len()).filter(|&j| !held[j] && covariance[(j, j)] > 0.0).collect();
        let matrix = DMatrix::from_fn(shown.len(), shown.len(), |i, j| {
            let (i, j) = (shown[i], shown[j]);
            (covariance[(i, j)] / (covariance[(i, i)] * covariance[(j, j)]).sqrt()).clamp(-1.0, 1.0)
        });
        Self { names: shown.iter().map(|&j| parameters[unknowns[j]].name.clone()).collect(), matrix }
    }
}
