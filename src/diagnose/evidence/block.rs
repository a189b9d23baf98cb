//! Columns of one hypothesis, and what a residual says about them: a few for all poses together, or one in every pose.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use super::marginal::{Coefficients, Normal, of_block};
use crate::diagnose::neighbourhood::LinearNeighbourhood;
use crate::diagnose::rules::SelectionRules;

/// Columns A of a hypothesis, shape = (3 N, k).
#[derive(Debug, Clone)]
pub(super) enum Design {
    /// All of them.
    Dense(DMatrix<f64>),
    /// For each lever, shape = (3 N), one column of each group of poses: the lever there, 0 elsewhere. Levers are orthogonal in
    /// every pose, so that AᵀA is diagonal.
    Grouped { levers: DMatrix<f64>, groups: Vec<Option<usize>> },
}

impl Design {
    /// Another error in every pose along one lever.
    pub fn per_pose(lever: &DVector<f64>) -> Self {
        let levers = DMatrix::from_columns(std::slice::from_ref(lever));
        Self::Grouped { levers, groups: (0..lever.len() / 3).map(Some).collect() }
    }

    /// What is kept in numbers: the columns, or the levers.
    fn values(&self) -> &DMatrix<f64> {
        match self {
            Self::Dense(values) | Self::Grouped { levers: values, .. } => values,
        }
    }

    fn values_mut(&mut self) -> &mut DMatrix<f64> {
        match self {
            Self::Dense(values) | Self::Grouped { levers: values, .. } => values,
        }
    }

    /// The same of root mean square 1 over the first poses, all columns together; `None` where nothing is to be seen there.
    pub fn scaled(mut self, poses: usize) -> Option<Self> {
        let first = self.values().rows(0, 3 * poses);
        let size = (first.norm_squared() / first.nrows().max(1) as f64).sqrt();
        let is_seen = size > 0.0 && size.is_finite();
        *self.values_mut() /= if is_seen { size } else { 1.0 };
        is_seen.then_some(self)
    }

    /// The same without some poses.
    pub fn without(mut self, poses: &[usize]) -> Self {
        for &pose in poses {
            self.values_mut().rows_mut(3 * pose, 3).fill(0.0);
        }
        self
    }

    /// All columns.
    pub fn columns(&self) -> Cow<'_, DMatrix<f64>> {
        match self {
            Self::Dense(columns) => Cow::Borrowed(columns),
            Self::Grouped { levers, groups } => {
                let count = count(groups);
                Cow::Owned(DMatrix::from_fn(levers.nrows(), levers.ncols() * count, |row, j| {
                    if groups[row / 3] == Some(j % count) { levers[(row, j / count)] } else { 0.0 }
                }))
            }
        }
    }
}

fn count(groups: &[Option<usize>]) -> usize {
    groups.iter().flatten().max().map_or(0, |last| last + 1)
}

/// Sum over the poses of each group of some row vectors times the levers: M A, shape = (rows of M, k).
fn along(rows: &DMatrix<f64>, levers: &DMatrix<f64>, groups: &[Option<usize>]) -> DMatrix<f64> {
    let count = count(groups);
    let mut all = DMatrix::zeros(rows.nrows(), levers.ncols() * count);
    for (pose, group) in groups.iter().enumerate().filter_map(|(pose, group)| Some((pose, (*group)?))) {
        let here = rows.columns(3 * pose, 3);
        for (k, lever) in levers.column_iter().enumerate() {
            all.column_mut(k * count + group).gemv(1.0, &here, &lever.rows(3 * pose, 3), 1.0);
        }
    }
    all
}

/// Columns of one hypothesis with everything fitted projected out, and the logarithm of its prior probability.
#[derive(Debug, Clone)]
pub(super) struct Block {
    columns: Columns,
    /// AᵀA and Aᵀr.
    normal: Normal,
    pub ln_prior: f64,
    coefficients: Coefficients,
    /// Whether it is of a function of several covariates.
    pub is_surface: bool,
    /// Whether it is of an effect.
    pub is_law: bool,
}

#[derive(Debug, Clone)]
enum Columns {
    /// Everything fitted projected out.
    Dense(DMatrix<f64>),
    /// As they are.
    Grouped { levers: DMatrix<f64>, groups: Vec<Option<usize>> },
}

