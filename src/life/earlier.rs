//! Earlier estimate of an arm, or prior from its siblings, as a Gaussian on the parameters of a
//! model.

use std::collections::HashSet;
use std::path::PathBuf;

use nalgebra::{DMatrix, DVector};

use super::drift;
use super::error::PriorError;
use super::fleet_file::FleetPrior;
use crate::fit::{EarlierData, SavedEstimate, Strategy};
use crate::model::Model;
use crate::problem::Problem;

/// Relative difference up to which two σ count as equal.
pub(super) const EQUAL_SIGMA: f64 = 1e-6;
/// Standard deviation (1 σ) assumed for the deviation of a parameter without any prior: \[m\],
/// \[rad\], or of a logarithm.
pub(super) const WIDE_SIGMA: f64 = 1.0;

/// Gaussian distribution of some parameters of a model, from an earlier estimate or from siblings,
/// widened by drift.
#[derive(Debug, Clone)]
pub(super) struct Earlier {
    /// File that it was read from.
    pub file: PathBuf,
    /// Names of the parameters.
    pub names: Vec<String>,
    /// Index of each parameter in the model.
    pub indices: Vec<usize>,
    /// Mean of the deviations from nominal.
    pub mean: DVector<f64>,
    /// Covariance of the deviations.
    pub covariance: DMatrix<f64>,
    /// Digests of the rows to which the earlier estimate was fitted.
    pub fitted_rows: HashSet<String>,
    /// Standard deviation (1 σ) of a measured coordinate to assume for new rows \[m\]; `None`
    /// unless it is larger than the declared one or none is declared.
    pub sigma: Option<f64>,
    /// True if the Gaussian contains the prior of a fleet.
    pub includes_fleet: bool,
}

impl Earlier {
    /// Returns the Gaussian that an earlier estimate gives on the parameters of a model, `days`
    /// days later.
    ///
    /// # Errors
    /// Returns an error if the estimate is of another arm or has other laws, was made by another
    /// strategy than joint, or has no covariance; or if a rule of `[drift]` matches nothing.
    pub fn of_estimate(
        estimate: &SavedEstimate,
        problem: &Problem,
        model: &Model,
        days: f64,
    ) -> Result<Self, PriorError> {
        let file = estimate.file.clone();
        if estimate.strategy != Strategy::Joint {
            return Err(PriorError::Strategy { file, found: estimate.strategy.as_str() });
        }
        estimate.check_same_arm(problem, model)?;
        let drift = drift::variances(problem, model, days)?;
        let saved = &estimate.posterior;
        let entries: Vec<(usize, usize, f64)> = estimate
            .entries()
            .enumerate()
            .filter_map(|(row, (name, value, _))| {
                let k = model.parameters.iter().position(|parameter| parameter.name == name)?;
                (saved.covariance[(row, row)] > 0.0).then_some((row, k, value))
            })
            .collect();
        if entries.is_empty() {
            return Err(PriorError::NoCovariance { file });
        }
        let deviation = |&(_, k, value): &(usize, usize, f64)| model.parameters[k].deviation(value);
        let mean = DVector::from_iterator(entries.len(), entries.iter().map(deviation));
        let slope =
            |i: usize| model.parameters[entries[i].1].value_error(mean[i], 1.0).abs().recip();
        let covariance = DMatrix::from_fn(entries.len(), entries.len(), |i, j| {
            let entry = saved.covariance[(entries[i].0, entries[j].0)] * slope(i) * slope(j);
            let drifted = if i == j { drift[entries[i].1] } else { 0.0 };
            (if entry.is_finite() { entry } else { 0.0 }) + drifted
        });
        let declared = problem.data.position_sigma;
        let is_larger =
            |sigma: &f64| declared.is_none_or(|declared| *sigma > declared * (1.0 + EQUAL_SIGMA));
        Ok(Self {
            file,
            names: entries.iter().map(|&(_, k, _)| model.parameters[k].name.clone()).collect(),
            indices: entries.iter().map(|&(_, k, _)| k).collect(),
            mean,
            covariance,
            fitted_rows: saved.fitted_rows.clone(),
            sigma: saved.sigma_taken.or(estimate.estimated_sigma).filter(is_larger),
            includes_fleet: saved.includes_fleet,
        })
    }

