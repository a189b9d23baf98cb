//! What measurements in given poses will tell, before anyone makes them.
//!
//! Rank, unidentifiable combinations and predictions are linear about the nominal arm; standard
//! errors are those to expect of arms drawn from the priors.

use super::coordinates::{coordinates, first_of_each};
use super::plan::choose;
use super::{DesignError, Extremes, Forecast, Growth, Prediction, Sensitivity, Site};
use crate::error::InputErrorKind;
use crate::fit::Placement;
use crate::measurement::{Dataset, Labels, Measurements, RowOrder, count_distinct};
use crate::problem::{Observation, PoseRanges, Problem};
use crate::select::{Detection, detectable};

/// Poses in which predictions are judged.
const WORKSPACE: usize = 500;
/// Length of the series that shows what more poses would bring.
const SERIES: usize = 384;
/// Arms drawn from the priors, least and most; as many poses together as these, if that lies
/// between.
const ARMS: (usize, usize) = (16, 200);
const ARM_POSES: usize = 20_000;
/// Streams of random numbers of one seed.
const POSES: u64 = 0;
const ELSEWHERE: u64 = 10;
const ORDER: u64 = 11;
const ARM: u64 = 12;

/// Which poses are to be judged.
#[derive(Debug, Clone)]
#[non_exhaustive]
pub enum Judged {
    /// So many, drawn evenly within ranges.
    Drawn(PoseRanges, usize),
    /// Rows of a table. Predictions are judged elsewhere: within ranges, in rows held out, or in
    /// the rows themselves.
    Table {
        /// The poses.
        poses: Box<Measurements>,
        /// Ranges in which predictions count.
        within: Option<PoseRanges>,
        /// Rows in which predictions count, where no ranges are known.
        held_out: Option<Box<Measurements>>,
    },
}

/// Where predictions are judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Elsewhere {
    /// In poses drawn evenly within the ranges.
    Ranges,
    /// In the rows held out.
    HeldOut,
    /// In the poses themselves.
    Same,
}

/// What measurements in some poses will tell.
#[derive(Debug, Clone)]
pub struct Check {
    /// Of these poses.
    pub forecast: Forecast,
    /// Error of the arm identified from them, elsewhere.
    pub prediction: Prediction,
    /// Where that is.
    pub elsewhere: Elsewhere,
    /// Root mean square length of the error of one position measured with the σ of these poses
    /// \[m\]; `None` where they measure tilts alone.
    pub noise: Option<f64>,
    /// What that σ is of: the first kind of what is measured that is a length
    /// ([`Observation::kind`]).
    pub noise_of: &'static str,
    /// Of the first n of a series of such poses.
    pub growth: Growth,
    /// Which effects of the catalogue they would show, and from what size on.
    pub detection: Detection,
    /// Measured coordinates.
    pub coordinates: usize,
    /// The same of poses that differ from each other.
    pub distinct: usize,
    /// How many of the poses differ from each other.
    pub different: usize,
    /// Free parameters without a prior.
    pub without_prior: usize,
}

