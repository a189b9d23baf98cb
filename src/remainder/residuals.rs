//! Residuals of a corrected arm, on the rows that it was identified from and on held-out rows.

use std::collections::HashSet;

use nalgebra::{DMatrix, DVector, Vector3};

use super::correction::Correction;
use super::linearise::{Linearisation, timed_poses};
use super::rows::AXES;
use crate::fit::{ErrorSummary, Errors, Identification, IdentifyError, Placement, Residual};
use crate::measurement::{Dataset, Measurements};
use crate::model::Model;
use crate::problem::Problem;
use crate::spatial::Frame;

/// Smallest singular value, as a fraction of the largest, that counts as a direction in which bases
/// and tools can move.
const RANK_TOLERANCE: f64 = 1e-9;

/// Residuals of a corrected arm.
#[derive(Debug, Clone)]
pub struct CorrectedResiduals {
    /// Residual of each row, in the order of the rows.
    pub rows: Vec<Residual>,
    /// Errors of identification and held-out rows; in tables with several kinds of rows, those of
    /// the leading kind.
    pub errors: Errors,
}

/// Returns the residuals of all rows of `data` with the arm of `found` and its correction.
///
/// Bases, tools and points of held-out rows alone are refitted to these rows, to first order.
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
    if correction.has_remainder() {
        let all: Vec<usize> = (0..table.len()).collect();
        let poses = timed_poses(table, &all, (found.sigma, found.first_time));
        let mut shifts: Vec<Vector3<f64>> = correction
            .at(problem, &model, &found.x, &poses)
            .iter()
            .map(|pose| pose.shift)
            .collect();
        let placed = placed(found, &model, correction);
        if !placed.is_empty() {
            let linearisation = Linearisation {
                problem,
                model: &model,
                x: &found.x,
                unknowns: placed,
                sigma: found.sigma,
            };
            let poses_again = poses.clone();
            let jacobian = linearisation.rows(&correction.layout, poses).jacobian;
            let left = model.residuals(poses_again, &found.x);
            refit(&mut shifts, &left, &jacobian);
        }
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
    let errors = Errors {
        identification: of(&data.split.identification),
        held_out: of(&data.split.held_out),
    };
    Ok(CorrectedResiduals { rows, errors })
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

/// Returns the parameters of fitted bases and tools that are not among the parameters of the
/// correction.
fn placed(found: &Identification, model: &Model, correction: &Correction) -> Vec<usize> {
    let known: HashSet<&str> =
        correction.parameters.iter().map(|parameter| parameter.name.as_str()).collect();
    let estimates = found.estimates.iter().enumerate();
    estimates
        .filter(|(k, estimate)| {
            estimate.fitted
                && model.parameters[*k].site.is_placement()
                && !known.contains(estimate.name.as_str())
        })
        .map(|(k, _)| k)
        .collect()
}

/// Refits bases and tools to the residuals that remain after the shifts, by linear least squares,
/// and adds their motion to the shifts. `jacobian` holds their derivatives.
fn refit(shifts: &mut [Vector3<f64>], residuals: &[Vector3<f64>], jacobian: &DMatrix<f64>) {
    let is_used = |row: &usize| jacobian.rows(AXES * row, AXES).amax() > 0.0;
    let used: Vec<usize> = (0..residuals.len()).filter(is_used).collect();
    let coordinates: Vec<usize> =
        used.iter().flat_map(|&row| (0..AXES).map(move |axis| AXES * row + axis)).collect();
    let mut columns = jacobian.select_rows(&coordinates);
    for mut column in columns.column_iter_mut() {
        let length = column.norm();
        if length > 0.0 {
            column /= length;
        }
    }
    let left = DVector::from_iterator(
        coordinates.len(),
        coordinates.iter().map(|&k| (residuals[k / AXES] - shifts[k / AXES])[k % AXES]),
    );
    let gram = columns.tr_mul(&columns);
    let Ok(inverse) = gram.pseudo_inverse(RANK_TOLERANCE) else { return };
    let taken = &columns * (inverse * columns.tr_mul(&left));
    for (k, &row) in used.iter().enumerate() {
        shifts[row] += Vector3::from_fn(|axis, _| taken[AXES * k + axis]);
    }
}
