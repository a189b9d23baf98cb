//! Update of the corrections of an earlier estimate by new rows of the same arm.
//!
//! The weights w of the inducing variables and the changes δ of the parameters have one joint
//! Gaussian posterior, which `remainder.json` contains: means, and the factor of their precision.
//! It says how the remainder and the parameters are correlated, so it is a complete prior of new
//! rows:
//!
//! 1. The posterior is moved to the new estimate, about which the new rows are linearised. A
//!    parameter that moved by Δ there has the change δ − Δ, with the same covariance. The corrected
//!    arm therefore does not depend on how the fit without a remainder used the new rows.
//! 2. The marginal variances of δ grow by drift, and by the widening of a named change. The
//!    remainder is kept; it has no drift besides. Parameters that the model lacks (sessions that
//!    ended) are marginalised. New ones, and placements that were put down elsewhere, get their
//!    prior.
//! 3. The new rows condition w and δ together. [Rasmussen & Williams 2006, section 2.1] The
//!    inducing
//!    variables stay those of the earlier rows, so that files do not grow over the life of an arm.
//!    The part of the remainder that these do not represent counts as noise. [Snelson & Ghahramani
//!    2006]
//! 4. The scores of earlier left-out rows give the error bounds of new predictions, too. Each new
//!    configuration is predicted without itself. If the squares of these scores are larger than
//!    those of the earlier ones by more than chance (F test, 1 %), all bounds are widened.

use std::collections::{HashMap, HashSet};

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

use super::bounds::BoundTest;
use super::correction::{Correction, LinearisedParameter};
use super::fit::{Carried, Fitted, fitted_rows};
use super::gain::Gain;
use super::held_out::compare;
use super::linearise::{Linearisation, prior, timed_poses};
use super::posterior::{LeftOut, Posterior, Training};
use super::residuals::residuals;
use super::rows::{AXES, Rows};
use super::scores::{LeftOutError, left_out_errors};
use crate::fit::{Identification, IdentifyError, Placement};
use crate::measurement::Dataset;
use crate::model::Model;
use crate::numeric::{gram_of_lower, inverse_lower, lower_factor};
use crate::problem::Problem;

/// Prior 1 σ of the pose of a placement that was put down elsewhere, about its new pose: \[m\] or
/// \[rad\].
const REPLACED_SIGMA: f64 = 1.0;
/// Probability with which the bounds are widened although the new rows err as the earlier ones.
const FALSE_WIDENING_PROBABILITY: f64 = 0.01;

/// Change of an arm, and of its measurement, since its corrections were fitted.
#[derive(Debug, Clone)]
pub(crate) struct ChangedSince {
    /// Variance that is added to the deviation of each parameter, by its name.
    pub variances: HashMap<String, f64>,
    /// Names of the parameters of placements that were put down elsewhere.
    pub replaced: HashSet<String>,
    /// Ratio of the noise of the new rows to the earlier noise.
    pub noise_ratio: f64,
}

/// Corrections that belong to an earlier estimate.
#[derive(Debug, Clone)]
pub(crate) struct EarlierCorrections {
    /// Uncertainty of predictions without a remainder.
    pub alone: Correction,
    /// Remainder that corrects the predictions; `None` if the estimate has none, or the section
    /// `[remainder]` of the problem overrides it.
    pub remainder: Option<Correction>,
}

impl EarlierCorrections {
    /// Predicts at most `count` of the identification rows of `data`, evenly spaced, by the earlier
    /// estimate with its remainder. `found` is the estimate about which they are linearised.
    /// Covariance and noise are scaled by the scores of earlier left-out rows. Rows that
    /// measure no position are left out. Returns `None` without a remainder, or if no row is left.
    ///
    /// # Errors
    /// Returns an error if `problem` and `data` are not those that were identified.
    pub fn predicted(
        &self,
        (found, problem): (&Identification, &Problem),
        (data, count): (&Dataset, usize),
        since: &ChangedSince,
    ) -> Result<Option<PredictedRows>, IdentifyError> {
        let Some(earlier) = &self.remainder else { return Ok(None) };
        let placement = Placement::of(&data.measurements);
        let model = Model::new(problem, &placement.bases, &placement.targets)?;
        let model = found.strategy.model(model);
        let rows = fitted_rows(found, data).positions;
        let step = rows.len().div_ceil(count).max(1);
        let picked: Vec<usize> = rows.into_iter().step_by(step).collect();
        let update = Update { found, problem, model: &model, data, rows: &picked, since };
        let Some(Prepared { rows, posterior, .. }) = update.prepared(earlier) else {
            return Ok(None);
        };
        if rows.len() != picked.len() || picked.is_empty() {
            return Ok(None);
        }
        let factors = posterior.factors(&rows);
        let scale = earlier.scores.scale().unwrap_or(1.0).max(1.0);
        let noise = |sigma: &f64| scale * posterior.hyper.noise_variance_of(*sigma).sqrt();
        Ok(Some(PredictedRows {
            residual: &rows.residual - &factors.mean,
            covariance: factors.covariance() * (scale * scale),
            sigma: rows.relative_sigma.iter().map(noise).collect(),
            rows: picked,
        }))
    }

