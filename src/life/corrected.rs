//! Test of new rows against an earlier estimate with its remainder.

use nalgebra::{DMatrix, DVector};

use super::assessment::{Assessment, assess};
use super::causes::{Cause, CauseKind, Extended};
use super::rows::{SensitiveRows, warmth};
use crate::fit::Placement;
use crate::measurement::Measurements;
use crate::model::{Model, Pose};
use crate::numeric::lower_factor;
use crate::problem::Problem;
use crate::remainder::PredictedRows;

/// Maximum number of rows that are tested, evenly spaced among the new ones.
pub(super) const MAX_TESTED_ROWS: usize = 80;
/// Number of coordinates of a position.
const AXES: usize = 3;
/// Fraction of the noise variance that is added to the covariance of predictions, so that it is
/// positive definite despite rounding.
const JITTER: f64 = 1e-9;

/// Result of the test, with what its causes refer to.
pub(super) struct CorrectedTest {
    pub assessed: Assessment,
    pub causes: Vec<Cause>,
    pub extended: Extended,
    pub rows: SensitiveRows,
    /// Indices of the tested rows in their table.
    pub places: Vec<usize>,
}

/// Tests rows that an earlier estimate predicted with its remainder, for changes about the full
/// parameter vector `x`. Returns `None` if a number is not finite.
///
/// Each coordinate has an error of its prediction, with the covariance of parameters and remainder
/// together, and noise. Without the misfit that the remainder corrects, the rows show changes that
/// the parameters alone would hide.
pub(super) fn tested(
    (problem, model, x): (&Problem, &Model, &DVector<f64>),
    (table, placement): (&Measurements, &Placement),
    predicted: PredictedRows,
) -> Option<CorrectedTest> {
    let PredictedRows { rows: places, residual, covariance, sigma } = predicted;
    let extended = Extended::new(problem, model, x, [&placement.bases, &placement.targets]);
    let turn = problem.data.orientation_sigma.filter(|_| problem.data.fits_orientation);
    let poses: Vec<Pose> = placement.oriented_poses(table, &places, (1.0, turn));
    let poses = poses.into_iter().zip(&sigma).map(|(pose, &sigma)| Pose { sigma, ..pose });
    let mut rows = SensitiveRows::new(&extended.model, poses.collect(), &extended.x);
    rows.residual.fill(0.0);
    for (k, value) in residual.iter().enumerate() {
        rows.residual[rows.stride * (k / AXES) + k % AXES] = value / sigma[k / AXES];
    }
    let warmth = warmth(problem, table, &places);
    let mut causes = extended.causes(problem, &mut rows, warmth.as_deref());
    causes.retain(|cause| cause.kind != CauseKind::Other);
    let first = rows.add_error_columns(AXES);
    let mut whitened = DMatrix::from_fn(residual.len(), residual.len(), |i, j| {
        covariance[(i, j)] / (sigma[i / AXES] * sigma[j / AXES])
    });
    (0..residual.len()).for_each(|k| whitened[(k, k)] += JITTER);
    let lower = lower_factor(whitened)?;
    let mut factor = DMatrix::zeros(rows.sensitivity.ncols(), residual.len());
    factor.rows_mut(first, residual.len()).copy_from(&lower);
    let assessed = assess(&rows, &factor, &causes, false)?;
    Some(CorrectedTest { assessed, causes, extended, rows, places })
}
