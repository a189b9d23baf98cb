//! Every candidate tried as one more pose, by updates of as many ranks as a pose has coordinates.

use std::ops::Range;

use nalgebra::{DMatrix, DMatrixView, DVector, SMatrix, SVector};
use rayon::prelude::*;

use super::criterion::{Size, Yardstick, part};
use crate::numeric::bisect;

/// Candidates multiplied together.
const TOGETHER: usize = 256;
/// Halvings of the interval in which a largest eigenvalue is sought.
const HALVINGS: usize = 50;

/// Information without one of the poses, ready to try candidates in its place.
///
/// One more pose J (3 rows, 6 with its orientation) takes C to C − W S⁻¹ Wᵀ, W = C Jᵀ, S = I + J C
/// Jᵀ          [Fedorov 1972, ch. 3]
pub(super) struct Scan<'a> {
    yardstick: &'a Yardstick,
    covariance: DMatrix<f64>,
    /// Of the criterion before the candidate.
    value: f64,
    state: State<'a>,
}

enum State<'a> {
    /// Inverse of the rest's part of the information.
    Determinant(DMatrix<f64>),
    Product,
    Trace {
        weights: &'a DVector<f64>,
        before: f64,
    },
    /// F C Fᵀ = Q Λ Qᵀ: Λ, and Qᵀ F.
    Eigenvalue {
        values: DVector<f64>,
        turned: DMatrix<f64>,
    },
}

impl<'a> Scan<'a> {
    /// Of the information M that the other poses give; `None` where it is singular.
    pub fn new(yardstick: &'a Yardstick, information: &DMatrix<f64>) -> Option<Self> {
        let covariance = information.clone().cholesky()?.inverse();
        let state = match &yardstick.size {
            Size::Determinant => {
                State::Determinant(part(information, &yardstick.rest).cholesky()?.inverse())
            }
            Size::Product => State::Product,
            Size::Trace(weights) => {
                State::Trace { weights, before: covariance.diagonal().dot(weights) }
            }
            Size::Eigenvalue(combinations) => {
                let eigen =
                    (combinations * &covariance * combinations.transpose()).symmetric_eigen();
                let turned = eigen.eigenvectors.transpose() * combinations;
                State::Eigenvalue { values: eigen.eigenvalues, turned }
            }
        };
        Some(Self { yardstick, covariance, value: yardstick.value(information), state })
    }

    /// The candidate (Jᵀ of all, shape = (unknowns, coordinates · candidates)) with the lowest
    /// value below `least`, of those that `may` be taken; the first of equals.
    pub fn best(
        &self,
        (candidates, coordinates): (&DMatrix<f64>, usize),
        may: impl Fn(usize) -> bool + Sync,
        least: f64,
    ) -> Option<(usize, f64)> {
        match coordinates {
            6 => self.best_of_all::<6>(candidates, may, least),
            _ => self.best_of_all::<3>(candidates, may, least),
        }
    }

    fn best_of_all<const R: usize>(
        &self,
        candidates: &DMatrix<f64>,
        may: impl Fn(usize) -> bool + Sync,
        least: f64,
    ) -> Option<(usize, f64)>
    where
        Square<R>: Small,
    {
        let count = candidates.ncols() / R;
        let starts: Vec<usize> = (0..count).step_by(TOGETHER).collect();
        let best: Vec<_> = starts
            .into_par_iter()
            .map(|start| {
                self.best_of::<R>(candidates, start..(start + TOGETHER).min(count), &may, least)
            })
            .collect();
        best.into_iter().flatten().reduce(|best, next| if next.1 < best.1 { next } else { best })
    }

    /// The same among some of the candidates.
    fn best_of<const R: usize>(
        &self,
        candidates: &DMatrix<f64>,
        range: Range<usize>,
        may: impl Fn(usize) -> bool,
        mut least: f64,
    ) -> Option<(usize, f64)>
    where
        Square<R>: Small,
    {
        let mut best = None;
        let rows = candidates.columns(R * range.start, R * range.len());
        let moved = &self.covariance * rows;
        // What each state needs of all candidates besides.
        let other = match &self.state {
            State::Determinant(inverse) => inverse * rows.select_rows(&self.yardstick.rest),
            State::Product => DMatrix::zeros(0, moved.ncols()),
            State::Trace { weights, .. } => {
                DMatrix::from_fn(moved.nrows(), moved.ncols(), |i, k| weights[i] * moved[(i, k)])
            }
            State::Eigenvalue { turned, .. } => turned * &moved,
        };
        for k in (0..range.len()).filter(|&k| may(range.start + k)) {
            let (j, w, other) =
                (rows.columns(R * k, R), moved.columns(R * k, R), other.columns(R * k, R));
            let s: Square<R> = plus_identity(&j, &w);
            let value = match &self.state {
                State::Determinant(_) => {
                    let part = s.volume() / self.rest_s::<R>(&j, &other).volume();
                    self.value - part.ln() / self.yardstick.wanted.len() as f64
                }
                State::Product => self.product(&w, &s),
                State::Trace { before, .. } => (before - trace(&w, &s, &other)).ln(),
                State::Eigenvalue { values, .. } => largest(values, &other, &s, least),
            };
            if value < least {
                least = value;
                best = Some((range.start + k, value));
            }
        }
        best
    }