/// Judges poses.
///
/// # Errors
/// The problem does not say enough, or the nominal arm does not come to rest in one of the poses of
/// a table.
pub fn check(problem: &Problem, judged: &Judged, seed: u64) -> Result<Check, DesignError> {
    let draw = |ranges: &PoseRanges, count, stream| {
        ranges.draw(problem, count, Extremes::No, seed, stream)
    };
    let (series, count, workspace, elsewhere) = match judged {
        Judged::Drawn(ranges, count) => {
            let series = draw(ranges, SERIES.max(2 * count), POSES);
            (series, *count, draw(ranges, WORKSPACE, ELSEWHERE), Elsewhere::Ranges)
        }
        Judged::Table { poses, within, held_out } => {
            let series = poses.select(&choose(poses.len(), poses.len(), seed, ORDER));
            let (workspace, elsewhere) = match (within, held_out) {
                (Some(ranges), _) => (draw(ranges, WORKSPACE, ELSEWHERE), Elsewhere::Ranges),
                (None, Some(rows)) => (rows.as_ref().clone(), Elsewhere::HeldOut),
                (None, None) => (poses.as_ref().clone(), Elsewhere::Same),
            };
            (series, poses.len(), workspace, elsewhere)
        }
    };
    if count == 0 {
        return Err(DesignError::NoPoses);
    }
    let site = Site::new(problem, &[&series])?;
    let parameters = &site.model.parameters;
    let (series, told) = match judged {
        Judged::Drawn(..) => site.at_rest(&series),
        Judged::Table { .. } => {
            let all = site.sensitivity(&series, None);
            if let Some(row) = (0..all.len()).find(|&row| !all.is_finite(row)) {
                return Err(series.location(row).error(InputErrorKind::NoEquilibrium).into());
            }
            (series, all)
        }
    };
    if told.len() < count {
        return Err(DesignError::NoEquilibrium);
    }
    let attainable = match judged {
        Judged::Table { poses, within: Some(ranges), .. } => {
            let drawn = measured_as(poses, draw(ranges, SERIES, POSES));
            Some(site.at_rest(&drawn).1)
        }
        _ => None,
    };
    let poses = series.select(&(0..count).collect::<Vec<_>>());
    // Predictions are of positions, whatever is measured.
    let workspace = Measurements { observations: Vec::new(), ..workspace };
    let workspace = finite(&site.sensitivity(&workspace, Some(1.0)));
    let lengths = series.kinds().into_iter().find(|kind| kind.is_of_arm() && !kind.is_angle());
    let noise = lengths.map(|kind| noise(problem, &series, kind));
    let forecast = Forecast::new(parameters, &told.select(&(0..count).collect::<Vec<_>>()));
    let arms = site.arms(&poses, (ARM_POSES / count).clamp(ARMS.0, ARMS.1), (seed, ARM));
    Ok(Check {
        prediction: forecast.prediction(&workspace),
        forecast: forecast.over(parameters, &arms),
        elsewhere,
        noise,
        noise_of: lengths.unwrap_or_default().kind(),
        detection: detectable(problem, &poses)?,
        growth: Growth::new(
            parameters,
            &told,
            attainable.as_ref(),
            &workspace,
            (noise.unwrap_or(0.0), count),
        ),
        coordinates: coordinates(&poses, told.coordinates, 0..count),
        distinct: coordinates(
            &poses,
            told.coordinates,
            first_of_each(&poses.pose_numbers(problem)),
        ),
        different: count_distinct(&poses.pose_numbers(problem), 0..count),
        without_prior: parameters.iter().filter(|parameter| parameter.sigma.is_none()).count(),
    })
}

/// Poses that are drawn, with sessions and targets as often as a table has them.
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
    /// Whether the poses decide every parameter as far as poses of their kind can, and measure as
    /// many coordinates as parameters have no prior.
    pub fn suffices(&self) -> bool {
        self.forecast.open <= self.growth.open && self.distinct >= self.without_prior
    }
}

/// `count` rows of a table, drawn at random; the same for the same seed.
pub fn some_of(table: &Measurements, count: usize, seed: u64) -> Measurements {
    table.select(&choose(table.len(), count, seed, ORDER))
}

/// The held-out rows of sessions and targets that identification rows use as well: those in which
/// predictions can be judged.
pub fn with_known_words(data: &Dataset) -> Vec<usize> {
    let Dataset { measurements, split } = data;
    let placement = Placement::of(measurements);
    let known = |of: fn(&Placement, usize) -> usize, row: usize| {
        split.identification.iter().any(|&own| of(&placement, own) == of(&placement, row))
    };
    let judges = |&row: &usize| known(Placement::base_of, row) && known(Placement::target_of, row);
    split.held_out.iter().copied().filter(judges).collect()
}

fn finite(all: &Sensitivity) -> Sensitivity {
    all.select(&(0..all.len()).filter(|&row| all.is_finite(row)).collect::<Vec<_>>())
}

/// √3 σ, of the mean σ² of the rows of a kind.
fn noise(problem: &Problem, table: &Measurements, kind: Observation) -> f64 {
    let declared = problem.data.sigma_of(kind).unwrap_or(1.0);
    let own = |row: &usize| table.observation(*row).kind() == kind.kind();
    let squares = match &table.sigma {
        Some(sigmas) => {
            let own: Vec<f64> =
                (0..sigmas.len()).filter(own).map(|row| sigmas[row] * sigmas[row]).collect();
            own.iter().sum::<f64>() / own.len().max(1) as f64
        }
        None => declared * declared,
    };
    (3.0 * squares).sqrt()
}
