//! Identification with an earlier estimate as prior.

use std::collections::HashSet;
use std::path::Path;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use super::assessment::{Assessment, assess};
use super::causes::{Cause, CauseKind, Extended};
use super::contradiction::{self, Contradiction, most_probable};
use super::drift;
use super::earlier::{Earlier, WIDE_SIGMA};
use super::error::PriorError;
use super::evidence::factor;
use super::fleet_file::FleetPrior;
use super::pairs::with_pairs;
use super::relocation::{self, MIN_RELOCATION_NATS, Placed};
use super::rows::{SensitiveRows, warmth};
use crate::fit::{
    self, ComparedParameter, Identification, Options, Placement, PriorComparison, SavedEstimate,
    Strategy,
};
use crate::measurement::{Dataset, Measurements, Split};
use crate::model::{Model, Pose};
use crate::numeric::lower_factor;
use crate::observation::Observation;
use crate::problem::Problem;
use crate::quantity::Unit;
use crate::remainder::{ChangedSince, EarlierCorrections, PredictedRows};

/// Likelihood ratio of a change to "unchanged" above which new rows contradict the earlier
/// estimate: a false alarm in at most one of a hundred identifications.
const CONTRADICTION_RATIO: f64 = 100.0;
/// Maximum number of causes for which the prior is widened, one after the other.
const MAX_CAUSES: usize = 4;
/// Standard deviation that is added to the prior of the parameters of a change, as a multiple of
/// the size of the change.
const WIDENING: f64 = 3.0;
/// Smallest information of the new rows on a parameter, relative to that of the prior, at which the
/// estimate by the new rows alone is stated.
const MIN_LEARNED: f64 = 1e-3;
/// Distance of a bound from the mean of the prior, in standard deviations of the prior, beyond
/// which an estimate at the bound contradicts the prior.
const BOUND_SIGMAS: f64 = 3.0;

/// Source of the prior of an identification.
#[derive(Debug, Clone)]
pub enum PriorSource {
    /// Earlier estimate of the same arm.
    Estimate(Box<SavedEstimate>),
    /// Siblings of the arm.
    Fleet(FleetPrior),
}

impl PriorSource {
    /// Returns the path of the file from which the prior was read.
    fn file(&self) -> &Path {
        match self {
            Self::Estimate(estimate) => &estimate.file,
            Self::Fleet(prior) => &prior.file,
        }
    }
}

/// Identification with a prior, and what changed since the prior.
pub(super) struct Identified {
    pub found: Identification,
    /// Measured rows, of which those that the prior contains are neither fitted nor held out.
    pub data: Dataset,
    /// Change since the earlier estimate.
    pub since: ChangedSince,
}