    /// Mean of ln of the wanted variances.
    fn product<const R: usize>(&self, w: &DMatrixView<f64>, s: &Square<R>) -> f64 {
        let Some(inverse) = s.try_inverse() else { return f64::INFINITY };
        let (mut logarithm, mut product) = (0.0, 1.0);
        for &k in &self.yardstick.wanted {
            let row = SVector::<f64, R>::from_fn(|a, _| w[(k, a)]);
            product *= 1.0 - row.dot(&(inverse * row)) / self.covariance[(k, k)];
            if product < 1e-200 {
                logarithm += product.ln();
                product = 1.0;
            }
        }
        self.value + (logarithm + product.ln()) / self.yardstick.wanted.len() as f64
    }

    /// S of the rest's part alone; `moved` is W of that.
    fn rest_s<const R: usize>(&self, j: &DMatrixView<f64>, moved: &DMatrixView<f64>) -> Square<R> {
        let entry = |a: usize, b: usize| -> f64 {
            self.yardstick
                .rest
                .iter()
                .zip(moved.column(b).iter())
                .map(|(&row, w)| j[(row, a)] * w)
                .sum()
        };
        Square::from_fn(|a, b| f64::from(u8::from(a == b)) + entry(a, b))
    }
}

/// A symmetric matrix with a row for every coordinate of a pose.
type Square<const R: usize> = SMatrix<f64, R, R>;

/// What depends on how many rows there are.
trait Small {
    fn volume(&self) -> f64;
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
small!(3 6);

/// I + J W.
fn plus_identity<const R: usize>(j: &DMatrixView<f64>, w: &DMatrixView<f64>) -> Square<R> {
    Square::from_fn(|a, b| f64::from(u8::from(a == b)) + j.column(a).dot(&w.column(b)))
}

/// Σ weight · (W S⁻¹ Wᵀ)_kk; `weighted` is W with its rows times the weights.
fn trace<const R: usize>(w: &DMatrixView<f64>, s: &Square<R>, weighted: &DMatrixView<f64>) -> f64 {
    let Some(inverse) = s.try_inverse() else { return 0.0 };
    let gram = |a: usize, b: usize| w.column(a).dot(&weighted.column(b)) * inverse[(a, b)];
    let on: f64 = (0..R).map(|a| gram(a, a)).sum();
    let off: f64 =
        (0..R).flat_map(|a| (a + 1..R).map(move |b| (a, b))).map(|(a, b)| gram(a, b)).sum();
    on + 2.0 * off
}

/// ln of the largest eigenvalue of Λ − Z Zᵀ, Z Zᵀ = Y S⁻¹ Yᵀ with Y = Qᵀ F W; `least` or more where
/// it is no less than that.
///
/// Of Λ − Z Zᵀ − t as many eigenvalues are positive as of Λ − t and S − Yᵀ(Λ − t)⁻¹Y together, less
/// the rows of S [Haynsworth 1968].
fn largest<const R: usize>(
    values: &DVector<f64>,
    w: &DMatrixView<f64>,
    s: &Square<R>,
    least: f64,
) -> f64
where
    Square<R>: Small,
{
    let is_below = |t: f64| {
        let above = values.iter().filter(|&&value| value > t).count();
        above + positive_eigenvalues(s, w, values, t) <= R
    };
    let limit = least.exp().min(values.max() * (1.0 + 1e-12));
    if !is_below(limit) {
        return f64::INFINITY;
    }
    bisect(|t| !is_below(t), (0.0, limit), HALVINGS).1.ln()
}

/// Number of positive eigenvalues of S − Yᵀ(Λ − t)⁻¹Y.
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
