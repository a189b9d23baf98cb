//! Evaluation of every candidate as an additional pose, by low-rank updates.

use std::ops::Range;

use nalgebra::{DMatrix, DMatrixView, DVector, SMatrix, SVector};

use super::criterion::{Measure, ScaledCriterion, block};
use super::views::COMPRESSED_ROWS;
use crate::numeric::bisect;
use crate::numeric::parallel;

/// Number of candidates whose products are computed in one matrix product.
const BLOCK_CANDIDATES: usize = 256;
/// Number of bisections that locate the largest eigenvalue.
const EIGENVALUE_BISECTIONS: usize = 50;

/// Information without one of the poses, prepared for trying candidates in its place.
///
/// One more pose J (3 rows, 6 with its orientation) changes C to C − W S⁻¹ Wᵀ with W = C Jᵀ and S =
/// I + J C Jᵀ [Fedorov 1972, ch. 3].
pub(super) struct CandidateScan<'a> {
    criterion: &'a ScaledCriterion,
    /// Covariance C of the unknowns if the pose that is to be replaced is left out, shape =
    /// (unknowns, unknowns).
    covariance: DMatrix<f64>,
    /// ln of the design criterion if the pose that is to be replaced is left out.
    value: f64,
    state: State<'a>,
}

/// Quantities that the measure of the criterion needs for all candidates.
enum State<'a> {
    /// Inverse of the information block of the nuisance unknowns.
    Determinant(DMatrix<f64>),
    Product,
    Trace {
        weights: &'a DVector<f64>,
        before: f64,
    },
    Mean {
        goal: &'a DMatrix<f64>,
        before: f64,
    },
    /// Eigenvalues Λ of F C Fᵀ = Q Λ Qᵀ, and Qᵀ F.
    Eigenvalue {
        values: DVector<f64>,
        rotated: DMatrix<f64>,
    },
}

impl<'a> CandidateScan<'a> {
    /// Prepares the scan for the information M of the other poses; `None` if M is singular.
    pub fn new(criterion: &'a ScaledCriterion, information: &DMatrix<f64>) -> Option<Self> {
        let covariance = information.clone().cholesky()?.inverse();
        let state = match &criterion.measure {
            Measure::Determinant => {
                State::Determinant(block(information, &criterion.nuisance).cholesky()?.inverse())
            }
            Measure::Product => State::Product,
            Measure::Trace(weights) => {
                State::Trace { weights, before: covariance.diagonal().dot(weights) }
            }
            Measure::Mean(goal) => State::Mean { goal, before: covariance.dot(goal) },
            Measure::Eigenvalue(combinations) => {
                let eigen =
                    (combinations * &covariance * combinations.transpose()).symmetric_eigen();
                let rotated = eigen.eigenvectors.transpose() * combinations;
                State::Eigenvalue { values: eigen.eigenvalues, rotated }
            }
        };
        Some(Self { criterion, covariance, value: criterion.value(information), state })
    }

    /// Returns the index and the logarithm of the criterion of the best candidate for which
    /// `is_allowed` is true; the first if several are equal. `None` if none is below `limit`.
    ///
    /// `candidates` holds Jᵀ of all candidates, shape = (unknowns, coordinates · candidates).
    pub fn best(
        &self,
        (candidates, coordinates): (&DMatrix<f64>, usize),
        is_allowed: impl Fn(usize) -> bool + Sync,
        limit: f64,
    ) -> Option<(usize, f64)> {
        match coordinates {
            6 => self.best_of_all::<6>(candidates, is_allowed, limit),
            COMPRESSED_ROWS => self.best_of_all::<COMPRESSED_ROWS>(candidates, is_allowed, limit),
            _ => self.best_of_all::<3>(candidates, is_allowed, limit),
        }
    }

    /// Evaluates all candidates in blocks, in parallel; R is the number of coordinates of a pose.
    fn best_of_all<const R: usize>(
        &self,
        candidates: &DMatrix<f64>,
        is_allowed: impl Fn(usize) -> bool + Sync,
        limit: f64,
    ) -> Option<(usize, f64)>
    where
        Square<R>: Small,
    {
        let count = candidates.ncols() / R;
        let best = parallel::map(count.div_ceil(BLOCK_CANDIDATES), |block| {
            let start = block * BLOCK_CANDIDATES;
            let range = start..(start + BLOCK_CANDIDATES).min(count);
            self.best_of::<R>(candidates, range, &is_allowed, limit)
        });
        best.into_iter().flatten().reduce(|best, next| if next.1 < best.1 { next } else { best })
    }

    /// Evaluates a range of the candidates; `None` if no value is below `limit`.
    fn best_of<const R: usize>(
        &self,
        candidates: &DMatrix<f64>,
        range: Range<usize>,
        is_allowed: impl Fn(usize) -> bool,
        mut limit: f64,
    ) -> Option<(usize, f64)>
    where
        Square<R>: Small,
    {
        let mut best = None;
        let rows = candidates.columns(R * range.start, R * range.len());
        let w_all = &self.covariance * rows;
        // Products that the measure needs for each candidate in addition to W.
        let products = match &self.state {
            State::Determinant(inverse) => inverse * rows.select_rows(&self.criterion.nuisance),
            State::Product => DMatrix::zeros(0, w_all.ncols()),
            State::Trace { weights, .. } => {
                DMatrix::from_fn(w_all.nrows(), w_all.ncols(), |i, k| weights[i] * w_all[(i, k)])
            }
            State::Mean { goal, .. } => *goal * &w_all,
            State::Eigenvalue { rotated, .. } => rotated * &w_all,
        };
        for k in (0..range.len()).filter(|&k| is_allowed(range.start + k)) {
            let (j, w, products) =
                (rows.columns(R * k, R), w_all.columns(R * k, R), products.columns(R * k, R));
            let s: Square<R> = identity_plus_product(&j, &w);
            let value = match &self.state {
                State::Determinant(_) => {
                    let ratio = s.volume() / self.nuisance_s::<R>(&j, &products).volume();
                    self.value - ratio.ln() / self.criterion.wanted.len() as f64
                }
                State::Product => self.mean_log_variance(&w, &s),
                State::Trace { before, .. } | State::Mean { before, .. } => {
                    (before - trace(&w, &s, &products)).ln()
                }
                State::Eigenvalue { values, .. } => {
                    log_largest_eigenvalue(values, &products, &s, limit)
                }
            };
            if value < limit {
                limit = value;
                best = Some((range.start + k, value));
            }
        }
        best
    }