/// Fits the identification rows of `data` with a prior, the posterior of an earlier estimate or
/// that of a fleet, widened by the drift of `days` days.
///
/// Identification and held-out rows to which the earlier estimate was fitted are left out, because
/// the prior contains them. If the new rows contradict the prior, the prior of the most probable
/// cause's parameters is widened, and the fit is repeated. With the remainder of the earlier
/// estimate in `corrections`, the new rows are tested against its corrected predictions.
///
/// # Errors
/// Returns an error if the estimate is of another arm or has other laws, if no row is new, or if
/// the fit fails.
pub(super) fn identified(
    problem: &Problem,
    data: &Dataset,
    options: &Options,
    (source, corrections): (&PriorSource, Option<&EarlierCorrections>),
    days: f64,
) -> Result<Identified, PriorError> {
    if options.strategy != Strategy::Joint {
        let (file, found) = (source.file().to_owned(), options.strategy.as_str());
        return Err(PriorError::Strategy { file, found });
    }
    let placement = Placement::of(&data.measurements);
    let model = Model::new(problem, &placement.bases, &placement.targets)?;
    let original = match source {
        PriorSource::Estimate(estimate) => Earlier::of_estimate(estimate, problem, &model, days)?,
        PriorSource::Fleet(prior) => Earlier::of_fleet(prior, problem, &model, days)?,
    };
    let is_new = |row: &usize| !data.measurements.is_among(*row, &original.fitted_rows);
    let identification: Vec<usize> =
        data.split.identification.iter().copied().filter(is_new).collect();
    let held_out: Vec<usize> = data.split.held_out.iter().copied().filter(is_new).collect();
    let left_out = data.split.identification.len() - identification.len();
    if identification.is_empty() && left_out > 0 {
        return Err(PriorError::NothingNew { file: original.file, rows: left_out });
    }
    let left_out = left_out + data.split.held_out.len() - held_out.len();
    let split = Split { identification, held_out };
    let data = Dataset::new(data.measurements.clone(), split);
    let declared_problem = problem;
    let mut problem = problem.clone();
    if let Some(sigma) = original.sigma {
        let declared = problem.data.position_sigma.unwrap_or(0.0);
        problem.data.position_sigma = Some(sigma.max(declared));
    }
    let mut prior = original.clone();
    let names = || model.parameters.iter().map(|parameter| parameter.name.clone());
    let mut since = ChangedSince {
        variances: names().zip(drift::variances(declared_problem, &model, days)?).collect(),
        replaced: HashSet::new(),
        noise_ratio: 1.0,
    };
    let (mut causes, mut chi2) = (Vec::new(), None);
    loop {
        let options = options.clone().with_earlier(Arc::new(prior.data(&model)?));
        let mut found = fit::identify(&problem, &data, &options)?;
        let found_problem = (&found, &problem);
        let predicted = match corrections {
            Some(of) => of.predicted(found_problem, (&data, MAX_TESTED_ROWS), &since)?,
            None => None,
        };
        let (cause, now) = contradiction(
            (&problem, declared_problem.data.position_sigma),
            &model,
            (&data, &placement),
            (&found, predicted),
            (&prior, &causes),
        );
        chi2 = chi2.or(now);
        let is_new_cause = cause.as_ref().is_some_and(|cause: &Contradiction| {
            causes.iter().all(|earlier: &Contradiction| earlier.label != cause.label)
        });
        let is_noise = cause.as_ref().is_some_and(|cause| cause.noise_ratio.is_some());
        let cause = cause.filter(|_| is_new_cause && causes.len() < MAX_CAUSES);
        let Some(cause) = cause else {
            causes.extend(contradicting_bound(&model, &found, &original));
            let has_raised_sigma = causes.iter().any(|cause| cause.noise_ratio.is_some());
            if has_raised_sigma {
                let chi2 = chi2.map(|(chi2, coordinates, _)| (chi2, coordinates));
                contradiction::attribute_to_prior(&mut found.findings, source.file(), chi2);
            }
            let of = (source.file(), original.includes_fleet);
            found.findings.extend(contradiction::findings(&causes, of));
            found.fitted_rows.extend(original.fitted_rows.iter().cloned());
            found.fitted_rows.sort();
            found.fitted_rows.dedup();
            let labels = causes.into_iter().map(|cause| cause.label).collect();
            found.prior = Some(PriorComparison {
                days,
                left_out,
                variance_ratio: variance_ratio([declared_problem, &problem], &data),
                estimated_sigma: problem
                    .data
                    .position_sigma
                    .filter(|_| declared_problem.data.position_sigma.is_none()),
                chi2,
                causes: labels,
                has_raised_sigma,
                is_unexplained: is_noise,
                ..compare(&model, &found, (&original, &prior))
            });
            return Ok(Identified { found, data, since });
        };
        if let Some((placed, x)) = &cause.relocated {
            prior.replace(&placed.parameters, x, WIDE_SIGMA);
            let names = placed.parameters.iter().map(|&k| model.parameters[k].name.clone());
            since.replaced.extend(names);
        }
        for moved in &cause.widened {
            prior.widen(moved, WIDENING);
            for (parameter, size) in moved {
                let name = model.parameters[*parameter].name.clone();
                *since.variances.entry(name).or_insert(0.0) += (WIDENING * size).powi(2);
            }
        }
        if let Some(ratio) = cause.noise_ratio {
            since.noise_ratio *= ratio;
            problem.data.position_sigma = problem.data.position_sigma.map(|sigma| sigma * ratio);
        }
        causes.push(cause);
    }
}

