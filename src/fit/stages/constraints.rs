//! Constraints on the unknowns of a stage.

use nalgebra::{DMatrix, DVector};

use crate::fit::stages::stage::{Stage, StageError};
use crate::least_squares::solver::{AtBound, Inequalities, InequalitiesError};

/// Active constraint on the unknowns of a stage.
#[derive(Debug, Clone)]
pub(in crate::fit) struct Held {
    /// Index of the constraint in the model.
    pub constraint: usize,
    /// Limit on which the unknowns are.
    pub side: AtBound,
    /// Coefficients of the constraint, one per unknown.
    pub row: Vec<f64>,
}

impl Stage<'_> {
    /// Returns the indices and the rows of the model's constraints on the unknowns, with the other
    /// parameters as in `at`.
    ///
    /// # Errors
    /// Returns an error if a row or limit is not finite.
    pub fn constraints(
        &self,
        at: &DVector<f64>,
    ) -> Result<(Vec<usize>, Inequalities), InequalitiesError> {
        let n = self.unknowns.len();
        let (mut which, mut rows, mut lower, mut upper) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for (index, constraint) in self.model.constraints.iter().enumerate() {
            let varies = |&(k, _): &(usize, f64)| self.unknowns.contains(&k);
            if !self.counts_fixed && !constraint.terms.iter().all(varies) {
                continue;
            }
            let (mut row, mut rest) = (vec![0.0; n], 0.0);
            for &(k, coefficient) in &constraint.terms {
                match self.unknowns.iter().position(|&unknown| unknown == k) {
                    Some(j) => row[j] += coefficient,
                    None => rest += coefficient * at[k],
                }
            }
            if row.iter().any(|coefficient| *coefficient != 0.0) {
                which.push(index);
                rows.extend(row);
                lower.push(constraint.lower - rest);
                upper.push(constraint.upper - rest);
            }
        }
        let matrix = DMatrix::from_row_slice(which.len(), n, &rows);
        Ok((which, Inequalities::new(matrix, DVector::from_vec(lower), DVector::from_vec(upper))?))
    }

    /// Returns the constraints that are active at the full parameter vector `at`.
    ///
    /// # Errors
    /// Returns an error if a row or limit is not finite.
    pub fn held(&self, at: &DVector<f64>) -> Result<Vec<Held>, StageError> {
        let (which, rows) = self.constraints(at)?;
        let x = DVector::from_iterator(self.unknowns.len(), self.unknowns.iter().map(|&k| at[k]));
        let held = |(i, constraint)| {
            let row = rows.matrix().row(i).iter().copied().collect();
            Some(Held { constraint, side: rows.at(&x, i)?, row })
        };
        Ok(which.into_iter().enumerate().filter_map(held).collect())
    }
}

/// Stacks the rows of `gauge` and of active constraints, scaled to unit length in unknowns that are
/// scaled by the data.
///
/// A constraint on a single unknown that is not held acts as a bound: the unknown becomes `held`.
pub(in crate::fit) fn confine(
    triangle: &DMatrix<f64>,
    gauge: &DMatrix<f64>,
    constraints: &[Held],
    held: &mut [bool],
) -> DMatrix<f64> {
    let n = held.len();
    let scale: Vec<f64> =
        triangle.column_iter().map(|c| c.norm()).map(|s| if s > 0.0 { s } else { 1.0 }).collect();
    let mut left: Vec<&Held> = constraints.iter().collect();
    loop {
        let open = |row: &[f64]| (0..n).filter(|&j| row[j] != 0.0 && !held[j]).collect::<Vec<_>>();
        let Some(alone) = left.iter().position(|found| open(&found.row).len() <= 1) else { break };
        let unknowns = open(&left.remove(alone).row);
        for j in unknowns {
            held[j] = true;
        }
    }
    let mut rows = gauge.clone().insert_rows(gauge.nrows(), left.len(), 0.0);
    for (i, found) in left.iter().enumerate() {
        let scaled = found.row.iter().zip(&scale).zip(&*held).filter(|(_, held)| !**held);
        let length = scaled.map(|((a, s), _)| (a / s).powi(2)).sum::<f64>().sqrt();
        (0..n).for_each(|j| rows[(gauge.nrows() + i, j)] = found.row[j] / length);
    }
    rows
}
