//! Linear model of residuals at a point: their Jacobian, reused by a fit that starts there.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::pose::Pose;
use crate::least_squares::Block;
use crate::model::parameter::Parameter;
use crate::numeric::kernel::sum_of_squares;

/// Largest relative difference at which two numbers, or two residual vectors, count as equal. It is
/// far above rounding errors and far below any significant change.
const MAX_RELATIVE_DIFFERENCE: f64 = 1e-9;

/// Whitened residuals of some rows and their derivatives at a point, by parameter name; three
/// residuals a row.
///
/// A model of the same arm with more effects has the same residuals and derivatives at this point,
/// because an effect vanishes while its parameters are 0. Only the columns of the new effects have
/// to be computed. A name means the same parameter in both models.
#[derive(Debug, Clone)]
pub(crate) struct LinearModel {
    /// Deviation of each parameter from nominal at the point, and its Jacobian column; `None` if it
    /// was not unknown.
    parameters: BTreeMap<String, (f64, Option<usize>)>,
    /// Standard deviation (1 σ) of each row \[m\] or \[rad\].
    sigma: Vec<f64>,
    jacobian: Arc<DMatrix<f64>>,
    residual: Arc<DVector<f64>>,
}

impl LinearModel {
    /// Creates the linear model at the full parameter vector `x` of a model with these
    /// `parameters`. The first columns of the Jacobian are those of the `unknowns`; `sigma` is the
    /// 1 σ of each row.
    pub fn new(
        (parameters, x): (&[Parameter], &DVector<f64>),
        unknowns: &[usize],
        sigma: Vec<f64>,
        (jacobian, residual): (Arc<DMatrix<f64>>, Arc<DVector<f64>>),
    ) -> Self {
        let column = |k: usize| unknowns.iter().position(|unknown| *unknown == k);
        let entry = |(k, (parameter, x)): (usize, (&Parameter, &f64))| {
            (parameter.name.clone(), (*x, column(k)))
        };
        let parameters = parameters.iter().zip(x).enumerate().map(entry).collect();
        Self { parameters, sigma, jacobian, residual }
    }

    /// Fills the block with the residuals and derivatives of the rows `items` at the full parameter
    /// vector `x`. Derivatives that are stored are copied. `write` computes the residuals and the
    /// columns of the unknowns in its first argument.
    ///
    /// Returns false, with the block unchanged, if `x` is another point or the residuals there
    /// differ.
    pub fn fill(
        &self,
        (poses, items): (&[Pose], Range<usize>),
        (parameters, x): (&[Parameter], &[f64]),
        unknowns: &[usize],
        block: &mut Block,
        write: impl Fn(&[usize], &mut Block),
    ) -> bool {
        if poses.len() != self.sigma.len() || !self.is_at(parameters, x) {
            return false;
        }
        let column = |&k: &usize| self.parameters.get(&parameters[k].name)?.1;
        let columns: Vec<Option<usize>> = unknowns.iter().map(column).collect();
        let is_new = |j: &usize| columns[*j].is_none();
        let new: Vec<usize> = (0..unknowns.len()).filter(is_new).collect();
        let mut formed = Block::zeros(block.rows(), new.len());
        write(&new.iter().map(|&j| unknowns[j]).collect::<Vec<_>>(), &mut formed);

        let first = 3 * items.start;
        let units: Vec<f64> = items.map(|row| self.sigma[row] / poses[row].sigma).collect();
        let in_units = |column: &[f64], row: usize| column[first + row] * units[row / 3];
        let residual = formed.column(new.len());
        let difference =
            |(row, here): (usize, &f64)| here - in_units(self.residual.as_slice(), row);
        let differences: Vec<f64> = residual.iter().enumerate().map(difference).collect();
        let squares = sum_of_squares(&differences);
        let largest = MAX_RELATIVE_DIFFERENCE * MAX_RELATIVE_DIFFERENCE * sum_of_squares(residual);
        if !squares.is_finite() || squares > largest {
            return false;
        }
        for (j, column) in columns.iter().enumerate() {
            let Some(column) = column else { continue };
            let column = self.jacobian.column(*column);
            let out = block.column_mut(j).iter_mut().enumerate();
            out.for_each(|(row, out)| *out = in_units(column.as_slice(), row));
        }
        for (j, out) in new.iter().copied().chain([unknowns.len()]).enumerate() {
            block.column_mut(out).copy_from_slice(formed.column(j));
        }
        true
    }

