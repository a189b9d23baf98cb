//! Fits a remainder together with the parameters of an identification, and decides whether to keep
//! it.

use std::collections::{BTreeMap, HashMap, HashSet};

use super::bounds::BoundTest;
use super::correction::Correction;
use super::gain::{Gain, MeanDifference};
use super::held_out::compare;
use super::judge::judge;
use super::linearise::{Linearisation, prior, timed_poses};
use super::residuals::{CorrectedResiduals, residuals};
use super::training_rows::TrainingRows;
use crate::fit::{ErrorSummary, Identification, IdentifyError, Placement};
use crate::measurement::Dataset;
use crate::model::Model;
use crate::problem::Problem;

/// Minimum number of configurations for which the uncertainty of predictions is estimated.
pub(crate) const MIN_CONFIGURATIONS: usize = 10;
/// Probability with which one of two remainders seems to predict better although it does not.
const FALSE_CHOICE_PROBABILITY: f64 = 0.025;
/// Maximum number of rows to which a correction is fitted.
const MAX_ROWS: usize = 10_000;

/// Uncertainty of an identified arm's predictions, with and without a remainder, from
/// configurations that were left out.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// Identified arm without a remainder, with the uncertainty of its predictions.
    pub alone: Correction,
    /// Identified arm with a remainder; `None` if the remainder is not kept.
    pub remainder: Option<Correction>,
    /// Gain in accuracy by the remainder on left-out configurations, whether it is kept or not.
    #[doc(hidden)]
    pub gain: Option<Gain>,
    /// Residuals of all rows with the corrected arm; `None` if no remainder is kept.
    #[doc(hidden)]
    pub residuals: Option<CorrectedResiduals>,
    /// True if the remainder was read from a file that the problem names.
    pub is_declared: bool,
    /// How remainder and uncertainty of an earlier estimate were carried over to this one; `None`
    /// if they were not.
    #[doc(hidden)]
    pub carried: Option<Carried>,
    /// Comparison of the bounds, as they follow from the fitted rows, with the errors of held-out
    /// configurations; `None` if none is held out.
    #[doc(hidden)]
    pub held_out_test: Option<BoundTest>,
    /// Errors of left-out rows with the remainder, whether it is kept or not; empty if none was
    /// fitted.
    pub(super) left_out: Vec<LeftOutRow>,
}

/// Row that was predicted without its configuration.
#[derive(Debug, Clone, Copy)]
pub(super) struct LeftOutRow {
    /// Index of the row in its table.
    row: usize,
    /// Index of the configuration of the row among those that were left out.
    configuration: usize,
    /// Length of the error of the row, predicted without its configuration \[m\].
    length: f64,
}

/// How the corrections of an earlier estimate were carried over to a new one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Carried {
    /// Factor by which the error bounds were widened, at least 1.
    pub widening: f64,
    /// Number of new rows that measure positions and are no outliers.
    pub positions: usize,
    /// Number of new rows on which the earlier corrections are conditioned: all that measure
    /// positions and are no outliers, some of them if they are very many, or none if one has no
    /// finite prediction.
    pub conditioning: usize,
}

/// Summary of the search for a remainder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// Gain in accuracy by the remainder on left-out configurations, whether it is kept or not.
    pub(crate) gain: Option<Gain>,
    /// True if the remainder was read from a file that the problem names.
    pub(crate) is_declared: bool,
    /// How remainder and uncertainty of an earlier estimate were carried over; `None` if they were
    /// not.
    pub(crate) carried: Option<Carried>,
    /// Number of joints whose errors the remainder corrects.
    pub(crate) joints: usize,
    /// Held-out errors with the remainder; `None` if none is kept. If no rows are held out, these
    /// are the errors of configurations left out, without it.
    pub(crate) held_out: Option<ErrorSummary>,
}

impl Fitted {
    /// Summarises the search for a remainder.
    #[doc(hidden)]
    pub fn outcome(&self) -> Outcome {
        let residuals = self.residuals.as_ref();
        Outcome {
            gain: self.gain,
            is_declared: self.is_declared,
            carried: self.carried,
            joints: self.remainder.as_ref().map_or(0, |remainder| remainder.joints().len()),
            held_out: residuals.map(|corrected| corrected.errors.held_out),
        }
    }

    /// Judges the held-out rows of `found`, the identification that was corrected, with the
    /// remainder if one is kept.
    #[doc(hidden)]
    pub fn judge_held_out(&self, found: &mut Identification) {
        if let Some(corrected) = &self.residuals {
            let errors: Vec<_> = corrected.rows.iter().map(|row| row.position).collect();
            found.judge_corrected(&errors);
        }
    }

