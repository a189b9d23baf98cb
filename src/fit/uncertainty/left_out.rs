//! Cross-validation: errors of configurations that are left out of the fit one at a time.

use nalgebra::{DMatrix, DVector, Vector3};

use crate::fit::stages::fitting::{FitEnd, Fitting};
use crate::least_squares::{Triangle, jacobian_and_residual};
use crate::numeric::parallel;
use crate::problem::Problem;

/// Ridge on the diagonal of JᵀJ + Λ, as a fraction of the entry of JᵀJ there. Combinations that
/// only one configuration determines then keep their fitted values if that one is left out.
const RIDGE: f64 = 1e-9;

impl Fitting<'_> {
    /// Returns the [`left_out_errors`](Self::left_out_errors) at the end of a fit, in which the
    /// parameters that rest on a bound are held. `problem` is that of the model.
    pub fn left_out(&self, end: &FitEnd, problem: &Problem) -> Vec<Vector3<f64>> {
        let whole = self.whole();
        let free = whole.unknowns.iter().zip(&end.at_bound).filter(|(_, bound)| bound.is_none());
        let unknowns: Vec<usize> = free.map(|(&k, _)| k).collect();
        self.left_out_errors(&end.x, &unknowns, &self.measurements.configurations(problem).0)
    }

    /// Returns the error measured − predicted of each identification row, in the order of these
    /// rows, measuring frame \[m\]. Each row is predicted by a fit without its configuration, which
    /// is linearised at the full parameter vector `x`.
    ///
    /// r₋ = (I − H)⁻¹ r with the block H of J (JᵀJ + Λ)⁻¹ Jᵀ of the configuration [Cook and
    /// Weisberg 1982]. Λ is the information of priors and earlier data; rows are weighted by the
    /// robust loss. If I − H or JᵀJ + Λ is singular, r₋ = r. `configurations` holds the number of
    /// the configuration of every row of the table. `unknowns` are the indices of the parameters
    /// that were fitted and rest on no bound.
    pub fn left_out_errors(
        &self,
        x: &DVector<f64>,
        unknowns: &[usize],
        configurations: &[usize],
    ) -> Vec<Vector3<f64>> {
        let rows = &self.split.identification;
        let stage = self.stage(rows, unknowns.to_vec());
        let (residuals, per_pose) = (stage.residuals(x), stage.coordinates());
        let (mut jacobian, mut residual) =
            jacobian_and_residual(&residuals, &residuals.unknowns_in(x));
        // At the optimum of a robust loss, the gradient of the rows with these weights is zero.
        let weight = |place: usize| {
            self.loss.weight(residual.rows(per_pose * place, per_pose).norm_squared()).sqrt()
        };
        let weights: Vec<f64> = (0..rows.len()).map(weight).collect();
        for (place, weight) in weights.iter().enumerate() {
            jacobian.rows_mut(per_pose * place, per_pose).scale_mut(*weight);
            residual.rows_mut(per_pose * place, per_pose).scale_mut(*weight);
        }
        let mut triangle = Triangle::of_rows(&jacobian, &residual);
        let prior = |(j, &k): (usize, &usize)| {
            let precision = self.model.parameters[k].sigma.map_or(0.0, |sigma| sigma.powi(-2));
            let ridge = RIDGE * jacobian.column(j).norm_squared() + f64::MIN_POSITIVE;
            ((precision + ridge).sqrt(), 0.0)
        };
        triangle.absorb_diagonal(&unknowns.iter().enumerate().map(prior).collect::<Vec<_>>());
        if let Some(earlier) = self.earlier {
            let rows = earlier.on(self.model, unknowns, x);
            triangle.merge(&Triangle::of_rows(&rows.matrix, &rows.constant));
        }
        let mut groups: Vec<Vec<usize>> = Vec::new();
        let mut group_of = std::collections::BTreeMap::new();
        for (place, &row) in rows.iter().enumerate() {
            let group = *group_of.entry(configurations[row]).or_insert_with(|| {
                groups.push(Vec::new());
                groups.len() - 1
            });
            groups[group].push(place);
        }
        let of_group = |places: &Vec<usize>| -> Vec<(usize, Vector3<f64>)> {
            let lines: Vec<usize> =
                places.iter().flat_map(|place| per_pose * place..per_pose * (place + 1)).collect();
            let mut left = residual.select_rows(&lines);
            let mut whitened = jacobian.select_rows(&lines).transpose();
            whitened.column_iter_mut().for_each(|column| triangle.solve_transposed(column));
            let hat = whitened.tr_mul(&whitened);
            let matrix = DMatrix::identity(lines.len(), lines.len()) * (1.0 + RIDGE) - hat;
            left = matrix.cholesky().map_or(left.clone(), |matrix| matrix.solve(&left));
            let error = |(k, &place): (usize, &usize)| {
                let whitened = left.fixed_rows::<3>(per_pose * k).into_owned();
                (place, whitened * stage.poses[place].sigma / weights[place].max(f64::MIN_POSITIVE))
            };
            places.iter().enumerate().map(error).collect()
        };
        let mut errors = vec![Vector3::zeros(); rows.len()];
        let errors_of_places = parallel::joined(parallel::map_items(&groups, of_group));
        for (place, error) in errors_of_places {
            errors[place] = error;
        }
        errors
    }
}
