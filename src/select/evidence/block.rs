//! Columns of one hypothesis and their products with the residual: a few for all poses together, or
//! one for every pose.

use crate::select::settings::{DISPLACEMENTS, MAX_WIDE_COLUMNS};
use std::borrow::Cow;

use nalgebra::{DMatrix, DMatrixView, DVector};

use super::marginal::{Coefficients, NoiseGrid, Normal, averaged, ln_likelihood_of_block};
use super::wide_blocks::{Factors, is_wide};
use crate::select::neighbourhood::LinearNeighbourhood;

/// Columns A of a hypothesis: derivatives of the whitened residuals with respect to its
/// coefficients, shape = (3 N, k).
#[derive(Debug, Clone)]
pub(super) enum Design {
    /// Columns stored as a full matrix.
    Dense(DMatrix<f64>),
    /// Sparse columns. For each lever, shape = (3 N), there is one column for each group of poses:
    /// equal to the lever in the group, 0 elsewhere. `groups` holds the group of each pose, `None`
    /// for a pose in no group. The levers are orthogonal in every pose, so that AᵀA is diagonal.
    Grouped { levers: DMatrix<f64>, groups: Vec<Option<usize>> },
}

impl Design {
    /// Creates the design with one column for every pose: the `lever` in that pose, 0 elsewhere.
    pub fn per_pose(lever: &DVector<f64>) -> Self {
        let levers = DMatrix::from_columns(std::slice::from_ref(lever));
        Self::Grouped { levers, groups: (0..lever.len() / 3).map(Some).collect() }
    }

    /// Returns the stored matrix: the columns or the levers.
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

    /// Scales all columns by one factor, so that their root mean square over the first `poses`
    /// poses is 1; `None` if they are zero there.
    pub fn scaled(mut self, poses: usize) -> Option<Self> {
        let first = self.values().rows(0, 3 * poses);
        let size = (first.norm_squared() / first.nrows().max(1) as f64).sqrt();
        let is_seen = size > 0.0 && size.is_finite();
        *self.values_mut() /= if is_seen { size } else { 1.0 };
        is_seen.then_some(self)
    }

    /// Sets the rows of some poses to zero.
    pub fn without(mut self, poses: &[usize]) -> Self {
        for &pose in poses {
            self.values_mut().rows_mut(3 * pose, 3).fill(0.0);
        }
        self
    }

    /// Returns all columns as a full matrix, shape = (3 N, k).
    pub fn columns(&self) -> Cow<'_, DMatrix<f64>> {
        match self {
            Self::Dense(columns) => Cow::Borrowed(columns),
            Self::Grouped { levers, groups } => {
                let group_count = group_count(groups);
                Cow::Owned(DMatrix::from_fn(
                    levers.nrows(),
                    levers.ncols() * group_count,
                    |row, j| {
                        if groups[row / 3] == Some(j % group_count) {
                            levers[(row, j / group_count)]
                        } else {
                            0.0
                        }
                    },
                ))
            }
        }
    }
}

/// Returns the number of groups.
fn group_count(groups: &[Option<usize>]) -> usize {
    groups.iter().flatten().max().map_or(0, |last| last + 1)
}

/// Returns the product M A of the matrix M (`rows`) with grouped columns A, shape = (rows of M, k).
fn times_grouped(
    rows: &DMatrix<f64>,
    levers: &DMatrix<f64>,
    groups: &[Option<usize>],
) -> DMatrix<f64> {
    let group_count = group_count(groups);
    let mut product = DMatrix::zeros(rows.nrows(), levers.ncols() * group_count);
    for (pose, group) in
        groups.iter().enumerate().filter_map(|(pose, group)| Some((pose, (*group)?)))
    {
        let here = rows.columns(3 * pose, 3);
        for (k, lever) in levers.column_iter().enumerate() {
            product.column_mut(k * group_count + group).gemv(
                1.0,
                &here,
                &lever.rows(3 * pose, 3),
                1.0,
            );
        }
    }
    product
}