    /// Returns the Gaussian that the siblings of an arm give on the parameters of a model, widened
    /// by the drift of `days` days.
    ///
    /// # Errors
    /// Returns an error that names what differs, or a rule of `[drift]` that matches nothing.
    pub fn of_fleet(
        prior: &FleetPrior,
        problem: &Problem,
        model: &Model,
        days: f64,
    ) -> Result<Self, PriorError> {
        let file = prior.file.clone();
        if prior.problem != problem.name {
            let (found, expected) = (prior.problem.clone(), problem.name.clone());
            return Err(PriorError::OtherProblem { file, found, expected });
        }
        let parts = problem.digest_parts();
        let differs = |name: &&String| parts.get(*name) != prior.arm_parts.get(*name);
        if let Some(part) = prior.arm_parts.keys().chain(parts.keys()).find(differs) {
            return Err(PriorError::OtherPart { file, part: part.clone() });
        }
        let drift = drift::variances(problem, model, days)?;
        let mut indices = Vec::new();
        for name in prior.parameters.keys() {
            match model.parameters.iter().position(|parameter| parameter.name == *name) {
                Some(k) => indices.push(k),
                None => return Err(PriorError::NotFree { file, name: name.clone() }),
            }
        }
        let count = indices.len();
        let entries = prior.parameters.values();
        let variance =
            entries.clone().zip(&indices).map(|((_, sigma), &k)| sigma * sigma + drift[k]);
        Ok(Self {
            file,
            names: prior.parameters.keys().cloned().collect(),
            mean: DVector::from_iterator(count, entries.map(|(mean, _)| *mean)),
            covariance: DMatrix::from_diagonal(&DVector::from_iterator(count, variance)),
            indices,
            fitted_rows: HashSet::new(),
            sigma: None,
            includes_fleet: true,
        })
    }

    /// Returns the Gaussian as rows that are added to a fit. The declared priors, which it
    /// contains, are divided out, so that they do not count twice.
    ///
    /// # Errors
    /// Returns an error if the covariance is not positive definite.
    pub fn data(&self, model: &Model) -> Result<EarlierData, PriorError> {
        let precision = |k: &usize| model.parameters[*k].sigma.map_or(0.0, |sigma| sigma.powi(-2));
        let precision =
            DVector::from_iterator(self.indices.len(), self.indices.iter().map(precision));
        EarlierData::new(self.names.clone(), &self.mean, &self.covariance, &precision)
            .ok_or_else(|| PriorError::NoCovariance { file: self.file.clone() })
    }

    /// Returns the index in the Gaussian of the parameter whose index in the model is `parameter`;
    /// `None` if the Gaussian does not contain it.
    pub fn place_of(&self, parameter: usize) -> Option<usize> {
        self.indices.iter().position(|&k| k == parameter)
    }

    /// Replaces what the Gaussian states on some parameters of the model by the mean `x` (full
    /// parameter vector) and a standard deviation `sigma`, independent of all others.
    pub fn replace(&mut self, parameters: &[usize], x: &DVector<f64>, sigma: f64) {
        let places: Vec<usize> = parameters.iter().filter_map(|&k| self.place_of(k)).collect();
        for place in places {
            self.covariance.row_mut(place).fill(0.0);
            self.covariance.column_mut(place).fill(0.0);
            self.covariance[(place, place)] = sigma * sigma;
            self.mean[place] = x[self.indices[place]];
        }
    }

    /// Adds the covariance s² v vᵀ of a change of several parameters together, s = `sigmas`. `moved`
    /// holds the index in the model of each parameter and its change v; those that the Gaussian does
    /// not contain are left out.
    pub fn widen(&mut self, moved: &[(usize, f64)], sigmas: f64) {
        let placed = |&(k, change): &(usize, f64)| Some((self.place_of(k)?, sigmas * change));
        let placed: Vec<(usize, f64)> = moved.iter().filter_map(placed).collect();
        for (i, change) in &placed {
            for (j, other) in &placed {
                self.covariance[(*i, *j)] += change * other;
            }
        }
    }
}