    /// Returns the corrections for the estimate `found`, with `since` as the change since the
    /// earlier estimate and the identification rows of `data` as new rows.
    ///
    /// Rows that measure no position do not condition the corrections. `None` if a matrix is not
    /// positive definite because of rounding.
    ///
    /// # Errors
    /// Returns an error if `problem` and `data` are not those that were identified.
    pub fn updated(
        &self,
        (found, problem): (&Identification, &Problem),
        data: &Dataset,
        since: &ChangedSince,
    ) -> Result<Option<Fitted>, IdentifyError> {
        let placement = Placement::of(&data.measurements);
        let model = Model::new(problem, &placement.bases, &placement.targets)?;
        let model = found.strategy.model(model);
        let rows = fitted_rows(found, data).positions;
        let update = Update { found, problem, model: &model, data, rows: &rows, since };
        let Some(mut alone) = update.of(&self.alone) else { return Ok(None) };
        let mut errors = left_out_errors(
            &alone.correction.posterior.hyper,
            &alone.rows,
            &alone.left_out,
            &alone.left_out,
        );
        let mut widening = alone.widened_bounds(since.noise_ratio, &errors);
        let conditioning = alone.rows.len();
        let (mut remainder, mut gain) = (None, None);
        if let Some(earlier) = &self.remainder {
            let Some(mut with) = update.of(earlier) else { return Ok(None) };
            let hyper = &with.correction.posterior.hyper;
            let errors_with = left_out_errors(hyper, &with.rows, &alone.left_out, &with.left_out);
            widening = with.widened_bounds(since.noise_ratio, &errors_with);
            let configurations = with.rows.configurations();
            let errors_alone = std::mem::take(&mut errors);
            gain = (!configurations.is_empty())
                .then(|| Gain::of(&configurations, (&errors_alone, &errors_with), 0.0));
            remainder = Some(with.correction);
        }
        let residuals = remainder.as_ref().map(|kept| residuals(found, problem, data, kept));
        let mut correction = remainder.as_ref().unwrap_or(&alone.correction).clone();
        let held_out_test = compare(&mut correction, (found, problem), data)?
            .map(|test| BoundTest { widened: 1.0, ..test });
        Ok(Some(Fitted {
            alone: alone.correction,
            remainder,
            gain,
            residuals: residuals.transpose()?,
            is_declared: false,
            carried: Some(Carried { widening, positions: rows.len(), conditioning }),
            held_out_test,
            left_out: Vec::new(),
        }))
    }
}

/// Prediction of new rows by an earlier estimate with its remainder.
#[derive(Debug, Clone)]
pub(crate) struct PredictedRows {
    /// Indices of the rows in their table.
    pub rows: Vec<usize>,
    /// Measured − predicted positions, three coordinates for each row \[m\].
    pub residual: DVector<f64>,
    /// Covariance of the predictions, without noise \[m²\].
    pub covariance: DMatrix<f64>,
    /// 1 σ of the noise of each coordinate of each row \[m\].
    pub sigma: Vec<f64>,
}

/// New estimate and rows by which corrections are updated.
struct Update<'a> {
    found: &'a Identification,
    problem: &'a Problem,
    model: &'a Model,
    data: &'a Dataset,
    /// Indices of the rows that condition the corrections.
    rows: &'a [usize],
    since: &'a ChangedSince,
}

/// New rows, and the earlier posterior as their prior.
struct Prepared {
    /// Indices in the model of the parameters of the posterior.
    unknowns: Vec<usize>,
    rows: Rows,
    posterior: Posterior,
}