    /// Returns true if this remainder, with the effects that it was fitted with, predicts left-out
    /// configurations better than `other` does with other effects: by more than chance, in a
    /// one-sided t test at 2.5 %.
    pub(crate) fn is_better_than(&self, other: &Self) -> bool {
        are_shorter(&self.left_out, &other.left_out)
    }

    /// Returns the correction of predictions: with the remainder if one is kept, else one that only
    /// states the uncertainty.
    pub(crate) fn correction(&self) -> &Correction {
        self.remainder.as_ref().unwrap_or(&self.alone)
    }

    /// Returns the same result with a remainder that the problem declares instead of the fitted
    /// one.
    ///
    /// # Errors
    /// Returns an error if `problem` and `data` are not those that were identified.
    #[doc(hidden)]
    pub fn with_declared(
        self,
        remainder: Correction,
        (found, problem): (&Identification, &Problem),
        data: &Dataset,
    ) -> Result<Self, IdentifyError> {
        let residuals = Some(residuals(found, problem, data, &remainder)?);
        // The file of the remainder holds its scores, which stay.
        let held_out_test = compare(&mut remainder.clone(), (found, problem), data)?
            .map(|test| BoundTest { widened: 1.0, ..test });
        Ok(Self { remainder: Some(remainder), residuals, is_declared: true, held_out_test, ..self })
    }
}

/// Fits a remainder and the parameters of `found` to the identification rows of `data` that are no
/// outliers. The remainder is kept if it predicts left-out configurations significantly better
/// (`Gain::is_significant`).
///
/// Rows that measure no position inform about the parameters alone. If they are no known distances,
/// no remainder is fitted, because it would move them too. Returns `None` if there are fewer than
/// ten configurations whose positions are measured.
///
/// # Errors
/// Returns an error if `problem` and `data` are not those that were identified.
pub fn fit(
    found: &Identification,
    problem: &Problem,
    data: &Dataset,
) -> Result<Option<Fitted>, IdentifyError> {
    fitted((found, problem), data, true)
}

/// Estimates the uncertainty of the predictions of `found` without fitting a remainder. The
/// conditions on the data are those of [`fit`].
///
/// # Errors
/// Returns the errors of [`fit`].
pub fn uncertainty(
    found: &Identification,
    problem: &Problem,
    data: &Dataset,
) -> Result<Option<Fitted>, IdentifyError> {
    fitted((found, problem), data, false)
}

/// Conditions the parameters on the training rows, with a remainder in addition if one is wanted
/// and predicts better. Returns `None` if the rows do not suffice.
fn fitted(
    (found, problem): (&Identification, &Problem),
    data: &Dataset,
    is_remainder_wanted: bool,
) -> Result<Option<Fitted>, IdentifyError> {
    let placement = Placement::of(&data.measurements);
    let model = found.strategy.model(Model::new(problem, &placement.bases, &placement.targets)?);
    let Some(training) = training_rows(found, problem, &model, data) else { return Ok(None) };
    let Some(judged) = judge(&training, is_remainder_wanted) else { return Ok(None) };
    let positions = fitted_rows(found, data).positions;
    let left_out = training.judged.iter().zip(&judged.left_out_lengths);
    let left_out = left_out.map(|(&row, &length)| LeftOutRow {
        row: positions[row],
        configuration: training.rows.configuration[row],
        length,
    });
    let left_out = left_out.collect();
    let correction = |conditioned| Correction::new((found, problem), &training, conditioned);
    let mut alone = correction(judged.alone);
    let mut held_out_test = compare(&mut alone, (found, problem), data)?;
    let mut remainder = judged.remainder.map(correction);
    if let Some(remainder) = &mut remainder {
        held_out_test = compare(remainder, (found, problem), data)?;
    }
    let residuals = remainder.as_ref().map(|kept| residuals(found, problem, data, kept));
    let residuals = residuals.transpose()?;
    Ok(Some(Fitted {
        alone,
        remainder,
        gain: judged.gain,
        residuals,
        is_declared: false,
        carried: None,
        held_out_test,
        left_out,
    }))
}