/// Returns the mean noise variance of the measured positions that `problems[1]` assumes, divided by
/// that of `problems[0]`; 1 if `problems[0]` declares none.
fn variance_ratio(problems: [&Problem; 2], data: &Dataset) -> f64 {
    let rows = &data.split.identification;
    let variance = |problem: &Problem| -> Option<f64> {
        let sigma = |&row: &usize| data.measurements.sigma_of(row).or(problem.data.position_sigma);
        rows.iter().map(|row| Some(sigma(row)?.powi(2))).sum()
    };
    let [declared, taken] = problems.map(variance);
    declared.zip(taken).filter(|(declared, _)| *declared > 0.0).map_or(1.0, |(a, b)| b / a)
}

/// Returns the parameter at a bound that is furthest from the mean of the prior; `None` if none is
/// more than [`BOUND_SIGMAS`] away.
fn contradicting_bound(
    model: &Model,
    found: &Identification,
    prior: &Earlier,
) -> Option<Contradiction> {
    let sigmas = |(place, &k): (usize, &usize)| {
        found.estimates[k].at_bound?;
        let sigma = prior.covariance[(place, place)].sqrt();
        Some((k, ((found.x[k] - prior.mean[place]) / sigma).abs()))
    };
    let held = prior.indices.iter().enumerate().filter_map(sigmas);
    let (k, sigmas) = held.max_by(|a, b| a.1.total_cmp(&b.1))?;
    (sigmas > BOUND_SIGMAS).then(|| Contradiction {
        label: format!(
            "bound of {}, {sigmas:.1} σ from the earlier estimate",
            model.parameters[k].name
        ),
        probability: 1.0,
        widened: Vec::new(),
        relocated: None,
        is_held: false,
        is_part_held: false,
        instead: None,
        noise_ratio: None,
    })
}