/// Returns AᵀA and Aᵀr of the columns A of [`Design::Grouped`], with the fitted parameters
/// projected out.
fn grouped_products(
    levers: &DMatrix<f64>,
    groups: &[Option<usize>],
    fit: &LinearNeighbourhood,
) -> Normal {
    let squares = levers.map(|value| value * value);
    let diagonal =
        times_grouped(&DMatrix::repeat(1, squares.nrows(), 1.0), &squares, groups).transpose();
    let residual = fit.residual().rows(0, levers.nrows()).transpose();
    let product = times_grouped(&DMatrix::from_rows(&[residual]), levers, groups).transpose();
    let normal = Normal::LowRankCorrection {
        diagonal: diagonal.column(0).into_owned(),
        less: times_grouped(&fit.fitted().transpose(), levers, groups),
        product: product.column(0).into_owned(),
    };
    normal.dense_if_cheaper()
}

/// Columns of one hypothesis, with the fitted parameters projected out, and the logarithm of its
/// prior probability.
#[derive(Clone)]
pub(super) struct Block {
    columns: Columns,
    /// Products AᵀA and Aᵀr of the projected columns.
    normal: Normal,
    /// Cached factors of AᵀA, if the block has many columns.
    factors: Factors,
    /// ln of the prior probability of the hypothesis.
    pub ln_prior: f64,
    /// Prior on the coefficients of the columns.
    coefficients: Coefficients,
    /// True if the hypothesis is a function of several covariates.
    pub is_surface: bool,
    /// True if the hypothesis is a periodic error with many orders, whose coefficients have one
    /// prior.
    pub is_periodic_of_many_orders: bool,
    /// Name of the family of the hypothesis' effect; `None` for a function without a law.
    pub family: Option<String>,
    /// Joint, from 0, whose command error the effect describes; `None` for other hypotheses.
    pub joint: Option<usize>,
    /// True if the hypothesis is a formula found by the search for laws. It excludes all other
    /// hypotheses at its joint.
    pub is_whole_law: bool,
}

#[derive(Debug, Clone)]
enum Columns {
    /// Columns as [`LinearNeighbourhood::with_components`] returns them: the fitted parameters are
    /// projected out of some only.
    Dense(DMatrix<f64>),
    /// Grouped columns before the projection.
    Grouped { levers: DMatrix<f64>, groups: Vec<Option<usize>> },
}

impl Block {
    /// Creates a block from columns of root mean square 1.
    #[cfg(test)]
    pub fn new(
        design: Design,
        fit: &LinearNeighbourhood,
        ln_prior: f64,
        coefficients: Coefficients,
    ) -> Self {
        Self::all(vec![(design, ln_prior, coefficients)], fit).remove(0)
    }

    /// Creates a block from each design of root mean square 1, the logarithm of its prior
    /// probability, and the prior on its coefficients. The components of all columns along the
    /// fitted parameters are computed in one product, which is faster.
    pub fn all(designs: Vec<(Design, f64, Coefficients)>, fit: &LinearNeighbourhood) -> Vec<Self> {
        let Some((design, ..)) = designs.first() else { return Vec::new() };
        let rows = design.values().nrows();
        let dense = designs.iter().filter_map(|(design, ..)| {
            if let Design::Dense(columns) = design { Some(columns) } else { None }
        });
        let mut dense_columns = DMatrix::zeros(rows, dense.clone().map(DMatrix::ncols).sum());
        let columns = dense.flat_map(DMatrix::column_iter);
        dense_columns
            .column_iter_mut()
            .zip(columns)
            .for_each(|(mut target, column)| target.copy_from(&column));
        let (all_columns, all_along) = fit.with_components(&dense_columns);
        let mut first = 0;
        let of = |(design, ln_prior, coefficients): (Design, f64, Coefficients)| {
            let (columns, normal) = match design {
                Design::Dense(columns) => {
                    let columns = all_columns.columns(first, columns.ncols()).clone_owned();
                    let along = all_along.columns(first, columns.ncols());
                    first += columns.ncols();
                    let mut gram = DMatrix::zeros(columns.ncols(), columns.ncols());
                    // Transposing the narrow matrix gives the fastest product.
                    gram.gemm(1.0, &columns.transpose(), &columns, 0.0);
                    gram.gemm(-1.0, &along.transpose(), &along, 1.0);
                    let product = columns.tr_mul(fit.residual());
                    (Columns::Dense(columns), Normal::Dense { product, gram })
                }
                Design::Grouped { levers, groups } => {
                    let normal = grouped_products(&levers, &groups, fit);
                    (Columns::Grouped { levers, groups }, normal)
                }
            };
            Self {
                columns,
                normal,
                factors: Factors::default(),
                ln_prior,
                coefficients,
                is_surface: false,
                is_periodic_of_many_orders: false,
                family: None,
                joint: None,
                is_whole_law: false,
            }
        };
        designs.into_iter().map(of).collect()
    }

