//! A fit in its linear neighbourhood: what its residual can still give to columns that were not fitted.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::open::open;
use super::score::{Score, Sums};

/// A direction is taken to be spanned by others when less than this part of its length is new.
const SPANNED: f64 = 1e-9;
/// A direction is decided by a block alone when less than this part of it is left without the block.
const LEAST_DECIDED: f64 = 1e-6;
/// Least diagonal of a Cholesky factor that can be trusted.
const CLOSE_TO_DEPENDENT: f64 = 1e-6;

/// Residual and fitted directions of N poses, with a row for each prior below the data's 3 N.
#[derive(Debug, Clone)]
pub(crate) struct Linear {
    /// Whitened residual at the optimum, priors below.
    residual: DVector<f64>,
    /// Orthonormal columns that span what was fitted.
    basis: DMatrix<f64>,
    /// Rows that are data.
    rows: usize,
    /// Sums of squares, with priors and of the data alone, and degrees of freedom of the data.
    sums: Sums,
}

impl Linear {
    /// From the Jacobian ∂r/∂x, shape = (3 N, n), the residual r, for each unknown its place and prior σ, and the rows of
    /// the constraints that hold them, shape = (constraints, n).
    pub fn new(
        jacobian: &DMatrix<f64>,
        residual: &DVector<f64>,
        x: &[f64],
        priors: &[Option<f64>],
        closed: &DMatrix<f64>,
    ) -> Self {
        let (rows, n) = jacobian.shape();
        let known: Vec<(usize, f64)> = priors.iter().enumerate().filter_map(|(j, &sigma)| Some((j, sigma?))).collect();
        let mut all = DMatrix::zeros(rows + known.len(), n);
        all.rows_mut(0, rows).copy_from(jacobian);
        let mut long = DVector::zeros(rows + known.len());
        long.rows_mut(0, rows).copy_from(residual);
        for (row, &(j, sigma)) in known.iter().enumerate() {
            all[(rows + row, j)] = sigma.recip();
            long[rows + row] = x[j] / sigma;
        }
        let scale: Vec<f64> = all.column_iter().map(|c| c.norm()).map(|s| if s > 0.0 { s } else { 1.0 }).collect();
        if let Some(open) = open(closed, &scale) {
            all.column_iter_mut().zip(&scale).for_each(|(mut column, scale)| column /= *scale);
            all *= open;
        }
        if let Some(basis) = orthonormal(&all) {
            let along = basis.tr_mul(&long);
            let residual = long - &basis * along;
            let mut linear = Self { residual, basis, rows, sums: Sums::default() };
            linear.sum(0);
            return linear;
        }
        let basis = DMatrix::zeros(all.nrows(), 0);
        let mut linear = Self { residual: long, basis, rows, sums: Sums::default() };
        linear.fit(&all);
        linear
    }

    /// What is left in numbers.
    pub fn sums(&self) -> Sums {
        self.sums
    }

    /// What would be left without some of the directions that were fitted: orthonormal, shape = (3 N + priors, k), with the
    /// part of the residual that they took off.
    pub fn sums_without(&self, directions: &DMatrix<f64>, given: &DVector<f64>) -> Sums {
        let freed = directions.rows(0, self.rows).norm_squared();
        Sums::of(&(&self.residual + directions * given), self.rows, self.sums.data_freedom + freed)
    }

    /// Data rows, 3 N.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Q, the data's rows of the orthonormal factor: H = Q Qᵀ.
    pub fn fitted(&self) -> DMatrix<f64> {
        self.basis.rows(0, self.rows).into_owned()
    }

    /// Whitened residuals of the data.
    pub fn data_residual(&self) -> DVector<f64> {
        self.residual.rows(0, self.rows).into_owned()
    }

    /// Sums anew once the columns from `first` on have been fitted.
    fn sum(&mut self, first: usize) {
        let before = if first == 0 { self.rows as f64 } else { self.sums.data_freedom };
        let taken = self.basis.view((0, first), (self.rows, self.basis.ncols() - first)).norm_squared();
        self.sums = Sums::of(&self.residual, self.rows, before - taken);
    }

    /// What [`Linear::freedom`] is to be expected to be where the priors are true: rows, priors included, less what was fitted.
    pub fn expected_freedom(&self) -> f64 {
        (self.basis.nrows() - self.basis.ncols()) as f64
    }

    /// Fits further directions, shape = (3 N + priors, k), and takes them off the residual.
    fn fit(&mut self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let first = self.basis.ncols();
        let mut found = first;
        let mut basis = std::mem::take(&mut self.basis).resize_horizontally(first + columns.ncols(), 0.0);
        for column in columns.column_iter() {
            let length = column.norm();
            if length == 0.0 || !length.is_finite() {
                continue;
            }
            let mut column = column / length;
            // Twice is enough [Giraud, Langou & Rozložník 2005].
            for _ in 0..2 {
                let known = basis.columns(0, found);
                let along = known.tr_mul(&column);
                column.gemv(-1.0, &known, &along, 1.0);
            }
            let new = column.norm();
            if new > SPANNED {
                basis.set_column(found, &(column / new));
                found += 1;
            }
        }
        self.basis = basis.resize_horizontally(found, 0.0);
        let added = self.basis.columns_range(first..).into_owned();
        let along = added.tr_mul(&self.residual);
        self.residual -= &added * along;
        self.sum(first);
        added
    }

