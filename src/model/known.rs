//! Derivatives that are known at a point, for a fit that begins there.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::pose::Pose;
use crate::least_squares::Block;
use crate::least_squares::kernel::sum_of_squares;
use crate::model::parameter::Parameter;

/// Part of a number by which it may differ where it is the same but for rounding.
const ROUNDING: f64 = 1e-9;

/// Whitened residuals of some poses and their derivatives at a point, by parameter; three rows a
/// pose.
///
/// A model of the same arm with further effects, which do nothing while their parameters are 0, has
/// the same ones there, and columns of these effects beside them. A name stands for the same
/// parameter in both.
#[derive(Debug, Clone)]
pub(crate) struct LinearModel {
    /// Of each parameter its deviation from nominal, and its column if it has one.
    parameters: BTreeMap<String, (f64, Option<usize>)>,
    /// 1 σ of each pose \[m\].
    sigma: Vec<f64>,
    jacobian: Arc<DMatrix<f64>>,
    residual: Arc<DVector<f64>>,
}

impl LinearModel {
    /// At the full parameter vector `x` of a model with these `parameters`, of poses of these 1 σ
    /// \[m\]; the first columns of the Jacobian are those of the `unknowns`.
    pub fn new(
        (parameters, x): (&[Parameter], &DVector<f64>),
        unknowns: &[usize],
        sigma: Vec<f64>,
        (jacobian, residual): (Arc<DMatrix<f64>>, Arc<DVector<f64>>),
    ) -> Self {
        let column = |k: usize| unknowns.iter().position(|own| *own == k);
        let own = parameters.iter().zip(x).enumerate();
        let parameters = own.map(|(k, (own, x))| (own.name.clone(), (*x, column(k)))).collect();
        Self { parameters, sigma, jacobian, residual }
    }

    /// Which of the unknowns have no column; `None` where `x` is another point, or poses are not as
    /// many.
    pub fn lacking(
        &self,
        poses: &[Pose],
        (parameters, x): (&[Parameter], &DVector<f64>),
        unknowns: &[usize],
    ) -> Option<Vec<usize>> {
        let is_there = |(own, x): (&Parameter, &f64)| {
            let known = self.parameters.get(&own.name).map_or(0.0, |(known, _)| *known);
            (x - known).abs() <= ROUNDING * (own.nominal.abs() + known.abs())
        };
        let is_it = poses.len() == self.sigma.len() && parameters.iter().zip(x).all(is_there);
        let lacks = |&j: &usize| self.column(&parameters[unknowns[j]]).is_none();
        is_it.then(|| (0..unknowns.len()).filter(lacks).collect())
    }

    fn column(&self, parameter: &Parameter) -> Option<usize> {
        self.parameters.get(&parameter.name)?.1
    }

    /// Fills the block of some poses from what is known and from the columns of `new`, those
    /// `lacking`, and its residual; not where that residual is not the known one.
    pub fn fill(
        &self,
        block: &mut Block,
        (poses, items): (&[Pose], Range<usize>),
        (parameters, unknowns): (&[Parameter], &[usize]),
        (new, lacking): (&Block, &[usize]),
    ) -> bool {
        let first = 3 * items.start;
        let units: Vec<f64> = items.map(|pose| self.sigma[pose] / poses[pose].sigma).collect();
        let known = |column: &[f64], row: usize| column[first + row] * units[row / 3];
        let residual = new.column(new.parameters());
        let missed = |(row, here): (usize, &f64)| here - known(self.residual.as_slice(), row);
        let missed = sum_of_squares(&residual.iter().enumerate().map(missed).collect::<Vec<f64>>());
        if !missed.is_finite() || missed > ROUNDING * ROUNDING * sum_of_squares(residual) {
            return false;
        }
        for (j, &k) in unknowns.iter().enumerate() {
            if let Some(column) = self.column(&parameters[k]) {
                let column = self.jacobian.column(column);
                let column = column.as_slice();
                block
                    .column_mut(j)
                    .iter_mut()
                    .enumerate()
                    .for_each(|(row, out)| *out = known(column, row));
            }
        }
        let places = lacking.iter().copied().chain([unknowns.len()]).enumerate();
        places.for_each(|(own, j)| block.column_mut(j).copy_from_slice(new.column(own)));
        true
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
    fn known_columns_are_those_formed_anew() {
        are_those_formed_anew(RIGID, 1.0);
    }

    #[test]
    fn known_columns_of_an_arm_that_bends_are_those_formed_anew_also_of_poses_that_were_set_aside()
    {
        are_those_formed_anew(ELASTIC, 1e6);
    }

    /// With σ of some poses so many times as large where the derivatives were formed.
    fn are_those_formed_anew(arm: &str, aside: f64) {
        let configurations: Vec<[f64; 2]> =
            (0..600).map(|k| [0.01 * f64::from(k), 2.0 * (0.03 * f64::from(k)).sin()]).collect();
        let seen = Vector3::new(0.1, 0.2, 0.3);
        let pose = |own, sigma| Pose {
            setup: PoseView::from_configuration(own),
            base: 0,
            target: 0,
            observation: Observation::Position,
            measured: &seen,
            sigma,
            orientation: None,
        };
        let sigma = |k: usize, aside: f64| if k % 100 == 7 { 1e-3 * aside } else { 1e-3 };
        let poses = |times: f64, aside: f64| -> Vec<Pose> {
            let own = configurations.iter().enumerate();
            own.map(|(k, own)| pose(own, times * sigma(k, aside))).collect()
        };
        let (plain, more) = (
            model(arm, ""),
            model(arm, "[[effect]]\njoint-harmonic = { joint = 1, orders = [1, 3] }\n"),
        );
        let names =
            |model: &Model| model.parameters.iter().map(|own| own.name.clone()).collect::<Vec<_>>();
        let x = DVector::from_fn(plain.parameters.len(), |j, _| 0.01 * (1.0 + j as f64));
        let unknowns = |model: &Model| (0..model.parameters.len()).collect::<Vec<_>>();
        let residuals = PoseResiduals::new(&plain, poses(1.0, aside), unknowns(&plain), x.clone());
        let (mut columns, residual) = jacobian_and_residual(&residuals, &x);
        // What is known is taken as it is: a mark shows that it was.
        columns.column_mut(0)[5] += 1.0;
        let all = names(&plain);
        let known = LinearModel::new(
            (&plain.parameters, &x),
            &unknowns(&plain),
            (0..600).map(|k| sigma(k, aside)).collect(),
            (columns.into(), residual.into()),
        );
        let at = |name: &String| all.iter().position(|own| own == name).map_or(0.0, |j| x[j]);
        let start = DVector::from_iterator(more.parameters.len(), names(&more).iter().map(at));
        let fresh = PoseResiduals::new(&more, poses(2.0, 1.0), unknowns(&more), start.clone());
        let begun = PoseResiduals::new(&more, poses(2.0, 1.0), unknowns(&more), start.clone())
            .with_linear_model(Some(&known));
        let ((expected, there), (found, own)) =
            (jacobian_and_residual(&fresh, &start), jacobian_and_residual(&begun, &start));
        let mut difference = found - &expected;
        let first = names(&more).iter().position(|name| *name == all[0]).unwrap();
        assert!((difference[(5, first)] - 0.5).abs() < 1e-9);
        difference[(5, first)] = 0.0;
        assert!(difference.amax() < 1e-11 * expected.amax() && (own - there).amax() < 1e-12);
        // Elsewhere nothing is known.
        let moved = start.add_scalar(1e-4);
        assert!(jacobian_and_residual(&begun, &moved) == jacobian_and_residual(&fresh, &moved));
    }
}
