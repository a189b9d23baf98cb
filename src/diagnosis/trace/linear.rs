//! A fit in its linear neighbourhood: what its residual can still give to columns that were not fitted.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use statrs::distribution::{ContinuousCDF as _, FisherSnedecor};

/// A direction is taken to be spanned by others when less than this part of its length is new.
const SPANNED: f64 = 1e-9;
/// Least diagonal of a Cholesky factor that can be trusted.
const CLOSE_TO_DEPENDENT: f64 = 1e-6;
/// A candidate is absorbed by the fit when less than this part of a column's length is new.
const ABSORBED: f64 = 1e-4;

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

/// What is asked for again and again.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    squares: f64,
    data_squares: f64,
    data_freedom: f64,
}

/// What the residual says about columns that were not fitted.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Score {
    /// C̃ᵀC̃ of the columns with everything fitted projected out.
    pub gram: DMatrix<f64>,
    /// C̃ᵀr.
    pub product: DVector<f64>,
    /// ‖C‖² of each column before the projection.
    pub lengths: Vec<f64>,
}

/// What a fit would gain by a candidate, and how probable that gain is by chance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Gain {
    /// Reduction of the sum of squares.
    pub squares: f64,
    /// New directions.
    pub freedom: usize,
    /// F statistic.
    pub f: f64,
    /// Probability of as large an F by chance, for one candidate alone.
    pub p: f64,
    /// Change of ν ln(squares) + k ln ν: an information criterion without regard to how many candidates there are.
    pub criterion: f64,
}

