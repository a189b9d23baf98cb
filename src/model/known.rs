//! Derivatives that are known at a point, for a fit that begins there.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::pose::Pose;
use crate::least_squares::Block;
use crate::least_squares::kernel::sum_of_squares;

/// Part of the residuals by which they may differ where derivatives are those that are known: rounding.
const ROUNDING: f64 = 1e-9;

/// Whitened residuals of some poses and their derivatives at a point, by parameter; three rows a pose.
///
/// A model with further effects that do nothing there yet has the same ones, and columns of these effects beside them.
#[derive(Debug, Clone)]
pub(crate) struct KnownDerivatives {
    /// The column of each parameter.
    columns: BTreeMap<String, usize>,
    /// 1 σ of each pose \[m\].
    sigma: Vec<f64>,
    jacobian: Arc<DMatrix<f64>>,
    residual: Arc<DVector<f64>>,
}

impl KnownDerivatives {
    /// Of poses of these 1 σ \[m\]; the first columns of the Jacobian are those of the parameters of these `names`.
    pub fn new<'n>(
        names: impl Iterator<Item = &'n str>,
        sigma: Vec<f64>,
        (jacobian, residual): (Arc<DMatrix<f64>>, Arc<DVector<f64>>),
    ) -> Self {
        let columns = names.enumerate().map(|(j, name)| (name.to_owned(), j)).collect();
        Self { columns, sigma, jacobian, residual }
    }

    /// Where in some of the poses the residuals, which stand in the last column of `block`, are the known ones: fills the columns of the
    /// parameters that are known there, and returns the others; `None` where they are not.
    pub fn fill<'n>(
        &self,
        block: &mut Block,
        (poses, items): (&[Pose], Range<usize>),
        names: impl Iterator<Item = &'n str>,
    ) -> Option<Vec<usize>> {
        let n = block.parameters();
        let rows = 3 * items.start..3 * items.end;
        if poses.len() != self.sigma.len() || block.rows() != rows.len() {
            return None;
        }
        let units: Vec<f64> = items.map(|pose| self.sigma[pose] / poses[pose].sigma).collect();
        let known = |column: &[f64], row: usize| column[rows.start + row] * units[row / 3];
        let missed = |(row, here): (usize, &f64)| here - known(self.residual.as_slice(), row);
        let missed: Vec<f64> = block.column(n).iter().enumerate().map(missed).collect();
        let most = ROUNDING * ROUNDING * sum_of_squares(block.column(n));
        let missed = sum_of_squares(&missed);
        if missed > most || missed.is_nan() {
            return None;
        }
        let mut others = Vec::new();
        for (j, name) in names.enumerate() {
            let Some(&column) = self.columns.get(name) else {
                others.push(j);
                continue;
            };
            let column = self.jacobian.column(column);
            let column = column.as_slice();
            block.column_mut(j).iter_mut().enumerate().for_each(|(row, out)| *out = known(column, row));
        }
        Some(others)
    }
}