    /// Returns the mean logarithm of the variances of the wanted unknowns after the candidate is
    /// added.
    fn mean_log_variance<const R: usize>(&self, w: &DMatrixView<f64>, s: &Square<R>) -> f64 {
        let Some(inverse) = s.try_inverse() else { return f64::INFINITY };
        let (mut logarithm, mut product) = (0.0, 1.0);
        for &k in &self.criterion.wanted {
            let row = SVector::<f64, R>::from_fn(|a, _| w[(k, a)]);
            product *= 1.0 - row.dot(&(inverse * row)) / self.covariance[(k, k)];
            if product < 1e-200 {
                logarithm += product.ln();
                product = 1.0;
            }
        }
        self.value + (logarithm + product.ln()) / self.criterion.wanted.len() as f64
    }

    /// Returns S of the nuisance unknowns alone; `w` is W of these unknowns.
    fn nuisance_s<const R: usize>(&self, j: &DMatrixView<f64>, w: &DMatrixView<f64>) -> Square<R> {
        let entry = |a: usize, b: usize| -> f64 {
            self.criterion
                .nuisance
                .iter()
                .zip(w.column(b).iter())
                .map(|(&row, w)| j[(row, a)] * w)
                .sum()
        };
        Square::from_fn(|a, b| f64::from(u8::from(a == b)) + entry(a, b))
    }
}

/// Symmetric matrix with a row for every coordinate of a pose.
type Square<const R: usize> = SMatrix<f64, R, R>;

/// Operations on small matrices that nalgebra implements for each size separately.
trait Small {
    /// Returns the determinant.
    fn volume(&self) -> f64;
    /// Returns the number of positive eigenvalues.
    fn positive_eigenvalues(&self) -> usize;
}

macro_rules! small {
    ($($rows:literal)*) => {$(
        impl Small for Square<$rows> {
            fn volume(&self) -> f64 {
                self.determinant()
            }

            fn positive_eigenvalues(&self) -> usize {
                self.symmetric_eigenvalues().iter().filter(|&&value| value > 0.0).count()
            }
        }
    )*};
}
small!(3 6 12);

/// Returns I + J W.
fn identity_plus_product<const R: usize>(j: &DMatrixView<f64>, w: &DMatrixView<f64>) -> Square<R> {
    Square::from_fn(|a, b| f64::from(u8::from(a == b)) + j.column(a).dot(&w.column(b)))
}

/// Returns Σ w_k (W S⁻¹ Wᵀ)_kk; `weighted` is W with its rows multiplied by the weights w.
fn trace<const R: usize>(w: &DMatrixView<f64>, s: &Square<R>, weighted: &DMatrixView<f64>) -> f64 {
    let Some(inverse) = s.try_inverse() else { return 0.0 };
    let gram = |a: usize, b: usize| w.column(a).dot(&weighted.column(b)) * inverse[(a, b)];
    let diagonal: f64 = (0..R).map(|a| gram(a, a)).sum();
    let off_diagonal: f64 =
        (0..R).flat_map(|a| (a + 1..R).map(move |b| (a, b))).map(|(a, b)| gram(a, b)).sum();
    diagonal + 2.0 * off_diagonal
}

/// Returns the logarithm of the largest eigenvalue of Λ − Z Zᵀ, or infinity if it is not below
/// `limit`. Z Zᵀ = Y S⁻¹ Yᵀ with Y = Qᵀ F W.
///
/// Λ − Z Zᵀ − t has as many positive eigenvalues as Λ − t and S − Yᵀ(Λ − t)⁻¹Y together, minus the
/// number of rows of S [Haynsworth 1968]. `values` are the diagonal of Λ, `w` is Y.
fn log_largest_eigenvalue<const R: usize>(
    values: &DVector<f64>,
    w: &DMatrixView<f64>,
    s: &Square<R>,
    limit: f64,
) -> f64
where
    Square<R>: Small,
{
    let is_below = |t: f64| {
        let above = values.iter().filter(|&&value| value > t).count();
        above + positive_eigenvalues(s, w, values, t) <= R
    };
    let upper = limit.exp().min(values.max() * (1.0 + 1e-12));
    if !is_below(upper) {
        return f64::INFINITY;
    }
    bisect(|t| !is_below(t), (0.0, upper), EIGENVALUE_BISECTIONS).1.ln()
}

/// Returns the number of positive eigenvalues of S − Yᵀ(Λ − t)⁻¹Y.
fn positive_eigenvalues<const R: usize>(
    s: &Square<R>,
    w: &DMatrixView<f64>,
    values: &DVector<f64>,
    t: f64,
) -> usize
where
    Square<R>: Small,
{
    let mut inner = *s;
    for (row, value) in w.row_iter().zip(values.iter()) {
        let row = row.fixed_columns::<R>(0).into_owned();
        inner -= row.transpose() * row / (value - t);
    }
    inner.positive_eigenvalues()
}
