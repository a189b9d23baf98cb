//! Result of the command `next`: next.json.

use schemars::JsonSchema;
use serde::Serialize;

use super::effect::EffectKeys;
use crate::design::{self, NextOptions, NextPoses, Purpose, StopReason};
use crate::problem::{Effect, Problem};

/// Next poses to measure, with the error over the workspace now and after each of them.
#[derive(Debug, Serialize, JsonSchema)]
pub struct NextResult {
    pub problem: String,
    /// Aim of the poses: `accuracy`, `causes` or `both`.
    #[serde(rename = "for")]
    pub purpose: &'static str,
    pub seed: u64,
    /// True if no check contradicts the fit to the measured rows. If false, `stop` is neither
    /// `enough` nor `gain-below-noise`.
    pub trusted: bool,
    /// Number of rows that are measured and fitted.
    pub measured: usize,
    pub candidates: usize,
    /// Number of poses drawn to find candidates that cameras see; null if cameras do not measure,
    /// or if the candidates are rows of a table.
    pub drawn: Option<usize>,
    /// Number of poses over which predictions are judged.
    pub workspace_poses: usize,
    /// 1 σ of the noise of one coordinate; null if cameras measure.
    pub noise_mm: f64,
    /// Root mean square misfit of the model along each axis, which the choice of poses takes into
    /// account; null if cameras measure.
    pub misfit_mm: f64,
    /// Probability with which an error in the workspace stays below the bound.
    pub level: f64,
    pub tolerance_mm: Option<f64>,
    /// Error over the workspace; null with fewer than ten measured configurations, or fewer measured
    /// coordinates than fitted parameters.
    pub now: Option<WorkspaceError>,
    /// Expected error over the workspace after arbitrarily many additional poses; null if it is
    /// unknown.
    pub attainable_mm: Option<f64>,
    /// True if no number of poses can be expected to bring the error bound within the tolerance.
    pub out_of_reach: bool,
    /// Reason for which fewer poses are named than requested: `enough`, `gain-below-noise`,
    /// `no-candidates` or `causes-alike`; null if there is none.
    pub stop: Option<&'static str>,
    /// Number of these poses after which the bound is expected to be within the tolerance; null if
    /// there are too few, or without a tolerance.
    pub enough_after: Option<usize>,
    /// Effects that the poses are to distinguish.
    #[schemars(with = "Vec<EffectKeys>")]
    pub effects: Vec<Effect>,
    /// Poses in the order of next.csv.
    pub poses: Vec<NextStep>,
}

/// Error measured − predicted over the workspace.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct WorkspaceError {
    /// Root mean square of the error length, measurement noise included.
    pub expected_mm: f64,
    pub expected_sigma_mm: f64,
    /// Length that an error in the workspace does not exceed with the probability `level`.
    pub bound_mm: f64,
}

/// One pose to measure.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub struct NextStep {
    /// Largest move of a joint from the previous pose, as a share of the joint's range, 0 to 1.
    pub travel: f64,
    /// Decrease of the design criterion by this pose, as a share of its value before the first of
    /// these poses.
    pub gain: f64,
    /// Expected error over the workspace after this pose; null if `now` is.
    pub after: Option<WorkspaceError>,
}

impl NextResult {
    /// Collects the result of a choice of poses.
    pub fn new(problem: &Problem, options: &NextOptions, next: &NextPoses) -> Self {
        let error = |error: design::WorkspaceError| WorkspaceError {
            expected_mm: error.expected * 1e3,
            expected_sigma_mm: error.expected_sigma * 1e3,
            bound_mm: error.bound * 1e3,
        };
        let step = |step: &design::NextStep| NextStep {
            travel: step.travel,
            gain: step.gain,
            after: step.error.map(error),
        };
        Self {
            problem: problem.name.clone(),
            purpose: match options.purpose {
                Purpose::Accuracy => "accuracy",
                Purpose::Causes => "causes",
                Purpose::Both => "both",
            },
            seed: options.seed,
            trusted: next.found.is_trusted(),
            measured: next.measured,
            candidates: next.candidates,
            drawn: next.drawn,
            workspace_poses: next.workspace_poses,
            noise_mm: next.noise * 1e3,
            misfit_mm: next.misfit * 1e3,
            level: options.level,
            tolerance_mm: options.tolerance.map(|tolerance| tolerance * 1e3),
            now: next.error.map(error),
            attainable_mm: next.attainable.map(|length| length * 1e3),
            out_of_reach: next.is_out_of_reach(options.tolerance),
            stop: next.stop.map(|stop| match stop {
                StopReason::Enough => "enough",
                StopReason::GainBelowNoise => "gain-below-noise",
                StopReason::NoCandidates => "no-candidates",
                StopReason::CausesAlike => "causes-alike",
            }),
            enough_after: next.enough_after(options.tolerance),
            effects: next.effects.clone(),
            poses: next.steps.iter().map(step).collect(),
        }
    }
}