impl Linear {
    /// From the Jacobian ∂r/∂x, shape = (3 N, n), the residual r, and for each unknown its place and prior σ.
    pub fn new(jacobian: &DMatrix<f64>, residual: &DVector<f64>, x: &[f64], priors: &[Option<f64>]) -> Self {
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

    /// Sum of squares, priors included.
    pub fn squares(&self) -> f64 {
        self.sums.squares
    }

    /// Sums anew once the columns from `first` on have been fitted.
    fn sum(&mut self, first: usize) {
        let before = if first == 0 { self.rows as f64 } else { self.sums.data_freedom };
        let taken = self.basis.view((0, first), (self.rows, self.basis.ncols() - first)).norm_squared();
        self.sums = Sums {
            squares: self.residual.norm_squared(),
            data_squares: self.residual.rows(0, self.rows).norm_squared(),
            data_freedom: before - taken,
        };
    }

    /// Degrees of freedom of the whole sum of squares at the scatter of the data.
    ///
    /// With true priors it has 3 N, with priors far wider than the deviations 3 N − tr H: the data's scatter decides.
    pub fn freedom(&self) -> f64 {
        self.sums.data_freedom * self.sums.squares / self.sums.data_squares.max(f64::MIN_POSITIVE)
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
        let data = self.basis.rows(0, self.rows);
        let along = data.tr_mul(columns);
        let gram = columns.tr_mul(columns) - along.tr_mul(&along);
        let product = columns.tr_mul(&self.residual.rows(0, self.rows));
        Score { gram, product, lengths: columns.column_iter().map(|column| column.norm_squared()).collect() }
    }

    /// The columns with everything fitted projected out, shape = (3 N + priors, k), orthonormal; dependent ones dropped.
    pub fn directions(&self, columns: &DMatrix<f64>) -> DMatrix<f64> {
        self.clone().add(columns)
    }

    /// What the fit gains by columns with this score.
    pub fn gain(&self, score: &Score) -> Option<Gain> {
        let (squares, freedom) = score.reduction()?;
        self.gain_of(squares, freedom)
    }

    /// What a reduction of the sum of squares by so many new directions means.
    pub fn gain_of(&self, squares: f64, freedom: usize) -> Option<Gain> {
        let (total, degrees) = (self.squares(), self.freedom());
        let left = degrees - freedom as f64;
        if left < 1.0 {
            return None;
        }
        let part = (squares / total).clamp(0.0, 1.0 - 1e-15);
        let f = part / (1.0 - part) * left / freedom as f64;
        let p = FisherSnedecor::new(freedom as f64, left).map_or(1.0, |chance| chance.sf(f)).max(f64::MIN_POSITIVE);
        let criterion = degrees * (-part).ln_1p() + freedom as f64 * degrees.ln();
        Some(Gain { squares, freedom, f, p, criterion })
    }

    /// Sum of squared residuals of poses that are left out, block by block, from the fit without them.
    ///
    /// `block` holds the block of each pose. A left-out residual is (I − H_bb)⁻¹ r_b, by Woodbury's identity
    /// r_b + Q_b (I − Q_bᵀQ_b)⁻¹ Q_bᵀ r_b; `None` where a block alone decides a direction.
    pub fn cross_validate(&self, block: &[usize]) -> Option<f64> {
        let blocks = block.iter().max().map_or(0, |last| last + 1);
        let n = self.basis.ncols();
        let left_out = |number: usize| {
            let rows: Vec<usize> = (0..self.rows).filter(|row| block[row / 3] == number).collect();
            let (basis, residual) = (self.basis.select_rows(&rows), self.residual.select_rows(&rows));
            let inner = DMatrix::identity(n, n) - basis.transpose() * &basis;
            let left_out = &residual + &basis * inner.cholesky()?.solve(&basis.tr_mul(&residual));
            Some(left_out.norm_squared())
        };
        let sums: Option<Vec<f64>> = (0..blocks).into_par_iter().map(left_out).collect();
        let sum: f64 = sums?.iter().sum();
        sum.is_finite().then_some(sum)
    }
}

impl Score {
    /// What the fit would make of the columns' parameters, −G⁺b, each with its standard error for residuals of unit scatter.
    pub fn estimates(&self) -> Vec<(f64, f64)> {
        let k = self.lengths.len();
        let scale: Vec<f64> = self.lengths.iter().map(|l| if *l > 0.0 { l.sqrt() } else { 1.0 }).collect();
        let eigen = DMatrix::from_fn(k, k, |i, j| self.gram[(i, j)] / (scale[i] * scale[j])).symmetric_eigen();
        let inverted = eigen.eigenvalues.map(|value| if value > ABSORBED * ABSORBED { value.recip() } else { 0.0 });
        let inverse = &eigen.eigenvectors * DMatrix::from_diagonal(&inverted) * eigen.eigenvectors.transpose();
        let product = DVector::from_fn(k, |i, _| self.product[i] / scale[i]);
        let estimate = &inverse * product;
        (0..k).map(|i| (-estimate[i] / scale[i], inverse[(i, i)].max(0.0).sqrt() / scale[i])).collect()
    }

    /// bᵀ G⁺ b and the rank of G, scaled columns; `None` where nothing new is left of them.
    fn reduction(&self) -> Option<(f64, usize)> {
        let scale = DVector::from_iterator(self.lengths.len(), self.lengths.iter().map(|length| length.sqrt()));
        let kept: Vec<usize> = (0..scale.len()).filter(|&j| scale[j] > 0.0).collect();
        if kept.is_empty() {
            return None;
        }
        let gram = DMatrix::from_fn(kept.len(), kept.len(), |i, j| {
            self.gram[(kept[i], kept[j])] / (scale[kept[i]] * scale[kept[j]])
        });
        let product = DVector::from_fn(kept.len(), |i, _| self.product[kept[i]] / scale[kept[i]]);
        let eigen = gram.symmetric_eigen();
        let mut sum = 0.0;
        let mut rank = 0;
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *value > ABSORBED * ABSORBED {
                sum += vector.dot(&product).powi(2) / value;
                rank += 1;
            }
        }
        (rank > 0).then_some((sum, rank))
    }

    /// Takes off directions that have been fitted since: `along` = Cᵀq, `given` = qᵀr before they were fitted.
    pub fn take_off(&mut self, along: &DMatrix<f64>, given: &DVector<f64>) {
        self.gram -= along * along.transpose();
        self.product -= along * given;
    }
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
