//! Corrections applied to other rows: predictions with their uncertainty, and commands.

use nalgebra::{DVector, Vector3};

use super::correction::{CorrectedPose, Correction};
use super::residuals::in_measuring_frame;
use crate::fit::{self, Command, Placement, PredictError, Prediction, SavedEstimate, StageError};
use crate::measurement::{Measurements, Split};
use crate::model::Model;
use crate::problem::Problem;

/// Corrections of commands have settled when a pass changes them by less \[m\].
const SETTLED: f64 = 1e-11;
/// Passes after which a command that does not settle is taken as it is: its miss says how good it
/// is.
const MAX_PASSES: usize = 12;

/// What a corrected arm makes of some rows.
#[derive(Debug, Clone)]
pub struct CorrectedPrediction {
    /// Positions with their corrections, residuals and errors.
    pub prediction: Prediction,
    /// Correction and uncertainty of each row.
    pub poses: Vec<CorrectedPose>,
}

/// Predicts `rows` with the arm identified in `estimate` and its correction, as [`fit::predict`].
///
/// Bases and tools of sessions that the estimate lacks are fitted to what the correction leaves of
/// their rows.
///
/// # Errors
/// As [`fit::predict`].
pub fn predict(
    problem: &Problem,
    estimate: &SavedEstimate,
    correction: &Correction,
    rows: &Measurements,
    split: Option<&Split>,
) -> Result<CorrectedPrediction, PredictError> {
    let prediction = fit::predict(problem, Some(estimate), rows, split)?;
    let placement = Placement::of(rows);
    let model = estimate.model(Model::new(problem, &placement.bases, &placement.targets)?);
    let all: Vec<usize> = (0..rows.len()).collect();
    let mut poses = placement.poses(rows, &all, correction.sigma);
    estimate.count_time_in(&mut poses);
    let corrected = correction.at(problem, &model, &prediction.x, &poses);
    if !correction.has_remainder() {
        return Ok(CorrectedPrediction { prediction, poses: corrected });
    }
    let mut shifts: Vec<Vector3<f64>> = corrected.iter().map(|pose| pose.shift).collect();
    let mut prediction = fit::predict(problem, Some(estimate), &shifted(rows, &shifts), split)?;
    in_measuring_frame(rows, &model.base_frames(prediction.x.as_slice()), &mut shifts);
    for (position, shift) in prediction.positions.iter_mut().zip(&shifts) {
        *position += shift;
    }
    for (residual, shift) in prediction.residuals.iter_mut().flatten().zip(&shifts) {
        residual.predicted += shift;
    }
    Ok(CorrectedPrediction { prediction, poses: corrected })
}

/// The same rows as measured of an arm without these shifts.
fn shifted(rows: &Measurements, shifts: &[Vector3<f64>]) -> Measurements {
    let mut rows = rows.clone();
    let of_rows = rows.positions.iter_mut().zip(shifts);
    // Where the arm has no equilibrium nothing is corrected.
    for (position, shift) in
        of_rows.filter(|(_, shift)| shift.iter().all(|value| value.is_finite()))
    {
        *position -= shift;
    }
    rows
}

/// Commands that bring the corrected arm to `targets`, as [`fit::compensate`], each with its
/// uncertainty.
///
/// Newton's method on the corrected model: the correction is taken at the command found so far,
/// until it settles. Its slope is some thousandths of the arm's, so that each pass gains about two
/// digits.
///
/// # Errors
/// As [`fit::compensate`].
pub fn compensate(
    problem: &Problem,
    model: &Model,
    (estimate, x): (&SavedEstimate, &DVector<f64>),
    targets: &Measurements,
    correction: &Correction,
) -> Result<Vec<(Command, CorrectedPose)>, StageError> {
    let all: Vec<usize> = (0..targets.len()).collect();
    let corrected = |rows: &Measurements| {
        let mut poses = Placement::of(rows).poses(rows, &all, correction.sigma);
        estimate.count_time_in(&mut poses);
        correction.at(problem, model, x, &poses)
    };
    let mut shifts: Vec<Vector3<f64>> = corrected(targets).iter().map(|pose| pose.shift).collect();
    let mut first: Option<Vec<Command>> = None;
    let mut pass = 0;
    loop {
        pass += 1;
        let mut commands = fit::compensate(problem, model, x, &shifted(targets, &shifts))?;
        let mut reached = targets.clone();
        reached.configurations =
            commands.iter().flat_map(|command| command.configuration.iter().copied()).collect();
        let poses = corrected(&reached);
        let mut change = 0.0_f64;
        for ((command, pose), shift) in commands.iter_mut().zip(&poses).zip(&mut shifts) {
            let turn = pose.shift - *shift;
            command.miss -= turn;
            change = change.max(turn.norm());
            *shift = pose.shift;
        }
        let before = first.get_or_insert_with(|| commands.clone());
        for (command, before) in commands.iter_mut().zip(before.iter()) {
            (command.seed_miss, command.seed_turn) = (before.seed_miss, before.seed_turn);
        }
        if change <= SETTLED || pass >= MAX_PASSES || !correction.has_remainder() {
            return Ok(commands.into_iter().zip(poses).collect());
        }
    }
}