/// Tests whether the identification rows contradict the prior. Returns the most probable cause if
/// they do, and χ² of the rows under the prior with its degrees of freedom and p-value; each is
/// `None` if a number is not finite. `declared_sigma` is the declared σ of a measured coordinate
/// \[m\]. The part of the fit's σ beyond it counts as known misfit.
fn contradiction(
    (problem, declared_sigma): (&Problem, Option<f64>),
    model: &Model,
    (data, placement): (&Dataset, &Placement),
    (found, predicted): (&Identification, Option<PredictedRows>),
    (prior, causes_before): (&Earlier, &[Contradiction]),
) -> (Option<Contradiction>, Option<(f64, f64, f64)>) {
    let mut x = found.x.clone();
    for (place, &k) in prior.indices.iter().enumerate() {
        x[k] = prior.mean[place];
    }
    let extended = Extended::new(problem, model, &x, [&placement.bases, &placement.targets]);
    let rows = &data.split.identification;
    let turn = problem.data.orientation_sigma.filter(|_| problem.data.fits_orientation);
    let poses = placement.oriented_poses(&data.measurements, rows, (found.sigma, turn));
    let mut sensitive = SensitiveRows::new(&extended.model, poses.clone(), &extended.x);
    let warmth = warmth(problem, &data.measurements, rows);
    let mut causes = extended.causes(problem, &mut sensitive, warmth.as_deref());
    // Something else has no parameters to widen, so the most probable of the other causes is taken.
    causes.retain(|cause| cause.kind != CauseKind::Other);
    let declared = declared_sigma.unwrap_or(found.sigma).min(found.sigma);
    let misfit = 1.0 - (declared / found.sigma).powi(2);
    let misfit = misfit * sensitive.coordinates.iter().sum::<usize>() as f64;
    let warmed = warmth.as_ref().map(|_| (&*causes, misfit));
    let uncertainty = factor(&covariance(&extended, prior, &sensitive, warmed));
    let assessed = assess(&sensitive, &uncertainty, &causes, false).and_then(|assessed| {
        paired(assessed, predicted.is_some(), (&sensitive, &uncertainty), &mut causes)
    });
    let Some(assessed) = assessed else { return (None, None) };
    let chi2 = chi2_of_rows(&assessed);
    let evidence = contradicting_evidence(&assessed);
    let mut moved = Vec::new();
    if let Some(evidence) = evidence {
        let is_before = |placed: &Placed| causes_before.iter().any(|of| of.label == placed.label);
        let placements = relocation::placements(model).into_iter();
        let of_place = |placed: Placed| {
            Some((placed.clone(), relocation::located_anew(model, &poses, &x, &placed)?))
        };
        moved = placements.filter(|placed| !is_before(placed)).filter_map(of_place).collect();
        let at_place = |located: &DVector<f64>| {
            let extended =
                Extended::new(problem, model, located, [&placement.bases, &placement.targets]);
            (SensitiveRows::new(&extended.model, poses.clone(), &extended.x), extended)
        };
        let relocated = moved.iter().filter_map(|(placed, located)| {
            let (rows, extended) = at_place(located);
            let mut prior = prior.clone();
            prior.replace(&placed.parameters, located, WIDE_SIGMA);
            let factor = factor(&self::covariance(&extended, &prior, &rows, None));
            let assessed = assess(&rows, &factor, &[], false)?;
            let gain = 0.5 * (chi2.0 - assessed.chi2) - MIN_RELOCATION_NATS;
            (gain > evidence).then(|| (gain, (placed.clone(), located.clone())))
        });
        if let Some((gain, place)) = relocated.max_by(|a, b| a.0.total_cmp(&b.0)) {
            let probability = (1.0 + (evidence - gain).exp()).recip();
            return (Some(Contradiction::of_place(place, probability)), Some(chi2));
        }
    }
    if let Some(predicted) = predicted {
        let at = (problem, model, &found.x);
        let test = tested(at, (&data.measurements, placement), predicted);
        let Some(test) = test else { return (None, None) };
        let location = |row: usize| data.measurements.location(test.places[row]).to_string();
        let cause = contradicting_evidence(&test.assessed).and_then(|_| {
            most_probable(&test.assessed, (&test.causes, location), (&test.extended, &test.rows))
        });
        // Rows that measure something else are tested without the remainder, together with all
        // others.
        let is_tested = |of: Observation| of.is_position() || of.is_point() || !of.is_of_arm();
        let are_all_tested =
            rows.iter().map(|row| data.measurements.observation(*row)).all(is_tested);
        if cause.is_some() || are_all_tested {
            let chi2 = chi2_of_rows(&test.assessed);
            return (cause.map(|cause| cause.with_place(&moved)), Some(chi2));
        }
    }
    let location = |row: usize| data.measurements.location(rows[row]).to_string();
    let cause = evidence
        .and_then(|_| most_probable(&assessed, (&causes, location), (&extended, &sensitive)));
    (cause.map(|cause| cause.with_place(&moved)), Some(chi2))
}

/// Returns ln of the likelihood ratio of a change to "unchanged" if it contradicts the earlier
/// estimate.
fn contradicting_evidence(assessed: &Assessment) -> Option<f64> {
    let (_, evidence) = *assessed.looks.last()?;
    (evidence > CONTRADICTION_RATIO.ln()).then_some(evidence.max(assessed.ln_sum))
}