/// Linearises the rows of an identification. Returns `None` if they do not suffice to estimate the
/// uncertainty of predictions.
fn training_rows(
    found: &Identification,
    problem: &Problem,
    model: &Model,
    data: &Dataset,
) -> Option<TrainingRows> {
    let FittedRows { positions, others } = fitted_rows(found, data);
    let times = (found.sigma, &found.start_times);
    let poses = timed_poses(&data.measurements, &positions, times);
    if positions.is_empty() {
        return None;
    }
    // The fit took the noise of all rows of the arm as this much larger than declared.
    let excess = found.noise_factor.sqrt();
    let mut others = timed_poses(&data.measurements, &others, times);
    for pose in others.iter_mut().filter(|pose| pose.observation.is_of_arm()) {
        pose.sigma *= excess;
    }
    let takes_remainder = !others.iter().any(|pose| pose.observation.is_of_arm());
    let is_free = |k: &usize| {
        let estimate = &found.estimates[*k];
        estimate.fitted && estimate.at_bound.is_none()
    };
    let unknowns = (0..found.estimates.len()).filter(is_free).collect();
    // With the root mean square of the σ as unit of the relative σ, the noise is near the scatter of
    // the residuals, where its search begins.
    let squares: f64 = poses.iter().map(|pose| pose.sigma.powi(2)).sum();
    let sigma = (squares / poses.len().max(1) as f64).sqrt();
    let mut linearisation = Linearisation { problem, model, x: &found.x, unknowns, sigma };
    let layout = linearisation.layout(&poses);
    let mut rows = linearisation.rows(&layout, poses);
    let (slopes, residuals) = linearisation.whitened(others);
    let finite = |values: &[f64]| values.iter().all(|value| value.is_finite());
    let is_usable = finite(rows.residual.as_slice())
        && finite(rows.jacobian.as_slice())
        && finite(rows.sites.as_slice())
        && finite(slopes.as_slice())
        && finite(residuals.as_slice());
    // Parameters that move none of these rows, such as bases of held-out sessions, are left out.
    let is_seen = |j: &usize| [&rows.jacobian, &slopes].iter().any(|of| of.column(*j).amax() > 0.0);
    let seen: Vec<usize> = (0..slopes.ncols()).filter(is_seen).collect();
    rows.jacobian = rows.jacobian.select_columns(&seen);
    linearisation.unknowns = seen.iter().map(|&j| linearisation.unknowns[j]).collect();
    let prior = prior(model, &found.x, &linearisation.unknowns, &rows)
        .with_information(&slopes.select_columns(&seen), &residuals);
    let unknowns = (layout, linearisation.unknowns);
    let training = TrainingRows::new(unknowns, rows, (prior, sigma), takes_remainder);
    let suffices = training.configurations.len() >= MIN_CONFIGURATIONS && training.size > 0.0;
    (is_usable && suffices).then_some(training)
}

/// Identification rows without outliers, by what they measure.
pub(super) struct FittedRows {
    /// Indices of the rows that measure positions, above [`MAX_ROWS`] every n-th of them.
    pub positions: Vec<usize>,
    /// Indices of the rows that state a known distance or measure something else.
    pub others: Vec<usize>,
}

/// Returns the identification rows of `data` that are no outliers of `found`, by what they measure.
pub(super) fn fitted_rows(found: &Identification, data: &Dataset) -> FittedRows {
    let outliers: HashSet<usize> = found.outliers.iter().map(|outlier| outlier.row).collect();
    let rows = data.split.identification.iter().copied().filter(|row| !outliers.contains(row));
    let (positions, others): (Vec<usize>, Vec<usize>) =
        rows.partition(|&row| data.measurements.observation(row).is_of_position());
    let step = positions.len().div_ceil(MAX_ROWS).max(1);
    FittedRows { positions: positions.into_iter().step_by(step).collect(), others }
}

/// Returns true if left-out rows have shorter errors than the same rows of `others`, by more than
/// chance. Rows of one configuration count once.
fn are_shorter(errors: &[LeftOutRow], others: &[LeftOutRow]) -> bool {
    let lengths: HashMap<usize, f64> = others.iter().map(|of| (of.row, of.length)).collect();
    let mut gains: BTreeMap<usize, Vec<f64>> = BTreeMap::new();
    for of in errors {
        if let Some(length) = lengths.get(&of.row) {
            gains.entry(of.configuration).or_default().push(length - of.length);
        }
    }
    let mean = |gains: &Vec<f64>| gains.iter().sum::<f64>() / gains.len() as f64;
    let gains: Vec<f64> = gains.values().map(mean).collect();
    MeanDifference::of(&gains).exceeds(FALSE_CHOICE_PROBABILITY, gains.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_remainder_is_better_only_if_most_configurations_gain() {
        let rows = |lengths: &[f64]| -> Vec<LeftOutRow> {
            let of = |(row, &length)| LeftOutRow { row, configuration: row / 2, length };
            lengths.iter().enumerate().map(of).collect()
        };
        let long = rows(&[1.0; 24]);
        let gains = |k: usize| if k % 4 < 2 { 0.3 } else { 0.5 };
        let short = rows(&(0..24).map(|k| 1.0 - gains(k)).collect::<Vec<f64>>());
        assert!(are_shorter(&short, &long) && !are_shorter(&long, &short));
        // One configuration of twelve, measured twice, proves nothing.
        let mut once = vec![1.0; 24];
        (once[6], once[7]) = (0.0, 0.0);
        assert!(!are_shorter(&rows(&once), &long));
        // Rows that only one of both judged are left out.
        assert!(!are_shorter(&short, &long[..2]));
    }
}
