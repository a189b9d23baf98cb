//! Constraints of the model as inequalities in the unknowns of a stage.

use nalgebra::{DMatrix, DVector};

use crate::fit::stages::active_limits::ActiveLimit;
use crate::fit::stages::stage::{Stage, StageError};
use crate::least_squares::solver::{Inequalities, InequalitiesError};

impl Stage<'_> {
    /// Returns the indices of the model's constraints that involve the unknowns, and these
    /// constraints as inequalities in the unknowns. All other parameters are as in `at`.
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

    /// Returns the constraints that are active (at a limit) at the full parameter vector `at`.
    ///
    /// # Errors
    /// Returns an error if a row or limit is not finite.
    pub fn held(&self, at: &DVector<f64>) -> Result<Vec<ActiveLimit>, StageError> {
        let (which, rows) = self.constraints(at)?;
        let x = self.unknowns_in(at);
        let held = |(i, constraint)| {
            let row = rows.matrix().row(i).iter().copied().collect();
            Some(ActiveLimit { constraint, side: rows.at(&x, i)?, row })
        };
        Ok(which.into_iter().enumerate().filter_map(held).collect())
    }
}