/// Returns the assessment with pairs of causes, as `watch` tries them, if the rows contradict the
/// earlier estimate, and unchanged otherwise. If the earlier fit left a misfit that a remainder
/// corrects (`has_remainder`), a second cause would fit a part of it: a single change of the arm that
/// is the most probable cause is then fitted first, and the rows are tested again. `None` if a number
/// is not finite.
fn paired(
    assessed: Assessment,
    has_remainder: bool,
    (rows, factor): (&SensitiveRows, &DMatrix<f64>),
    causes: &mut Vec<Cause>,
) -> Option<Assessment> {
    let first = assessed.causes.first().map(|first| &causes[first.cause]);
    let is_of_arm = first.is_some_and(|cause| !cause.columns.is_empty());
    if has_remainder && is_of_arm || contradicting_evidence(&assessed).is_none() {
        return Some(assessed);
    }
    with_pairs(assessed, rows, factor, causes)
}

/// Returns χ² of all rows under "unchanged", its degrees of freedom and its p-value.
fn chi2_of_rows(assessed: &Assessment) -> (f64, f64, f64) {
    let p_value = ChiSquared::new(assessed.coordinates)
        .map_or(f64::NAN, |distribution| distribution.sf(assessed.chi2));
    (assessed.chi2, assessed.coordinates, p_value)
}

/// Returns the prior covariance of the deviations of all columns: that of the earlier estimate, the
/// declared priors of parameters that it lacks, and 0 for added columns.
///
/// Columns of thermal causes have a variance if the earlier fit left a misfit. `warmed` holds the
/// causes and the sum of the squared misfits in units of the noise, if the rows state temperatures.
/// A thermal effect that the earlier fit lacked may have caused all its misfit, and is no change.
pub(super) fn covariance(
    extended: &Extended,
    prior: &Earlier,
    rows: &SensitiveRows,
    warmed: Option<(&[Cause], f64)>,
) -> DMatrix<f64> {
    let columns = rows.sensitivity.ncols();
    let mut covariance = DMatrix::zeros(columns, columns);
    for (i, &k) in prior.indices.iter().enumerate() {
        for (j, &l) in prior.indices.iter().enumerate() {
            covariance[(k, l)] = prior.covariance[(i, j)];
        }
    }
    for k in (0..extended.declared).filter(|&k| prior.place_of(k).is_none()) {
        let parameter = &extended.model.parameters[k];
        let is_wide = matches!(parameter.unit(), Unit::Length | Unit::Angle)
            || parameter.unit().is_relative();
        let wide = if is_wide { WIDE_SIGMA } else { 0.0 };
        covariance[(k, k)] = parameter.sigma.unwrap_or(wide).powi(2);
    }
    let (causes, misfit) = warmed.unwrap_or_default();
    for cause in causes.iter().filter(|cause| cause.kind == CauseKind::Temperature) {
        for &k in &cause.columns {
            let squares = rows.sensitivity.column(k).norm_squared();
            covariance[(k, k)] = if squares > 0.0 { misfit / squares } else { 0.0 };
        }
    }
    covariance
}

/// Compares the posterior of a fit with the prior `original`; `widened` is the prior as it was
/// widened for the fit. The other entries of the comparison are those of a fit without time, causes
/// and rows that are left out.
fn compare(
    model: &Model,
    found: &Identification,
    (original, widened): (&Earlier, &Earlier),
) -> PriorComparison {
    let variance = |k: usize| found.covariance.entry(k, k).filter(|variance: &f64| *variance > 0.0);
    let compared = |(place, &k): (usize, &usize)| {
        let (parameter, estimate) = (&model.parameters[k], &found.estimates[k]);
        let slope = parameter.value_error(found.x[k], 1.0).abs();
        let posterior = variance(k).map(|variance| variance / slope.powi(2));
        let (mean, prior) = (original.mean[place], original.covariance[(place, place)]);
        let fitted = widened.covariance[(place, place)];
        // The information of the new rows is that of the posterior minus that of the widened prior.
        let data = posterior.and_then(|posterior| {
            let learned = posterior.recip() - fitted.recip();
            let value = (found.x[k] / posterior - widened.mean[place] / fitted) / learned;
            (learned * fitted > MIN_LEARNED).then(|| (value, learned.recip()))
        });
        let value = |x: f64, variance: f64| {
            (parameter.value(x), parameter.value_error(x, variance.sqrt()).abs())
        };
        ComparedParameter {
            name: estimate.name.clone(),
            unit: estimate.unit,
            prior: value(mean, prior),
            data: data.map(|(x, variance)| value(x, variance)),
            posterior: (estimate.estimate, variance(k).map(f64::sqrt)),
            difference: data.map(|(x, variance)| (x - mean) / (variance + prior).sqrt()),
        }
    };
    PriorComparison {
        file: original.file.clone(),
        days: 0.0,
        left_out: 0,
        sigma: original.sigma,
        variance_ratio: 1.0,
        estimated_sigma: None,
        includes_fleet: original.includes_fleet,
        chi2: None,
        causes: Vec::new(),
        has_raised_sigma: false,
        is_unexplained: false,
        parameters: original.indices.iter().enumerate().map(compared).collect(),
    }
}

