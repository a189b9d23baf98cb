//! Benefit of additional poses of the same kind.

use super::{Forecast, Prediction, Sensitivity};
use crate::model::parameter::Parameter;
use crate::numeric::parallel;

/// Numbers of poses at which the series is evaluated.
const POSE_COUNTS: [usize; 14] = [4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256, 384];

/// Forecasts for the first n poses of a series, for increasing n.
#[derive(Debug, Clone)]
pub struct Growth {
    /// Forecasts in ascending order of the number of poses.
    pub steps: Vec<GrowthStep>,
    /// Number of combinations of parameters that more poses can determine without priors.
    pub attainable_rank: usize,
    /// Number of combinations that even all these poses and the priors leave undetermined.
    pub undetermined: usize,
    /// Smallest number of poses that determine all attainable combinations, and for which the rms
    /// error of predictions is at most that of one measurement. `None` if the series is too short.
    pub enough: Option<usize>,
}

/// Forecast for n poses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GrowthStep {
    /// Number n of poses for which this forecast holds.
    pub poses: usize,
    /// Number of combinations that the poses determine without priors.
    pub rank: usize,
    /// Number of combinations that neither poses nor priors determine.
    pub undetermined: usize,
    /// Number of parameters of the arm that are identified to 90 % or more.
    pub well_identified: usize,
    /// Expected error of predicted positions after n poses.
    pub prediction: Prediction,
}

impl Growth {
    /// Forecasts the first n poses of `series`, for increasing n.
    ///
    /// Predictions are evaluated at the poses whose sensitivity for σ = 1 m is `workspace`. `noise`
    /// is the root mean square length of the error of one measured position \[m\], `extra` an
    /// additional number of poses to evaluate. The attainable combinations are those that the
    /// series and the poses `elsewhere` determine together.
    pub fn new(
        parameters: &[Parameter],
        series: &Sensitivity,
        elsewhere: Option<&Sensitivity>,
        workspace: &Sensitivity,
        (noise, extra): (f64, usize),
    ) -> Self {
        let step = |poses: usize| {
            let forecast =
                Forecast::new(parameters, &series.select(&(0..poses).collect::<Vec<_>>()));
            GrowthStep {
                poses,
                rank: forecast.identifiability.rank,
                undetermined: forecast.undetermined,
                well_identified: forecast.well_identified(),
                prediction: forecast.prediction(workspace),
            }
        };
        let mut counts: Vec<usize> =
            POSE_COUNTS.into_iter().filter(|&poses| poses < series.len()).collect();
        counts.extend([extra.min(series.len()), series.len()]);
        counts.sort_unstable();
        counts.dedup();
        let steps = parallel::map(counts.len(), |k| step(counts[k]));
        let (attainable_rank, undetermined) = match elsewhere {
            Some(elsewhere) => {
                let forecast = Forecast::new(parameters, &series.and(elsewhere));
                (forecast.identifiability.rank, forecast.undetermined)
            }
            None => steps.last().map_or((0, 0), |last| (last.rank, last.undetermined)),
        };
        let suffices = |step: &GrowthStep| {
            step.rank == attainable_rank
                && step.undetermined == undetermined
                && step.prediction.rms <= noise
        };
        // More poses never inform less, so the smallest sufficient number can be bracketed.
        let enough = steps.iter().position(suffices).map(|first| {
            let (mut few, mut many) =
                (if first == 0 { 0 } else { steps[first - 1].poses }, steps[first].poses);
            while many - few > 1 {
                let middle = few.midpoint(many);
                if suffices(&step(middle)) { many = middle } else { few = middle }
            }
            many
        });
        Self { steps, attainable_rank, undetermined, enough }
    }
}
