//! What more poses of the same kind would bring.

use rayon::prelude::*;

use super::{Forecast, Prediction, Sensitivity};
use crate::model::parameter::Parameter;

/// Numbers of poses that are looked at.
const LADDER: [usize; 14] = [4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384];

/// What the first n poses of a series tell, for growing n.
#[derive(Debug, Clone)]
pub struct Growth {
    /// In ascending order of poses.
    pub steps: Vec<GrowthStep>,
    /// Combinations that are to be seen, priors left out.
    pub attainable_rank: usize,
    /// Combinations that stay open when all that can be seen is.
    pub open: usize,
    /// The least number of poses that see all of that and predict positions as exactly as one is
    /// measured (rms); `None` where the series is too short.
    pub enough: Option<usize>,
}

/// What n poses tell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrowthStep {
    /// n.
    pub poses: usize,
    /// Combinations that they see, priors left out.
    pub rank: usize,
    /// Combinations that neither they nor priors see.
    pub open: usize,
    /// How many of the arm's parameters they identify to 90 % or more.
    pub well_identified: usize,
    /// Error of the identified arm elsewhere.
    pub prediction: Prediction,
}

impl Growth {
    /// Of the poses of `series` in their order, with predictions judged in the poses `workspace`
    /// (in metres); `noise` is the root mean square length of the error of one measured position
    /// \[m\], and `also` a number to look at besides. What can be seen is what the series and the
    /// poses `elsewhere` see together.
    pub fn new(
        parameters: &[Parameter],
        series: &Sensitivity,
        elsewhere: Option<&Sensitivity>,
        workspace: &Sensitivity,
        (noise, also): (f64, usize),
    ) -> Self {
        let step = |poses: usize| {
            let forecast =
                Forecast::new(parameters, &series.select(&(0..poses).collect::<Vec<_>>()));
            GrowthStep {
                poses,
                rank: forecast.identifiability.rank,
                open: forecast.open,
                well_identified: forecast.well_identified(),
                prediction: forecast.prediction(workspace),
            }
        };
        let mut ladder: Vec<usize> =
            LADDER.into_iter().filter(|&poses| poses < series.len()).collect();
        ladder.extend([also.min(series.len()), series.len()]);
        ladder.sort_unstable();
        ladder.dedup();
        let steps: Vec<GrowthStep> = ladder.into_par_iter().map(step).collect();
        let (attainable_rank, open) = match elsewhere {
            Some(elsewhere) => {
                let all = Forecast::new(parameters, &series.and(elsewhere));
                (all.identifiability.rank, all.open)
            }
            None => steps.last().map_or((0, 0), |last| (last.rank, last.open)),
        };
        let suffices = |step: &GrowthStep| {
            step.rank == attainable_rank && step.open == open && step.prediction.rms <= noise
        };
        // More poses never tell less, so that the least number can be bracketed.
        let enough = steps.iter().position(suffices).map(|first| {
            let (mut few, mut many) =
                (if first == 0 { 0 } else { steps[first - 1].poses }, steps[first].poses);
            while many - few > 1 {
                let middle = few.midpoint(many);
                if suffices(&step(middle)) { many = middle } else { few = middle }
            }
            many
        });
        Self { steps, attainable_rank, open, enough }
    }
}