/// Maximum number of rows that are tested, evenly spaced among the new ones.
pub(super) const MAX_TESTED_ROWS: usize = 80;
/// Number of coordinates of a position.
const AXES: usize = 3;
/// Fraction of the noise variance that is added to the covariance of predictions, so that it is
/// positive definite despite rounding.
const JITTER: f64 = 1e-9;

/// Result of the test, with what its causes refer to.
struct CorrectedTest {
    pub assessed: Assessment,
    pub causes: Vec<Cause>,
    pub extended: Extended,
    pub rows: SensitiveRows,
    /// Indices of the tested rows in their table.
    pub places: Vec<usize>,
}

/// Tests rows that an earlier estimate predicted with its remainder, for changes about the full
/// parameter vector `x`. Returns `None` if a number is not finite.
///
/// Each coordinate has an error of its prediction, with the covariance of parameters and remainder
/// together, and noise. Without the misfit that the remainder corrects, the rows show changes that
/// the parameters alone would hide.
fn tested(
    (problem, model, x): (&Problem, &Model, &DVector<f64>),
    (table, placement): (&Measurements, &Placement),
    predicted: PredictedRows,
) -> Option<CorrectedTest> {
    let PredictedRows { rows: places, residual, covariance, sigma } = predicted;
    let extended = Extended::new(problem, model, x, [&placement.bases, &placement.targets]);
    let turn = problem.data.orientation_sigma.filter(|_| problem.data.fits_orientation);
    let poses: Vec<Pose> = placement.oriented_poses(table, &places, (1.0, turn));
    let poses = poses.into_iter().zip(&sigma).map(|(pose, &sigma)| Pose { sigma, ..pose });
    let mut rows = SensitiveRows::new(&extended.model, poses.collect(), &extended.x);
    rows.residual.fill(0.0);
    for (k, value) in residual.iter().enumerate() {
        rows.residual[rows.stride * (k / AXES) + k % AXES] = value / sigma[k / AXES];
    }
    let warmth = warmth(problem, table, &places);
    let mut causes = extended.causes(problem, &mut rows, warmth.as_deref());
    causes.retain(|cause| cause.kind != CauseKind::Other);
    let first = rows.add_error_columns(AXES);
    let mut whitened = DMatrix::from_fn(residual.len(), residual.len(), |i, j| {
        covariance[(i, j)] / (sigma[i / AXES] * sigma[j / AXES])
    });
    (0..residual.len()).for_each(|k| whitened[(k, k)] += JITTER);
    let lower = lower_factor(whitened)?;
    let mut factor = DMatrix::zeros(rows.sensitivity.ncols(), residual.len());
    factor.rows_mut(first, residual.len()).copy_from(&lower);
    let assessed = assess(&rows, &factor, &causes, false)?;
    let assessed = paired(assessed, true, (&rows, &factor), &mut causes)?;
    Some(CorrectedTest { assessed, causes, extended, rows, places })
}
