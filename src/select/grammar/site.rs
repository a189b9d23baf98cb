//! Gram matrix of the lever of one coordinate in all poses, with the parameters of the fit
//! projected out.

use nalgebra::{DMatrix, DVector};

use crate::least_squares::Triangle;
use crate::numeric::kernel::{add_product, few_transposed_times};

/// Number of intervals of the table of ln p(residual).
const NOISE_TABLE_POINTS: usize = 400;
/// Trial prior variances of the coefficients, relative to the variance of their estimates; equally
/// probable a priori.
const COEFFICIENT_VARIANCES: [f64; 3] = [300.0, 5000.0, 80_000.0];
/// Prior variance of the coefficients in the beam search, relative to the variance of their
/// estimates.
pub const BEAM_VARIANCE: f64 = 3000.0;
/// Smallest fraction of a column's squared length that lies outside the span of earlier columns for
/// the column to be added to the span.
const MIN_LEFT: f64 = 1e-4;

/// Number of rows of the triangular factor R that are multiplied together.
const ROWS_PER_PRODUCT: usize = 40;

/// Table of ln p(residual), integrated over the unknown noise factor, by the sum of squares of the
/// residual.
pub struct Noise {
    /// Sum of squares of the whitened residual if no term is added.
    squares: f64,
    /// Degrees of freedom of the residual.
    freedom: f64,
    /// Values of ln p for sums of squares of `squares` · (k / [`NOISE_TABLE_POINTS`])².
    table: Vec<f64>,
}

impl Noise {
    /// Tabulates the density from 0 to `squares`, the sum of squares of the residual with `freedom`
    /// degrees of freedom.
    pub fn new(squares: f64, freedom: f64, ln_density: impl Fn(f64) -> f64) -> Self {
        let at = |k: usize| squares * (k as f64 / NOISE_TABLE_POINTS as f64).powi(2);
        let table: Vec<f64> = (0..=NOISE_TABLE_POINTS).map(|k| ln_density(at(k))).collect();
        Self { squares, freedom: freedom.max(1.0), table }
    }

    /// Returns the squared noise factor f² if columns reduce the sum of squares by `reduction` and
    /// all that remains is noise.
    pub fn factor(&self, reduction: f64) -> f64 {
        ((self.squares - reduction) / self.freedom).max(1e-12)
    }

    /// Returns the gain in ln p(residual) if columns reduce the sum of squares by `reduction`, 0
    /// for none.
    pub fn gain(&self, reduction: f64) -> f64 {
        let relative_residual =
            ((self.squares - reduction).max(0.0) / self.squares.max(f64::MIN_POSITIVE)).sqrt();
        let position = relative_residual * NOISE_TABLE_POINTS as f64;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "an index")]
        let low = (position as usize).min(NOISE_TABLE_POINTS - 1);
        let part = position - low as f64;
        self.table[low] * (1.0 - part) + self.table[low + 1] * part - self.table[NOISE_TABLE_POINTS]
    }

    /// Returns ln of the evidence of `rank` independent columns that reduce the sum of squares by
    /// `squares`, relative to no column: the mean over [`COEFFICIENT_VARIANCES`].
    pub fn evidence(&self, squares: f64, rank: usize) -> f64 {
        let at = |variance: f64| {
            self.gain(squares * variance / (1.0 + variance))
                - 0.5 * rank as f64 * (1.0 + variance).ln()
        };
        let ln_of_variances = COEFFICIENT_VARIANCES.map(at);
        let most = ln_of_variances.into_iter().fold(f64::NEG_INFINITY, f64::max);
        most + (ln_of_variances.iter().map(|ln| (ln - most).exp()).sum::<f64>()
            / ln_of_variances.len() as f64)
            .ln()
    }
}

/// Products of columns at one coordinate of the model, with the fit projected out. An error f of
/// this coordinate, a function of the pose, has a column of squared length fᵀWf and of product fᵀp
/// with the residual. W = diag(d) − BᵀB; BᵀB is the part that the fitted parameters explain.
pub struct WhitenedSite {
    /// Vector d: squared length of the lever in each pose, shape = (poses).
    pub diagonal: DVector<f64>,
    /// Matrix R of the part RᵀR that the fitted parameters explain: W = diag(d) − RᵀR. It is B, or
    /// the upper triangular factor of B, shape = (poses, poses), if that takes less work.
    less: DMatrix<f64>,
    /// Vector p: product of each pose's column with the residual, shape = (poses).
    pub product: DVector<f64>,
}

/// Values of a function in all poses, and the weight matrix W times these values.
#[derive(Clone)]
pub struct Weighted {
    /// Values of the function, shape = (poses).
    pub values: DVector<f64>,
    /// Product of the weight matrix W with `values`, shape = (poses).
    pub times: DVector<f64>,
}

/// Functions of the pose that are orthonormal in W, with their products with the residual.
#[derive(Clone)]
pub struct Span {
    /// Orthonormal functions of the pose, shape = (poses, k).
    pub functions: DMatrix<f64>,
    /// Weight matrix W times the orthonormal functions, shape = (poses, k).
    pub weighted: DMatrix<f64>,
    /// Products of the functions with the residual; their squares sum to the explained sum of
    /// squares.
    pub along: DVector<f64>,
}