/// Correction after an update.
struct Updated {
    correction: Correction,
    /// Linearised new rows, and their errors if each is predicted without its configuration.
    rows: Rows,
    left_out: Vec<LeftOut>,
}

impl Updated {
    /// Widens the error bounds by the ratio of the noise, and by that of the scores of the new rows
    /// to the earlier ones if it is significant. Returns the factor.
    fn widened_bounds(&mut self, noise_ratio: f64, errors: &[LeftOutError]) -> f64 {
        let scores = &mut self.correction.scores;
        let configurations = self.rows.configurations();
        let mean = mean_square_score(&configurations, errors);
        let ratio = mean.zip(scores.scale()).map_or(1.0, |(mean, scale)| mean / (scale * scale));
        let coordinates = |count: usize| (AXES * count.max(1)) as f64;
        let new = coordinates(configurations.len());
        let chance = FisherSnedecor::new(new, coordinates(scores.configurations))
            .map_or(1.0, |distribution| distribution.sf(ratio));
        let is_larger = mean.is_some() && chance < FALSE_WIDENING_PROBABILITY;
        let factor = noise_ratio.max(1.0) * if is_larger { ratio.sqrt() } else { 1.0 };
        scores.multiply(factor);
        factor
    }
}

/// Returns the mean over `configurations` of the mean squared score of their rows, so that repeated
/// poses count once. `None` if no configuration has finite scores.
fn mean_square_score(configurations: &[Vec<usize>], errors: &[LeftOutError]) -> Option<f64> {
    let mean_of = |rows: &Vec<usize>| {
        let squares: f64 = rows.iter().map(|&row| errors[row].score.powi(2)).sum();
        squares / rows.len() as f64
    };
    let means: Vec<f64> =
        configurations.iter().map(mean_of).filter(|mean| mean.is_finite()).collect();
    (!means.is_empty()).then(|| means.iter().sum::<f64>() / means.len() as f64)
}

