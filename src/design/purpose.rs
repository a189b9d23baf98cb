//! Aims of the next poses, and reasons to choose fewer than requested.

use super::workspace_error::WorkspaceError;

/// Smallest share of the variance of the effects that poses for causes alone must take away. Poses
/// that gain less shorten the standard errors of the effects by less than half a per cent.
const MIN_GAIN_FOR_CAUSES: f64 = 0.01;

/// Aim of the next poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Purpose {
    /// Small errors of predictions in the workspace.
    #[default]
    Accuracy,
    /// Small errors of the effects among which the loop did not decide.
    Causes,
    /// Both aims, with equal weight.
    Both,
}

/// Reason to choose fewer poses than requested, or none.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The error bound over the workspace is not above the tolerance.
    Enough,
    /// The most by which more poses can lower the expected error is less than 1 σ of that error.
    GainBelowNoise,
    /// All candidates are measured or chosen.
    NoCandidates,
    /// The poses are for causes alone, and the best of them hardly lower the variance of the
    /// effects.
    CausesAlike,
}

/// Returns the reason to measure no more poses: the error bound is within the `tolerance` \[m\], or
/// the most that poses can lower the expected error is less than 1 σ of it. Returns `None` if there
/// is no such reason, or if the poses are for causes alone.
pub(super) fn stop_reason(
    error: &WorkspaceError,
    purpose: Purpose,
    tolerance: Option<f64>,
) -> Option<StopReason> {
    if purpose == Purpose::Causes {
        return None;
    }
    if tolerance.is_some_and(|most| error.bound <= most) {
        return Some(StopReason::Enough);
    }
    let is_below_noise =
        purpose == Purpose::Accuracy && error.expected - error.least < error.expected_sigma;
    is_below_noise.then_some(StopReason::GainBelowNoise)
}

/// Returns true if poses for causes alone take away less than [`MIN_GAIN_FOR_CAUSES`] of the
/// variance of the effects; `gain` is the share that they take away.
pub(super) fn leaves_causes_open(purpose: Purpose, gain: f64) -> bool {
    purpose == Purpose::Causes && gain < MIN_GAIN_FOR_CAUSES
}
