//! Forecast of the results of measurements in given poses.
//!
//! Rank, unidentifiable combinations and predictions are linear about the nominal arm. Standard
//! errors are expected values over arms drawn from the priors.

use super::coordinates::{coordinates, first_rows};
use super::plan::choose;
use super::{DesignError, Extremes, Forecast, Growth, Prediction, Sensitivity, Site};
use crate::error::InputErrorKind;
use crate::fit::Placement;
use crate::measurement::{Dataset, Labels, Measurements, RowOrder, count_distinct};
use crate::observation::Needs;
use crate::problem::{Observation, PoseRanges, Problem};
use crate::select::{Detection, detectable};

/// Number of poses drawn from ranges at which predictions are evaluated.
const PREDICTION_POSES: usize = 500;
/// Number of poses in the series that shows the benefit of additional poses, if they are drawn.
const SERIES_LENGTH: usize = 384;
/// Smallest and largest number of arms that are drawn from the priors of the parameters.
const ARMS: (usize, usize) = (16, 200);
/// Wanted number of arms × poses, from which the number of arms follows within [`ARMS`].
const ARM_POSES: usize = 20_000;
/// Random stream of the drawn poses.
const POSE_STREAM: u64 = 0;
/// Random stream of the poses at which predictions are evaluated.
const PREDICTION_STREAM: u64 = 10;
/// Random stream of the order in which rows of a table form a series.
const ORDER_STREAM: u64 = 11;
/// Random stream of the drawn arms.
const ARM_STREAM: u64 = 12;

/// Poses whose results are forecast.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum CheckedPoses {
    /// Number of poses drawn uniformly from ranges.
    Drawn(PoseRanges, usize),
    /// Rows of a table. Predictions are evaluated within ranges, at held-out rows, or at the rows
    /// themselves.
    Table {
        /// Poses of the table.
        poses: Box<Measurements>,
        /// Ranges in which predictions are evaluated.
        within: Option<PoseRanges>,
        /// Held-out rows, at which predictions are evaluated if no ranges are known.
        held_out: Option<Box<Measurements>>,
    },
}

/// Poses at which predictions are evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum PredictionPoses {
    /// Poses drawn uniformly from the ranges.
    Ranges,
    /// Held-out rows of the table whose other rows are checked.
    HeldOut,
    /// The checked poses themselves.
    Same,
}

/// Forecast of the results of measurements in some poses.
#[derive(Debug, Clone)]
pub struct Check {
    /// Expected errors and identifiability of the parameters, averaged over arms drawn from the
    /// priors.
    pub forecast: Forecast,
    /// Expected error of positions that the identified arm predicts, linear about the nominal arm.
    pub prediction: Prediction,
    /// Poses at which the prediction is evaluated.
    pub(crate) predicted_at: PredictionPoses,
    /// Root mean square length of the error of one measured position \[m\]; `None` if no length is
    /// measured.
    pub noise: Option<f64>,
    /// Kind of measurement that has this noise: the first kind in the table that is a length
    /// ([`Observation::kind`]).
    pub noise_of: &'static str,
    /// Forecasts for the first n poses of a series: of the checked poses and more of the same
    /// ranges, or of the table's rows in random order.
    pub(crate) growth: Growth,
    /// Effects of the catalogue that the poses would show, with their smallest detectable sizes.
    pub(crate) detection: Detection,
    /// Number of coordinates that the checked poses measure.
    pub coordinates: usize,
    /// Number of coordinates that the checked poses measure, counting each distinct pose once.
    pub distinct_coordinates: usize,
    /// Number of different poses of the arm in the checked rows.
    pub distinct_poses: usize,
    /// Noun for a checked row: "point" if rows are points in images, else "pose".
    pub(crate) row_noun: &'static str,
    /// Number of free parameters without a prior.
    pub without_prior: usize,
    /// Statement that the checked poses leave the scale open, with a remedy; `None` if they
    /// determine it.
    pub open_scale: Option<String>,
}

