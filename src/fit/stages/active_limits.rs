//! Active constraints of a stage, and the rows that confine the unknowns to the free directions.

use nalgebra::DMatrix;

use crate::least_squares::solver::AtBound;

/// Active constraint of a stage, as a row of coefficients of its unknowns.
#[derive(Debug, Clone)]
pub(in crate::fit) struct ActiveLimit {
    /// Index of the constraint among those of the model.
    pub constraint: usize,
    /// Limit (lower or upper) of the constraint on which the fit rests.
    pub side: AtBound,
    /// Coefficients of the constraint, one per unknown.
    pub row: Vec<f64>,
}

/// Returns the rows of `gauge` and of active `constraints`, along which the unknowns cannot move,
/// shape = (rows, unknowns). Rows of constraints have unit length in unknowns that are scaled by
/// the column norms of `triangle`.
///
/// A constraint with only one unknown that is not yet held acts as a bound: it gets no row, and the
/// unknown is marked in `held`.
pub(in crate::fit) fn confine(
    triangle: &DMatrix<f64>,
    gauge: &DMatrix<f64>,
    constraints: &[ActiveLimit],
    held: &mut [bool],
) -> DMatrix<f64> {
    let n = held.len();
    let scale: Vec<f64> =
        triangle.column_iter().map(|c| c.norm()).map(|s| if s > 0.0 { s } else { 1.0 }).collect();
    let mut remaining: Vec<&ActiveLimit> = constraints.iter().collect();
    loop {
        let open = |row: &[f64]| (0..n).filter(|&j| row[j] != 0.0 && !held[j]).collect::<Vec<_>>();
        let Some(alone) = remaining.iter().position(|found| open(&found.row).len() <= 1) else {
            break;
        };
        let unknowns = open(&remaining.remove(alone).row);
        for j in unknowns {
            held[j] = true;
        }
    }
    let mut rows = gauge.clone().insert_rows(gauge.nrows(), remaining.len(), 0.0);
    for (i, found) in remaining.iter().enumerate() {
        let scaled = found.row.iter().zip(&scale).zip(&*held).filter(|(_, held)| !**held);
        let length = scaled.map(|((a, s), _)| (a / s).powi(2)).sum::<f64>().sqrt();
        (0..n).for_each(|j| rows[(gauge.nrows() + i, j)] = found.row[j] / length);
    }
    rows
}