    /// Returns true if two blocks cannot act together: one is a formula found by the search for
    /// laws, and the other acts at the same joint.
    pub fn excludes(&self, other: &Self) -> bool {
        let is_same_joint = self.joint.is_some() && self.joint == other.joint;
        is_same_joint && (self.is_whole_law || other.is_whole_law)
    }

    /// Returns true if the hypothesis is an effect, which has a law.
    pub fn is_law(&self) -> bool {
        self.family.is_some()
    }

    /// Returns true if a set with this block is not extended: the block is a periodic error with
    /// many orders, or has more than [`MAX_WIDE_COLUMNS`] grouped columns.
    pub fn is_wide(&self) -> bool {
        self.is_periodic_of_many_orders
            || matches!(&self.columns, Columns::Grouped { levers, groups } if levers.ncols() * group_count(groups) > MAX_WIDE_COLUMNS)
    }

    /// Returns the columns A of the hypothesis, with the fitted parameters projected out.
    pub fn columns(&self, fit: &LinearNeighbourhood) -> DMatrix<f64> {
        fit.projected_out(&self.unprojected())
    }

    /// Returns columns that are A once the fitted parameters are projected out: as they are stored,
    /// or grouped columns written out.
    pub fn unprojected(&self) -> Cow<'_, DMatrix<f64>> {
        match &self.columns {
            Columns::Dense(columns) => Cow::Borrowed(columns),
            Columns::Grouped { levers, groups } => {
                let design = Design::Grouped { levers: levers.clone(), groups: groups.clone() };
                Cow::Owned(design.columns().into_owned())
            }
        }
    }

    /// Returns the product Aᵀr of the projected columns with the residual.
    pub fn product(&self) -> &DVector<f64> {
        self.normal.product()
    }

    /// Returns [`Self::unprojected`] columns if they are stored as a full matrix; `None` if they are
    /// stored as groups.
    pub fn dense(&self) -> Option<&DMatrix<f64>> {
        if let Columns::Dense(columns) = &self.columns { Some(columns) } else { None }
    }

    /// Returns MᵀA for grouped columns A and columns M from which the fitted parameters are
    /// projected out, given the transpose of M. The result has no columns if A is stored as a full
    /// matrix.
    pub fn times_grouped(&self, transposed: &DMatrix<f64>) -> DMatrix<f64> {
        match &self.columns {
            Columns::Grouped { levers, groups } => times_grouped(transposed, levers, groups),
            Columns::Dense(_) => DMatrix::zeros(transposed.nrows(), 0),
        }
    }

    /// Returns ln p(r | set and block) − ln p(r | set), and the most probable size of the block.
    ///
    /// `set` holds Z A (column by column) and Z r: the set reduces AᵀA by (Z A)ᵀZ A and Aᵀr by (Z
    /// A)ᵀZ r; it is `None` for the empty set. `squares_and_freedom` are the sum of squares that the
    /// set leaves, and its degrees of freedom. `without` is ln p(r | set).
    pub fn gain(
        &self,
        set: Option<(&[f64], &DVector<f64>)>,
        (squares_and_freedom, without): ((f64, f64), f64),
        grid: &NoiseGrid,
    ) -> (f64, f64) {
        let (along, residual_along) =
            set.map_or((&[][..], None), |(along, residual)| (along, Some(residual)));
        if let Normal::Dense { gram, product } = &self.normal
            && self.coefficients.is_any()
            && is_wide(product.len(), along.len() / product.len().max(1))
        {
            let mut product = product.clone();
            let along = DMatrixView::from_slice(along, along.len() / product.len(), product.len());
            if let Some(residual_along) = residual_along {
                product.gemv_tr(-1.0, &along, residual_along, 1.0);
            }
            let at = |size: f64| {
                let terms = self.factors.shrinkage_terms(gram, (along, &product), size);
                terms.map_or(f64::NEG_INFINITY, |(determinant, explained)| {
                    let squares = (squares_and_freedom.0 - explained).max(0.0);
                    grid.ln_likelihood(squares) - determinant
                })
            };
            let (with, size) = averaged(&DISPLACEMENTS, at);
            return (with - without, size);
        }
        let (with, size) = match set {
            None => self.ln_likelihood_over_sizes(&self.normal, squares_and_freedom, grid),
            Some((along, residual_along)) => self.ln_likelihood_over_sizes(
                &self.normal.reduced_by(along, residual_along),
                squares_and_freedom,
                grid,
            ),
        };
        (with - without, size)
    }

    /// Returns ln p(r | block), up to a constant, and the most probable size. `normal` and
    /// `squares_and_freedom` are those that remain after the other members of the set are projected
    /// out of columns and residual.
    pub fn ln_likelihood_over_sizes(
        &self,
        normal: &Normal,
        squares_and_freedom: (f64, f64),
        grid: &NoiseGrid,
    ) -> (f64, f64) {
        ln_likelihood_of_block(
            normal,
            squares_and_freedom,
            grid,
            (&DISPLACEMENTS, &self.coefficients),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::select::evidence::marginal::Noise;
    use crate::select::neighbourhood::Unknowns;

    /// Returns a matrix of pseudo-random numbers.
    fn matrix(rows: usize, columns: usize) -> DMatrix<f64> {
        DMatrix::from_fn(rows, columns, |i, j| {
            (12.9898 * i as f64 + 78.233 * (j + 1) as f64).sin() * 43.7 % 1.0
        })
    }

    #[test]
    fn a_column_for_every_pose_weighs_the_same_written_out() {
        let (jacobian, residual) = (matrix(36, 4), matrix(36, 6).column(5) * 4.0);
        let unknowns = Unknowns {
            x: vec![0.0; 4],
            priors: vec![None, Some(0.3), None, None],
            active: DMatrix::zeros(0, 4),
        };
        let fit = LinearNeighbourhood::new(&jacobian, &residual, &unknowns, 0);
        assert!(Block::all(Vec::new(), &fit).is_empty());
        let (within, grid) = (
            fit.projected_out(&matrix(36, 9).columns(7, 2).into_owned()).transpose() * 0.2,
            Noise { freedom: 30.0, ln_half_width: 0.1, min_ln_factor: 0.0 }.grid(),
        );
        let residual_along = &within * fit.residual();
        for is_beside in [true, false] {
            let groups = (0..12).map(|pose| (pose != 5).then_some(pose / 2)).collect();
            for grouped in [
                Design::per_pose(&matrix(36, 1).column(0).into_owned()),
                Design::Grouped { levers: matrix(36, 1), groups },
            ] {
                let grouped = grouped.scaled(12).unwrap().without(&[3]);
                let dense = Design::Dense(grouped.columns().into_owned());
                let [one, other] = [grouped, dense].map(|design| {
                    let block = Block::new(design, &fit, 0.0, Coefficients::default());
                    let along = match block.dense() {
                        Some(columns) => &within * columns,
                        None => block.times_grouped(&within),
                    };
                    let set = is_beside.then_some((along.as_slice(), &residual_along));
                    (block.gain(set, ((100.0, 30.0), 0.0), &grid), block.columns(&fit))
                });
                assert!(
                    (one.0.0 - other.0.0).abs() < 1e-9 && (one.0.1 - other.0.1).abs() < 1e-12,
                    "{one:?} {other:?}"
                );
                assert!((one.1 - other.1).amax() < 1e-12);
            }
        }
    }
}
