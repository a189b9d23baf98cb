//! Applies corrections to rows that were not fitted: predictions with their uncertainty, and
//! corrected commands.

use nalgebra::{DVector, Vector3};

use super::correction::{CorrectedPose, Correction};
use super::linearise::timed_poses;
use super::residuals::{in_measuring_frame, of_positions};
use super::uncorrected::{Uncorrected, unknown_sides, widen};
use crate::fit::{
    self, Command, Identification, IdentifyError, Placement, PredictError, Prediction,
    SavedEstimate, StageError,
};
use crate::measurement::{Measurements, Split};
use crate::model::Model;
use crate::problem::Problem;

/// Largest change of a target's correction \[m\] from one pass to the next at which the commands
/// have converged; far below the accuracy of any arm.
const MAX_CONVERGED_CHANGE: f64 = 1e-11;
/// Maximum number of passes, each of which corrects the targets and computes all commands again. A
/// command that has not converged by then is returned with its remaining distance `miss` to the
/// target.
const MAX_PASSES: usize = 12;

/// Positions that the identified arm with its correction predicts for rows of a table.
#[derive(Debug, Clone)]
pub struct CorrectedPrediction {
    /// Corrected positions, with residuals and errors if the rows were measured.
    pub prediction: Prediction,
    /// Correction and uncertainty of each row.
    pub poses: Vec<CorrectedPose>,
    /// Effects that depend on directions of approach that rows do not state. The uncertainty of
    /// these rows includes them.
    pub sides: Vec<Uncorrected>,
}

/// Predicts `rows` as [`fit::predict`] does, and adds the correction to the positions.
///
/// Bases and tools of sessions that were not used to fit the correction are fitted to the corrected
/// rows. This replaces values in the estimate that were fitted without the correction.
///
/// # Errors
/// Returns the errors of [`fit::predict`].
pub fn predict(
    problem: &Problem,
    estimate: &SavedEstimate,
    correction: &Correction,
    rows: &Measurements,
    split: Option<&Split>,
) -> Result<CorrectedPrediction, PredictError> {
    let rows = &*rows.with_sides(estimate.has_approach);
    let placement = Placement::of(rows);
    let model = estimate.model(Model::new(problem, &placement.bases, &placement.targets)?);
    let unseen = correction.unseen_placements(&model);
    let seen = estimate.without_fitted(|name| unseen.contains(name));
    let is_refitted = rows.position_measured && correction.has_remainder();
    let refitted = (is_refitted && !unseen.is_empty())
        .then(|| fit::predict(problem, Some(&seen), rows, split).ok())
        .flatten();
    let estimate = if refitted.is_some() { &seen } else { estimate };
    let prediction = match refitted {
        Some(prediction) => prediction,
        None => fit::predict(problem, Some(estimate), rows, split)?,
    };
    let all_rows: Vec<usize> = (0..rows.len()).collect();
    let mut poses = placement.poses(rows, &all_rows, correction.sigma);
    estimate.count_time_in(&placement, &mut poses);
    let is_placed = |k: &usize| prediction.placed.contains(&model.parameters[*k].name);
    let placed: Vec<usize> = (0..model.parameters.len()).filter(is_placed).collect();
    let mut corrected = correction.at((problem, &model, &prediction.x), &placed, &poses);
    let sides = unknown_sides((problem, &model), prediction.x.as_slice(), &poses);
    widen(&mut corrected, &sides);
    if !correction.has_remainder() {
        return Ok(CorrectedPrediction { prediction, poses: corrected, sides });
    }
    let mut shifts: Vec<Vector3<f64>> = corrected.iter().map(|pose| pose.shift).collect();
    let measured = of_positions(rows, &shifts);
    let mut prediction = fit::predict(problem, Some(estimate), &shifted(rows, &measured), split)?;
    in_measuring_frame(rows, &model.base_frames(prediction.x.as_slice()), &mut shifts);
    for (position, shift) in prediction.positions.iter_mut().zip(&shifts) {
        *position += shift;
    }
    let measured = of_positions(rows, &shifts);
    for (residual, shift) in prediction.residuals.iter_mut().flatten().zip(&measured) {
        residual.predicted += shift;
    }
    Ok(CorrectedPrediction { prediction, poses: corrected, sides })
}