impl Update<'_> {
    /// Updates a correction. Returns `None` if a matrix is not positive definite because of
    /// rounding.
    fn of(&self, earlier: &Correction) -> Option<Updated> {
        let Self { found, model, .. } = *self;
        let Prepared { unknowns, rows, posterior } = self.prepared(earlier)?;
        let training = Training::continued(&posterior, &rows)?;
        let every_row: Vec<usize> = (0..rows.len()).collect();
        let left_out = training.without_each(&rows.configuration, &every_row)?;
        let mut correction = Correction { posterior: training.posterior, ..earlier.clone() };
        let parameter = |&k: &usize| LinearisedParameter {
            name: model.parameters[k].name.clone(),
            deviation: found.x[k],
            estimate: found.estimates[k].estimate,
        };
        correction.parameters = unknowns.iter().map(parameter).collect();
        let inputs = &mut correction.layout.inputs;
        for (input, range) in inputs.ranges.iter_mut().enumerate() {
            let (offset, unit) = inputs.standard[input];
            for value in rows.inputs.row(input).iter().map(|value| offset + unit * value) {
                *range = (range.0.min(value), range.1.max(value));
            }
        }
        correction.posterior.inputs = correction.layout.inputs.clone();
        Some(Updated { correction, rows, left_out })
    }

    /// Linearises the new rows about the new estimate, and moves the earlier posterior to it.
    /// Returns `None` if a matrix is not positive definite because of rounding.
    fn prepared(&self, earlier: &Correction) -> Option<Prepared> {
        let Self { found, problem, model, .. } = *self;
        let index = |name: &str| model.parameters.iter().position(|of| of.name == name);
        let kept: Vec<(usize, usize)> = earlier
            .parameters
            .iter()
            .enumerate()
            .filter(|(_, parameter)| !self.since.replaced.contains(&parameter.name))
            .filter_map(|(place, parameter)| Some((place, index(&parameter.name)?)))
            .collect();
        let is_added = |&k: &usize| {
            let estimate = &found.estimates[k];
            estimate.fitted && estimate.at_bound.is_none() && kept.iter().all(|(_, of)| *of != k)
        };
        let added: Vec<usize> = (0..found.estimates.len()).filter(is_added).collect();
        let unknowns = kept.iter().map(|(_, k)| *k).chain(added).collect();
        let mut linearisation =
            Linearisation { problem, model, x: &found.x, unknowns, sigma: earlier.sigma };
        let mut rows = self.linearised(&linearisation, earlier);
        // New parameters that move no row are left out.
        let seen: Vec<usize> = (0..linearisation.unknowns.len())
            .filter(|&j| j < kept.len() || rows.jacobian.column(j).amax() > 0.0)
            .collect();
        rows.jacobian = rows.jacobian.select_columns(&seen);
        linearisation.unknowns = seen.iter().map(|&j| linearisation.unknowns[j]).collect();
        let posterior = self.prior_posterior(earlier, &kept, (&linearisation.unknowns, &rows))?;
        Some(Prepared { unknowns: linearisation.unknowns, rows, posterior })
    }

    /// Linearises the new rows. The result has no rows if one of them has no finite prediction.
    fn linearised(&self, linearisation: &Linearisation, earlier: &Correction) -> Rows {
        let times = (earlier.sigma, &self.found.start_times);
        let poses = timed_poses(&self.data.measurements, self.rows, times);
        let mut rows = linearisation.rows(&earlier.layout, poses);
        for sigma in &mut rows.relative_sigma {
            *sigma *= self.since.noise_ratio;
        }
        let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
        let is_usable = finite(rows.residual.as_slice())
            && finite(rows.jacobian.as_slice())
            && finite(rows.sites.as_slice());
        if is_usable { rows } else { rows.select(&[]) }
    }

    /// Returns the prior of the new rows: the posterior of `earlier`, moved to the new estimate and
    /// widened. `kept` holds the place in `earlier` and the index in the model of each parameter
    /// that stays. `unknowns` are the indices of these and of new parameters, with a column each in
    /// `rows`.
    fn prior_posterior(
        &self,
        earlier: &Correction,
        kept: &[(usize, usize)],
        (unknowns, rows): (&[usize], &Rows),
    ) -> Option<Posterior> {
        let Self { found, model, since, .. } = *self;
        let before = &earlier.posterior;
        let kernel = before.inducing.len();
        let size = kernel + unknowns.len();
        let mut prior = prior(model, &found.x, unknowns, rows);
        let mut weights = DVector::zeros(size);
        weights.rows_mut(0, kernel).copy_from(&before.weights.rows(0, kernel));
        let mut added = vec![0.0; size];
        for (j, &k) in unknowns.iter().enumerate() {
            let name = &model.parameters[k].name;
            if let Some(&(place, _)) = kept.get(j) {
                let moved = found.x[k] - earlier.parameters[place].deviation;
                prior.mean[j] = before.prior.mean[place] - moved;
                prior.spread[j] = before.prior.spread[place];
                weights[kernel + j] = before.weights[kernel + place];
                let variance = since.variances.get(name).copied().unwrap_or(0.0);
                added[kernel + j] = variance / prior.spread[j].powi(2);
            } else if since.replaced.contains(name) {
                (prior.mean[j], prior.spread[j]) = (0.0, REPLACED_SIGMA);
            }
        }
        let places: Vec<usize> =
            (0..kernel).chain(kept.iter().map(|(place, _)| kernel + place)).collect();
        let is_unchanged = size == before.factor.nrows()
            && places.len() == size
            && added.iter().all(|variance| *variance == 0.0);
        if is_unchanged {
            return Some(Posterior { prior, weights, ..before.clone() });
        }
        let covariance = gram_of_lower(&before.inverse_factor);
        let covariance = covariance.select_rows(&places).select_columns(&places);
        let mut whole = DMatrix::identity(size, size);
        whole.view_mut((0, 0), covariance.shape()).copy_from(&covariance);
        for (k, variance) in added.into_iter().enumerate() {
            whole[(k, k)] += variance;
        }
        let precision = gram_of_lower(&inverse_lower(&lower_factor(whole)?));
        let factor = lower_factor(precision)?;
        let inverse_factor = inverse_lower(&factor);
        Some(Posterior { prior, factor, inverse_factor, weights, ..before.clone() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_that_is_repeated_often_does_not_decide_the_width_of_bounds() {
        let error = |score| LeftOutError { score, ..LeftOutError::default() };
        let mut errors = vec![error(3.0); 9];
        errors.push(error(1.0));
        let configurations = [(0..9).collect(), vec![9]];
        assert_eq!(mean_square_score(&configurations, &errors), Some(5.0));
        assert_eq!(mean_square_score(&[], &errors), None);
    }
}
