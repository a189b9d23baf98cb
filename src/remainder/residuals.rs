//! Residuals of a corrected arm, on the rows that it was identified from and on held-out rows.

use std::collections::HashSet;

use nalgebra::Vector3;

use super::correction::{CorrectedPose, Correction};
use super::linearise::timed_poses;
use super::placement_fit::PlacementFit;
use crate::fit::{
    ErrorSummary, Errors, Estimate, Identification, IdentifyError, Placement, Residual,
};
use crate::measurement::{Dataset, Measurements};
use crate::model::Model;
use crate::problem::Problem;
use crate::spatial::Frame;

/// Residuals of the identified arm with its correction.
#[derive(Debug, Clone)]
pub struct CorrectedResiduals {
    /// Residual of each row, in the order of the rows.
    pub rows: Vec<Residual>,
    /// Correction and uncertainty of the prediction of each row.
    pub poses: Vec<CorrectedPose>,
    /// Errors of identification and held-out rows; in tables with several kinds of rows, those of
    /// the leading kind (positions, if there are any).
    pub errors: Errors,
}

/// Returns the residuals of all rows of `data` with the arm of `found` and its correction.
///
/// Bases, tools and points that only held-out rows use are refitted to the corrected rows, to first
/// order.
///
/// # Errors
/// Returns an error if `problem` and `data` are not those that were identified.
pub fn residuals(
    found: &Identification,
    problem: &Problem,
    data: &Dataset,
    correction: &Correction,
) -> Result<CorrectedResiduals, IdentifyError> {
    let table = &data.measurements;
    let placement = Placement::of(table);
    let model = found.strategy.model(Model::new(problem, &placement.bases, &placement.targets)?);
    let mut rows = found.residuals(problem, data)?;
    let every_row: Vec<usize> = (0..table.len()).collect();
    let poses = timed_poses(table, &every_row, (correction.sigma, &found.start_times));
    let placed = placed(found, &model, correction);
    let corrected = correction.at((problem, &model, &found.x), &placed, &poses);
    if correction.has_remainder() {
        let shifts: Vec<Vector3<f64>> = corrected.iter().map(|pose| pose.shift).collect();
        let mut shifts = of_positions(table, &shifts);
        let placement = PlacementFit::new((problem, &model, &found.x), &placed, &poses);
        placement.refit(&mut shifts, &model.residuals(poses, &found.x));
        in_measuring_frame(table, &model.base_frames(found.x.as_slice()), &mut shifts);
        for (row, shift) in rows.iter_mut().zip(&shifts) {
            let unit = row.position.norm() / row.whitened.norm();
            row.predicted += shift;
            row.position -= shift;
            let sigma = if unit.is_finite() { unit } else { found.sigma };
            row.whitened = row.position / sigma;
        }
    }
    let of = |part: &[usize]| {
        let errors: Vec<Vector3<f64>> = part.iter().map(|&row| rows[row].position).collect();
        ErrorSummary::of_rows(table, part.iter().copied(), &errors)
    };
    // Without held-out rows, the errors of configurations left out are those without the remainder.
    let Errors { held_out: left_out, is_left_out, .. } = found.fitted;
    let errors = Errors {
        identification: of(&data.split.identification),
        held_out: if is_left_out { left_out } else { of(&data.split.held_out) },
        is_left_out,
    };
    Ok(CorrectedResiduals { rows, poses: corrected, errors })
}

/// Returns the shifts of rows that measure positions, and 0 for other rows, whose numbers a
/// remainder does not correct.
pub(super) fn of_positions(table: &Measurements, shifts: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let of_row = |(row, shift): (usize, &Vector3<f64>)| {
        if table.observation(row).is_of_position() { *shift } else { Vector3::zeros() }
    };
    shifts.iter().enumerate().map(of_row).collect()
}

/// Rotates the shifts of rows that touch a point from the axes of the arm's base to the measuring
/// frame. Other shifts already are in the measuring frame.
pub(super) fn in_measuring_frame(
    table: &Measurements,
    bases: &[Frame<f64>],
    shifts: &mut [Vector3<f64>],
) {
    for (row, shift) in shifts.iter_mut().enumerate() {
        if table.observation(row).is_point() {
            *shift = bases[table.session.of_row[row]].vector(shift);
        }
    }
}

/// Returns the indices of the parameters of fitted bases, tools and points that are not among the
/// parameters of the correction, because only held-out rows use them.
fn placed(found: &Identification, model: &Model, correction: &Correction) -> Vec<usize> {
    let in_correction: HashSet<&str> =
        correction.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    let estimates = found.estimates.iter().enumerate();
    let is_placed = |(k, estimate): &(usize, &Estimate)| {
        estimate.fitted
            && estimate.at_bound.is_none()
            && model.parameters[*k].site.is_placement()
            && !in_correction.contains(estimate.name.as_str())
    };
    estimates.filter(is_placed).map(|(k, _)| k).collect()
}