/// Forecasts the results of measurements in the poses `checked`; `seed` determines all draws.
///
/// # Errors
/// Returns an error if the problem lacks a declaration, or if the nominal arm has no equilibrium in
/// a pose of a table.
pub fn check(problem: &Problem, checked: &CheckedPoses, seed: u64) -> Result<Check, DesignError> {
    let draw = |ranges: &PoseRanges, count, stream| {
        ranges.draw(problem, count, Extremes::No, seed, stream)
    };
    let (series, count, prediction_table, predicted_at) = match checked {
        CheckedPoses::Drawn(ranges, count) => {
            let series = draw(ranges, SERIES_LENGTH.max(2 * count), POSE_STREAM);
            let predictions = draw(ranges, PREDICTION_POSES, PREDICTION_STREAM);
            (series, *count, predictions, PredictionPoses::Ranges)
        }
        CheckedPoses::Table { poses, within, held_out } => {
            let series = poses.select(&choose(poses.len(), poses.len(), seed, ORDER_STREAM));
            let (predictions, predicted_at) = match (within, held_out) {
                (Some(ranges), _) => {
                    (draw(ranges, PREDICTION_POSES, PREDICTION_STREAM), PredictionPoses::Ranges)
                }
                (None, Some(rows)) => (rows.as_ref().clone(), PredictionPoses::HeldOut),
                (None, None) => (poses.as_ref().clone(), PredictionPoses::Same),
            };
            (series, poses.len(), predictions, predicted_at)
        }
    };
    if count == 0 {
        return Err(DesignError::NoPoses);
    }
    let site = Site::new(problem, &[&series])?;
    let parameters = &site.model.parameters;
    let (series, sensitivity) = match checked {
        CheckedPoses::Drawn(..) => site.in_equilibrium(&series),
        CheckedPoses::Table { .. } => {
            let sensitivity = site.sensitivity(&series, None);
            if let Some(row) = (0..sensitivity.len()).find(|&row| !sensitivity.is_finite(row)) {
                let error = series.location(row).error(InputErrorKind::NoEquilibrium);
                return Err(problem
                    .with_cause_of_overload(error, series.largest_payload(problem))
                    .into());
            }
            (series, sensitivity)
        }
    };
    if sensitivity.len() < count {
        return Err(DesignError::NoEquilibrium);
    }
    let attainable = match checked {
        CheckedPoses::Table { poses, within: Some(ranges), .. } => {
            let drawn = measured_as(poses, draw(ranges, SERIES_LENGTH, POSE_STREAM));
            Some(site.in_equilibrium(&drawn).1)
        }
        _ => None,
    };
    let poses = series.select(&(0..count).collect::<Vec<_>>());
    // Predictions are of positions, whatever is measured.
    let prediction_table = Measurements { observations: Vec::new(), ..prediction_table };
    let workspace = finite(&site.sensitivity(&prediction_table, Some(1.0)));
    let lengths = series.kinds().into_iter().find(|kind| kind.measures_length());
    let noise = lengths.map(|kind| noise(problem, &series, kind));
    let forecast = Forecast::new(parameters, &sensitivity.select(&(0..count).collect::<Vec<_>>()));
    let arms = site.arms(&poses, (ARM_POSES / count).clamp(ARMS.0, ARMS.1), (seed, ARM_STREAM));
    Ok(Check {
        prediction: forecast.prediction(&workspace),
        forecast: forecast.over(parameters, &arms),
        predicted_at,
        noise,
        noise_of: lengths.unwrap_or_default().kind(),
        detection: detectable(problem, &poses)?,
        growth: Growth::new(
            parameters,
            &sensitivity,
            attainable.as_ref(),
            &workspace,
            (noise.unwrap_or(0.0), count),
        ),
        coordinates: coordinates(&poses, sensitivity.coordinates, 0..count),
        distinct_coordinates: coordinates(
            &poses,
            sensitivity.coordinates,
            first_rows(&poses.pose_numbers(problem)),
        ),
        row_noun: if poses.leading().description().needs == Needs::Carriers {
            "point"
        } else {
            "pose"
        },
        distinct_poses: count_distinct(&poses.arm_pose_numbers(problem), 0..count),
        without_prior: parameters.iter().filter(|parameter| parameter.sigma.is_none()).count(),
        open_scale: {
            let names: Vec<&str> = parameters.iter().map(|parameter| &*parameter.name).collect();
            crate::fit::open_scale(problem, &poses, &names)
        },
    })
}

/// Assigns sessions and targets to drawn poses, in the proportions of a table.
fn measured_as(table: &Measurements, drawn: Measurements) -> Measurements {
    let spread = |words: &Labels| Labels {
        names: words.names.clone(),
        of_row: (0..drawn.len()).map(|row| words.of_row[row % table.len()]).collect(),
    };
    Measurements {
        session: spread(&table.session),
        target: table.target.as_ref().map(spread),
        order: RowOrder::default(),
        ..drawn
    }
}

impl Check {
    /// Returns true if the poses determine all combinations of parameters that more poses of the
    /// same kind would determine. They must also measure at least as many coordinates as there are
    /// parameters without a prior.
    pub fn suffices(&self) -> bool {
        self.forecast.undetermined <= self.growth.undetermined
            && self.distinct_coordinates >= self.without_prior
    }
}

/// Returns `count` random rows of a table, all if it has fewer; the seed determines the choice.
pub fn random_rows(table: &Measurements, count: usize, seed: u64) -> Measurements {
    table.select(&choose(table.len(), count, seed, ORDER_STREAM))
}

/// Returns the held-out rows whose session and target also occur in identification rows, so that
/// predictions can be evaluated there.
pub fn predictable_rows(data: &Dataset) -> Vec<usize> {
    let Dataset { measurements, split } = data;
    let placement = Placement::of(measurements);
    let is_used = |of: fn(&Placement, usize) -> usize, row: usize| {
        split.identification.iter().any(|&other| of(&placement, other) == of(&placement, row))
    };
    let is_predictable =
        |&row: &usize| is_used(Placement::base_of, row) && is_used(Placement::target_of, row);
    split.held_out.iter().copied().filter(is_predictable).collect()
}

/// Returns the sensitivity without the poses that have no equilibrium.
fn finite(sensitivity: &Sensitivity) -> Sensitivity {
    let rows = (0..sensitivity.len()).filter(|&row| sensitivity.is_finite(row));
    sensitivity.select(&rows.collect::<Vec<_>>())
}

/// Returns √3 σ \[m\], the root mean square length of a position error. σ² is the mean over the
/// rows of the kind of `kind`, or the declared value if the table has no column of σ.
fn noise(problem: &Problem, table: &Measurements, kind: Observation) -> f64 {
    let declared = problem.sigma_of(kind).unwrap_or(1.0);
    let is_of_kind = |row: &usize| table.observation(*row).kind() == kind.kind();
    let squares = match &table.sigma {
        Some(sigmas) => {
            let rows = (0..sigmas.len()).filter(is_of_kind);
            let squares: Vec<f64> = rows.map(|row| sigmas[row] * sigmas[row]).collect();
            squares.iter().sum::<f64>() / squares.len().max(1) as f64
        }
        None => declared * declared,
    };
    (3.0 * squares).sqrt()
}