    /// Fits further columns of the data, shape = (3 N, k); gives the new orthonormal directions.
    pub fn add(&mut self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        let mut long = DMatrix::zeros(self.residual.len(), columns.ncols());
        long.rows_mut(0, self.rows).copy_from(columns);
        self.fit(&long)
    }

    /// Part of the residual along orthonormal directions.
    pub fn along(&self, directions: &DMatrix<f64>) -> DVector<f64> {
        directions.tr_mul(&self.residual)
    }

    /// What the residual says about columns, shape = (3 N, k).
    pub fn score(&self, columns: &DMatrix<f64>) -> Score {
        self.projected(columns, &self.basis.rows(0, self.rows).tr_mul(columns))
    }

    /// The same of several sets of columns, multiplied together.
    pub fn scores(&self, sets: &[DMatrix<f64>]) -> Vec<Score> {
        let columns = DMatrix::from_columns(&sets.iter().flat_map(DMatrix::column_iter).collect::<Vec<_>>());
        // The narrow side is transposed: this is the product that is fast.
        let along = (columns.transpose() * self.basis.rows(0, self.rows)).transpose();
        let mut first = 0;
        let mut next = |set: &DMatrix<f64>| {
            first += set.ncols();
            self.projected(set, &along.columns(first - set.ncols(), set.ncols()).into_owned())
        };
        sets.iter().map(&mut next).collect()
    }

    /// The score of columns that have Qᵀ C along what was fitted.
    fn projected(&self, columns: &DMatrix<f64>, along: &DMatrix<f64>) -> Score {
        let gram = columns.tr_mul(columns) - along.tr_mul(along);
        let product = columns.tr_mul(&self.residual.rows(0, self.rows));
        Score { gram, product, lengths: columns.column_iter().map(|column| column.norm_squared()).collect() }
    }

    /// The columns with everything fitted projected out, shape = (3 N + priors, k), orthonormal; dependent ones dropped.
    pub fn directions(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        self.clone().add(columns)
    }

    /// Largest principal angle [rad] between what two sets of columns add to the fit; `None` where one of them adds nothing.
    pub fn angle(&self, one: &DMatrix<f64>, other: &DMatrix<f64>) -> Option<f64> {
        let (a, b) = (self.directions(one), self.directions(other));
        if a.is_empty() || b.is_empty() {
            return None;
        }
        let cosines = a.tr_mul(&b).singular_values();
        cosines.iter().copied().reduce(f64::min).map(|cosine| cosine.clamp(0.0, 1.0).acos())
    }

    /// Sum of squared residuals of poses that are left out, block by block, from the fit without them.
    ///
    /// `block` holds the block of each pose. A left-out residual is (I − H_bb)⁻¹ r_b, by Woodbury's identity
    /// r_b + Q_b (I − Q_bᵀQ_b)⁻¹ Q_bᵀ r_b. A direction that a block alone decides is left as it was fitted.
    pub fn cross_validate(&self, block: &[usize]) -> Option<f64> {
        let blocks = block.iter().max().map_or(0, |last| last + 1);
        let n = self.basis.ncols();
        let left_out = |number: usize| {
            let rows: Vec<usize> = (0..self.rows).filter(|row| block[row / 3] == number).collect();
            let (basis, residual) = (self.basis.select_rows(&rows), self.residual.select_rows(&rows));
            let inner = DMatrix::identity(n, n) - basis.transpose() * &basis;
            let step = solve(inner, &basis.tr_mul(&residual));
            (residual + basis * step).norm_squared()
        };
        let sums: Vec<f64> = (0..blocks).into_par_iter().map(left_out).collect();
        let sum: f64 = sums.iter().sum();
        sum.is_finite().then_some(sum)
    }
}

/// Solves with a symmetric matrix of eigenvalues from 0 to 1; nothing along those that are nearly 0.
fn solve(matrix: DMatrix<f64>, right: &DVector<f64>) -> DVector<f64> {
    if let Some(factor) = matrix.clone().cholesky()
        && factor.l_dirty().diagonal().iter().all(|value| value * value > LEAST_DECIDED)
    {
        return factor.solve(right);
    }
    let eigen = matrix.symmetric_eigen();
    let inverted = eigen.eigenvalues.map(|value| if value > LEAST_DECIDED { value.recip() } else { 0.0 });
    &eigen.eigenvectors * eigen.eigenvectors.tr_mul(right).component_mul(&inverted)
}

/// Orthonormal columns with the same span, by Cholesky factors of the Gram matrix, twice [Yamamoto et al. 2015]; `None` where
/// the columns are too close to dependent for that.
fn orthonormal(columns: &DMatrix<f64>) -> Option<DMatrix<f64>> {
    let mut basis = columns.clone();
    for mut column in basis.column_iter_mut() {
        let length = column.norm();
        if length == 0.0 || !length.is_finite() {
            return None;
        }
        column /= length;
    }
    for _ in 0..2 {
        let factor = (basis.transpose() * &basis).cholesky()?.l();
        if factor.diagonal().min() < CLOSE_TO_DEPENDENT {
            return None;
        }
        // Q = A L⁻ᵀ, by columns of Qᵀ = L⁻¹ Aᵀ.
        let inverse = factor.solve_lower_triangular(&DMatrix::identity(factor.nrows(), factor.nrows()))?;
        basis *= inverse.transpose();
    }
    Some(basis)
}