impl WhitenedSite {
    /// Creates the site from the vector d, the matrix B with one column for each pose, and the
    /// vector p.
    pub fn new(diagonal: DVector<f64>, b: &DMatrix<f64>, product: DVector<f64>) -> Self {
        let is_short = 2 * b.nrows() < b.ncols();
        let less = if is_short { b.clone() } else { Triangle::factor(b) };
        Self { diagonal, less, product }
    }

    /// Returns R times functions of the pose, one in each column of `functions`.
    pub fn within(&self, functions: &DMatrix<f64>) -> DMatrix<f64> {
        let (rows, poses) = self.less.shape();
        let mut out = DMatrix::zeros(rows, functions.ncols());
        if rows < poses {
            out.gemm(1.0, &self.less, functions, 0.0);
            return out;
        }
        for first in (0..poses).step_by(ROWS_PER_PRODUCT) {
            let (count, filled) = (ROWS_PER_PRODUCT.min(poses - first), poses - first);
            let rows = self.less.view((first, first), (count, filled));
            out.rows_mut(first, count).gemm(1.0, &rows, &functions.rows(first, filled), 0.0);
        }
        out
    }

    /// Returns the weight matrix W times a function of the pose.
    pub fn times(&self, function: &DVector<f64>) -> DVector<f64> {
        let mut along = DMatrix::zeros(self.less.nrows(), 1);
        let columns = (self.less.as_slice(), self.less.nrows());
        add_product(along.as_mut_slice(), columns, function.as_slice());
        let within = few_transposed_times(&along, &self.less);
        let weighted = self.diagonal.iter().zip(function.iter());
        let values = weighted.zip(within.iter()).map(|((d, f), less)| d * f - less);
        DVector::from_iterator(function.len(), values)
    }

    /// Returns the largest sum of squares that a function of the pose can explain: that of one free
    /// value per pose.
    pub fn explainable(&self) -> f64 {
        let n = self.diagonal.len();
        let mut gram = DMatrix::from_diagonal(&self.diagonal);
        gram.gemm(-1.0, &self.less.transpose(), &self.less, 1.0);
        let ridge = 1e-6 * gram.trace() / n.max(1) as f64;
        (0..n).for_each(|k| gram[(k, k)] += ridge);
        let solved = gram.cholesky().map(|factor| factor.solve(&self.product));
        solved.map_or(0.0, |solved| solved.dot(&self.product))
    }

    /// Returns functions of the pose together with W times each of them.
    pub fn weighted(&self, functions: Vec<DVector<f64>>) -> Vec<Weighted> {
        let weighted = |values: DVector<f64>| Weighted { times: self.times(&values), values };
        functions.into_iter().map(weighted).collect()
    }

    /// Returns the span of no function.
    pub fn empty_span(&self) -> Span {
        let n = self.diagonal.len();
        Span {
            functions: DMatrix::zeros(n, 0),
            weighted: DMatrix::zeros(n, 0),
            along: DVector::zeros(0),
        }
    }

    /// Returns the span of some functions of the pose. Functions that depend linearly on earlier
    /// ones or on the fit are left out.
    pub fn span(&self, functions: Vec<DVector<f64>>) -> Span {
        let mut span = self.empty_span();
        span.extend(&self.weighted(functions), &self.product);
        span
    }
}

impl Weighted {
    /// Returns the squared length fᵀWf, in units of the noise variance.
    pub fn squared_length(&self) -> f64 {
        self.values.dot(&self.times)
    }

    /// Returns the squared length (f − g)ᵀW(f − g) of the difference from another function g, in
    /// units of the noise variance.
    pub fn squared_distance(&self, other: &Self) -> f64 {
        let pairs = self.values.iter().zip(&other.values);
        let weighted = self.times.iter().zip(&other.times);
        pairs.zip(weighted).map(|((f, g), (wf, wg))| (f - g) * (wf - wg)).sum()
    }
}

impl Span {
    /// Adds functions to the span; those that depend linearly on earlier ones or on the fit are
    /// left out. `product` is the vector p of the site.
    pub fn extend(&mut self, functions: &[Weighted], product: &DVector<f64>) {
        for Weighted { values, times } in functions {
            let (mut left, mut weighted) = (values.clone(), times.clone());
            let whole = left.dot(&weighted);
            for _ in 0..2 {
                let along = self.functions.tr_mul(&weighted);
                left.gemv(-1.0, &self.functions, &along, 1.0);
                weighted.gemv(-1.0, &self.weighted, &along, 1.0);
            }
            let length = left.dot(&weighted);
            if length.is_nan() || length <= MIN_LEFT * whole || whole <= 0.0 {
                continue;
            }
            let scale = length.sqrt().recip();
            let k = self.along.len();
            let add = |matrix: &mut DMatrix<f64>, column: DVector<f64>| {
                *matrix = std::mem::take(matrix).resize_horizontally(k + 1, 0.0);
                matrix.set_column(k, &(column * scale));
            };
            add(&mut self.functions, left);
            add(&mut self.weighted, weighted);
            let along = self.functions.column(k).dot(product);
            self.along = std::mem::take(&mut self.along).push(along);
        }
    }

    /// Returns the sum of squares of the residual that the span explains.
    pub fn explained_squares(&self) -> f64 {
        self.along.norm_squared()
    }

    /// Returns the function of the span that fits the residual best (least squares).
    pub fn prediction(&self) -> Weighted {
        Weighted { values: &self.functions * &self.along, times: &self.weighted * &self.along }
    }
}