impl Block {
    /// Of columns of root mean square 1 in the data.
    pub fn new(design: Design, fit: &LinearNeighbourhood, ln_prior: f64, coefficients: Coefficients) -> Self {
        match design {
            Design::Dense(columns) => {
                let columns = fit.left_of(&columns);
                let mut gram = DMatrix::zeros(columns.ncols(), columns.ncols());
                // The narrow side is transposed: this is the product that is fast.
                gram.gemm(1.0, &columns.transpose(), &columns, 0.0);
                let normal = Normal::Dense { product: columns.tr_mul(fit.residual()), gram };
                Self {
                    columns: Columns::Dense(columns),
                    normal,
                    ln_prior,
                    coefficients,
                    is_surface: false,
                    is_law: false,
                }
            }
            Design::Grouped { levers, groups } => {
                let squares = levers.map(|value| value * value);
                let diagonal = along(&DMatrix::repeat(1, squares.nrows(), 1.0), &squares, &groups).transpose();
                let residual = fit.residual().rows(0, levers.nrows()).transpose();
                let normal = Normal::LessFew {
                    diagonal: diagonal.column(0).into_owned(),
                    less: along(&fit.fitted().transpose(), &levers, &groups),
                    product: along(&DMatrix::from_rows(&[residual]), &levers, &groups)
                        .transpose()
                        .column(0)
                        .into_owned(),
                };
                let normal = normal.whole_if_less_work();
                Self {
                    columns: Columns::Grouped { levers, groups },
                    normal,
                    ln_prior,
                    coefficients,
                    is_surface: false,
                    is_law: false,
                }
            }
        }
    }

    /// Whether it has more columns than a set that is extended may hold.
    pub fn is_wide(&self, rules: &SelectionRules) -> bool {
        matches!(&self.columns, Columns::Grouped { levers, groups } if levers.ncols() * count(groups) > rules.widest)
    }

    /// A, everything that was fitted projected out.
    pub fn columns(&self, fit: &LinearNeighbourhood) -> Cow<'_, DMatrix<f64>> {
        match &self.columns {
            Columns::Dense(columns) => Cow::Borrowed(columns),
            Columns::Grouped { levers, groups } => {
                let design = Design::Grouped { levers: levers.clone(), groups: groups.clone() };
                Cow::Owned(fit.left_of(&design.columns()))
            }
        }
    }

    /// ln p(r | set and block) − ln p(r | set) of a residual from which a set takes `taken` along the rows Z = `within`, and the most
    /// probable size; `left` are the squares that the set leaves, and their degrees of freedom.
    pub fn gain(
        &self,
        (within, taken): (&DMatrix<f64>, &DVector<f64>),
        (left, without): ((f64, f64), f64),
        grid: &[(f64, f64)],
        rules: &SelectionRules,
    ) -> (f64, f64) {
        let along = match &self.columns {
            _ if within.nrows() == 0 => None,
            Columns::Dense(columns) => Some(within * columns),
            Columns::Grouped { levers, groups } => Some(along(within, levers, groups)),
        };
        self.gain_beside(along.as_ref().map(|along| (along, taken)), (left, without), grid, rules)
    }

    /// The same with Z A and Z r of the set, `None` for nothing.
    pub fn gain_beside(
        &self,
        set: Option<(&DMatrix<f64>, &DVector<f64>)>,
        (left, without): ((f64, f64), f64),
        grid: &[(f64, f64)],
        rules: &SelectionRules,
    ) -> (f64, f64) {
        let prior = (&rules.displacements[..], &self.coefficients);
        let (with, size) = match set {
            None => of_block(&self.normal, left, grid, prior),
            Some((along, taken)) => of_block(&self.normal.beside(along, taken), left, grid, prior),
        };
        (with - without, size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::neighbourhood::Unknowns;

    /// Numbers without pattern.
    fn matrix(rows: usize, columns: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |i, j| (12.9898 * i as f64 + 78.233 * (j + 1) as f64).sin() * 43.7 % 1.0)
    }

    #[test]
    fn a_column_for_every_pose_weighs_the_same_written_out() {
        let rules = SelectionRules::DEFAULT;
        let (jacobian, residual) = (matrix(36, 4), matrix(36, 6).column(5) * 4.0);
        let unknowns =
            Unknowns { x: vec![0.0; 4], priors: vec![None, Some(0.3), None, None], active: DMatrix::zeros(0, 4) };
        let fit = LinearNeighbourhood::new(&jacobian, &residual, &unknowns, 0);
        let (within, grid) =
            (fit.left_of(&matrix(36, 9).columns(7, 2).into_owned()).transpose() * 0.2, [(0.0, 0.5), (-1.0, 0.2)]);
        let taken = &within * fit.residual();
        for set in [within, DMatrix::zeros(0, fit.residual().len())] {
            let taken = if set.nrows() == 0 { DVector::zeros(0) } else { taken.clone() };
            let groups = (0..12).map(|pose| (pose != 5).then_some(pose / 2)).collect();
            for grouped in [
                Design::per_pose(&matrix(36, 1).column(0).into_owned()),
                Design::Grouped { levers: matrix(36, 1), groups },
            ] {
                let grouped = grouped.scaled(12).unwrap().without(&[3]);
                let dense = Design::Dense(grouped.columns().into_owned());
                let [one, other] = [grouped, dense].map(|design| {
                    let block = Block::new(design, &fit, 0.0, Coefficients::default());
                    (block.gain((&set, &taken), ((100.0, 30.0), 0.0), &grid, &rules), block.columns(&fit).into_owned())
                });
                assert!((one.0.0 - other.0.0).abs() < 1e-9 && (one.0.1 - other.0.1).abs() < 1e-12, "{one:?} {other:?}");
                assert!((one.1 - other.1).amax() < 1e-12);
            }
        }
    }
}