    /// Returns true if `x` is the point of the linear model to within rounding; parameters that it
    /// does not contain must be 0.
    fn is_at(&self, parameters: &[Parameter], x: &[f64]) -> bool {
        parameters.iter().zip(x).all(|(parameter, x)| {
            let entry = self.parameters.get(&parameter.name);
            let stored_x = entry.map_or(0.0, |(x, _)| *x);
            let size = parameter.nominal.abs() + stored_x.abs();
            (x - stored_x).abs() <= MAX_RELATIVE_DIFFERENCE * size
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::least_squares::jacobian_and_residual;
    use crate::model::{Model, PoseResiduals};
    use crate::problem::{Observation, PoseView, Problem};

    const RIGID: &str = "[[joint]]\na_m = 0.6\nalpha_deg = 90\n[[joint]]\na_m = 0.4\n";
    const ELASTIC: &str = "[[joint]]\na_m = 0.6\nalpha_deg = 90\nstiffness_N_m_per_rad = 2e4\n[[joint]]\na_m = 0.4\n\
                           [joint.beam]\nname = 'A'\nmass_kg = 3\nEA_N = 1e6\nGJ_N_m2 = 700\nEIy_N_m2 = 900\nEIz_N_m2 = 900\n[tool]\ntarget_m = [0.1, 0, 0.2]\npayload_kg = 5\n";

    fn model(arm: &str, effects: &str) -> Model {
        let text = format!(
            "name = 'arm'\n{arm}{effects}\n[parameters]\n'joint*.*' = {{ free = true }}\n'base.*' = {{ free = false }}\n\
             'tool.*' = {{ free = false }}\n"
        );
        let problem = Problem::parse(&text, "problem.toml".as_ref()).unwrap();
        Model::new(&problem, &["base".to_owned()], &["tool".to_owned()]).unwrap()
    }

    #[test]
    fn columns_of_a_linear_model_equal_fresh_ones() {
        columns_equal_fresh_ones(RIGID, 1.0);
    }

    #[test]
    fn columns_for_an_elastic_arm_equal_fresh_ones_for_other_sigma() {
        columns_equal_fresh_ones(ELASTIC, 1e6);
    }

    /// Multiplies σ of some poses by `factor` where the derivatives are formed.
    fn columns_equal_fresh_ones(arm: &str, factor: f64) {
        let configurations: Vec<[f64; 2]> =
            (0..600).map(|k| [0.01 * f64::from(k), 2.0 * (0.03 * f64::from(k)).sin()]).collect();
        let measured = Vector3::new(0.1, 0.2, 0.3);
        let pose = |configuration, sigma| Pose {
            setup: PoseView::from_configuration(configuration),
            base: 0,
            target: 0,
            observation: Observation::Position,
            measured: &measured,
            sigma,
            orientation: None,
        };
        let sigma = |k: usize, factor: f64| if k % 100 == 7 { 1e-3 * factor } else { 1e-3 };
        let poses = |times: f64, factor: f64| -> Vec<Pose> {
            let configurations = configurations.iter().enumerate();
            configurations.map(|(k, q)| pose(q, times * sigma(k, factor))).collect()
        };
        let (plain, more) = (
            model(arm, ""),
            model(arm, "[[effect]]\njoint-harmonic = { joint = 1, orders = [1, 3] }\n"),
        );
        let names = |model: &Model| {
            model.parameters.iter().map(|parameter| parameter.name.clone()).collect::<Vec<_>>()
        };
        let x = DVector::from_fn(plain.parameters.len(), |j, _| 0.01 * (1.0 + j as f64));
        let unknowns = |model: &Model| (0..model.parameters.len()).collect::<Vec<_>>();
        let residuals = PoseResiduals::new(&plain, poses(1.0, factor), unknowns(&plain), x.clone());
        let (mut columns, residual) = jacobian_and_residual(&residuals, &x);
        // A changed entry shows that the column was reused.
        columns.column_mut(0)[5] += 1.0;
        let names_there = names(&plain);
        let linear_model = LinearModel::new(
            (&plain.parameters, &x),
            &unknowns(&plain),
            (0..600).map(|k| sigma(k, factor)).collect(),
            (columns.into(), residual.into()),
        );
        let at = |name: &String| {
            names_there.iter().position(|other| other == name).map_or(0.0, |j| x[j])
        };
        let start = DVector::from_iterator(more.parameters.len(), names(&more).iter().map(at));
        let fresh = PoseResiduals::new(&more, poses(2.0, 1.0), unknowns(&more), start.clone());
        let reused = PoseResiduals::new(&more, poses(2.0, 1.0), unknowns(&more), start.clone())
            .with_linear_model(Some(&linear_model));
        let ((expected, residual_there), (found, found_residual)) =
            (jacobian_and_residual(&fresh, &start), jacobian_and_residual(&reused, &start));
        let mut difference = found - &expected;
        let first = names(&more).iter().position(|name| *name == names_there[0]).unwrap();
        assert!((difference[(5, first)] - 0.5).abs() < 1e-9);
        difference[(5, first)] = 0.0;
        assert!(
            difference.amax() < 1e-11 * expected.amax()
                && (found_residual - residual_there).amax() < 1e-12
        );
        // At another point nothing is reused.
        let moved = start.add_scalar(1e-4);
        assert!(jacobian_and_residual(&reused, &moved) == jacobian_and_residual(&fresh, &moved));
    }
}