/// Predicts positions of `rows` as [`Identification::predict`] does, and adds the correction. Also
/// returns the correction and the uncertainty of each row.
///
/// # Errors
/// Returns the errors of [`Identification::predict`].
pub fn predict_identified(
    found: &Identification,
    problem: &Problem,
    correction: &Correction,
    rows: &Measurements,
) -> Result<(Vec<Vector3<f64>>, Vec<CorrectedPose>), IdentifyError> {
    let rows = &*rows.with_sides(found.has_approach);
    let mut positions = found.predict(problem, rows)?;
    let model = found.model(problem, &Placement::of(rows))?;
    let every_row: Vec<usize> = (0..rows.len()).collect();
    let poses = timed_poses(rows, &every_row, (correction.sigma, &found.start_times));
    let x = found.vector(&model)?;
    let mut corrected = correction.at((problem, &model, &x), &[], &poses);
    widen(&mut corrected, &unknown_sides((problem, &model), x.as_slice(), &poses));
    for (position, pose) in positions.iter_mut().zip(&corrected) {
        *position += pose.shift;
    }
    Ok((positions, corrected))
}

/// Returns the effects of an identified arm that depend on directions of approach which `rows` do not
/// state.
///
/// # Errors
/// Returns the errors of [`Identification::predict`].
pub fn sides_of(
    found: &Identification,
    problem: &Problem,
    rows: &Measurements,
) -> Result<Vec<Uncorrected>, IdentifyError> {
    let rows = &*rows.with_sides(found.has_approach);
    let model = found.model(problem, &Placement::of(rows))?;
    let every_row: Vec<usize> = (0..rows.len()).collect();
    let poses = timed_poses(rows, &every_row, (1.0, &found.start_times));
    Ok(unknown_sides((problem, &model), found.vector(&model)?.as_slice(), &poses))
}

/// Returns the rows with `shifts` \[m\] subtracted from their positions, as if the arm had no such
/// errors. A NaN shift (no equilibrium) is skipped.
fn shifted(rows: &Measurements, shifts: &[Vector3<f64>]) -> Measurements {
    let mut rows = rows.clone();
    let of_rows = rows.positions.iter_mut().zip(shifts);
    for (position, shift) in
        of_rows.filter(|(_, shift)| shift.iter().all(|value| value.is_finite()))
    {
        *position -= shift;
    }
    rows
}

/// Computes the commands that bring the corrected arm to `targets`, as [`fit::compensate`] does for
/// the arm without correction. Each is returned with the uncertainty of its position.
///
/// In each pass the correction is evaluated at the commands of the previous pass and subtracted
/// from the targets, until it no longer changes. The derivative of the correction is some
/// thousandths of the derivative of the position. Each pass therefore gains two or more digits.
///
/// # Errors
/// Returns the errors of [`fit::compensate`].
pub fn compensate(
    problem: &Problem,
    model: &Model,
    (estimate, x): (&SavedEstimate, &DVector<f64>),
    targets: &Measurements,
    correction: &Correction,
) -> Result<Vec<(Command, CorrectedPose)>, StageError> {
    let all_rows: Vec<usize> = (0..targets.len()).collect();
    let corrected = |rows: &Measurements| {
        let placement = Placement::of(rows);
        let mut poses = placement.poses(rows, &all_rows, correction.sigma);
        estimate.count_time_in(&placement, &mut poses);
        correction.at((problem, model, x), &[], &poses)
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
            let difference = pose.shift - *shift;
            command.miss -= difference;
            change = change.max(difference.norm());
            *shift = pose.shift;
        }
        let before = first.get_or_insert_with(|| commands.clone());
        for (command, before) in commands.iter_mut().zip(before.iter()) {
            (command.seed_miss, command.seed_orientation_error) =
                (before.seed_miss, before.seed_orientation_error);
        }
        if change <= MAX_CONVERGED_CHANGE || pass >= MAX_PASSES || !correction.has_remainder() {
            return Ok(commands.into_iter().zip(poses).collect());
        }
    }
}
