//! Every candidate tried as one more pose, by rank-three updates.

use std::ops::Range;

use nalgebra::{DMatrix, DMatrixView, DVector, Matrix3, Vector3};
use rayon::prelude::*;

use super::criterion::{Size, Yardstick, part};
use crate::numeric::bisected;

/// Candidates multiplied together.
const TOGETHER: usize = 256;
/// Halvings of the interval in which a largest eigenvalue is sought.
const HALVINGS: usize = 50;

/// Information without one of the poses, ready to try candidates in its place.
///
/// One more pose J (3 rows) takes C to C − W S⁻¹ Wᵀ, W = C Jᵀ, S = I + J C Jᵀ          [Fedorov 1972, ch. 3]
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
            Size::Determinant => State::Determinant(part(information, &yardstick.rest).cholesky()?.inverse()),
            Size::Product => State::Product,
            Size::Trace(weights) => State::Trace { weights, before: covariance.diagonal().dot(weights) },
            Size::Eigenvalue(combinations) => {
                let eigen = (combinations * &covariance * combinations.transpose()).symmetric_eigen();
                let turned = eigen.eigenvectors.transpose() * combinations;
                State::Eigenvalue { values: eigen.eigenvalues, turned }
            }
        };
        Some(Self { yardstick, covariance, value: yardstick.value(information), state })
    }

    /// The candidate (Jᵀ of all, shape = (unknowns, 3 · candidates)) with the lowest value below `least`, of those that
    /// `may` be taken; the first of equals.
    pub fn best(
        &self,
        candidates: &DMatrix<f64>,
        may: impl Fn(usize) -> bool + Sync,
        least: f64,
    ) -> Option<(usize, f64)> {
        let count = candidates.ncols() / 3;
        let starts: Vec<usize> = (0..count).step_by(TOGETHER).collect();
        let best: Vec<_> = starts
            .into_par_iter()
            .map(|start| self.best_of(candidates, start..(start + TOGETHER).min(count), &may, least))
            .collect();
        best.into_iter().flatten().reduce(|best, next| if next.1 < best.1 { next } else { best })
    }

    /// The same among some of the candidates.
    fn best_of(
        &self,
        candidates: &DMatrix<f64>,
        range: Range<usize>,
        may: impl Fn(usize) -> bool,
        mut least: f64,
    ) -> Option<(usize, f64)> {
        let mut best = None;
        let rows = candidates.columns(3 * range.start, 3 * range.len());
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
            let (j, w, other) = (rows.columns(3 * k, 3), moved.columns(3 * k, 3), other.columns(3 * k, 3));
            let s = plus_identity(&j, &w);
            let value = match &self.state {
                State::Determinant(_) => {
                    let part = s.determinant() / self.rest_s(&j, &other).determinant();
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
    fn product(&self, w: &DMatrixView<f64>, s: &Matrix3<f64>) -> f64 {
        let Some(inverse) = s.try_inverse() else { return f64::INFINITY };
        let (mut logarithm, mut product) = (0.0, 1.0);
        for &k in &self.yardstick.wanted {
            let row = Vector3::new(w[(k, 0)], w[(k, 1)], w[(k, 2)]);
            product *= 1.0 - row.dot(&(inverse * row)) / self.covariance[(k, k)];
            if product < 1e-200 {
                logarithm += product.ln();
                product = 1.0;
            }
        }
        self.value + (logarithm + product.ln()) / self.yardstick.wanted.len() as f64
    }

    /// S of the rest's part alone; `moved` is W of that.
    fn rest_s(&self, j: &DMatrixView<f64>, moved: &DMatrixView<f64>) -> Matrix3<f64> {
        let entry = |a: usize, b: usize| -> f64 {
            self.yardstick.rest.iter().zip(moved.column(b).iter()).map(|(&row, w)| j[(row, a)] * w).sum()
        };
        Matrix3::from_fn(|a, b| f64::from(u8::from(a == b)) + entry(a, b))
    }
}

/// I + J W.
fn plus_identity(j: &DMatrixView<f64>, w: &DMatrixView<f64>) -> Matrix3<f64> {
    Matrix3::from_fn(|a, b| f64::from(u8::from(a == b)) + j.column(a).dot(&w.column(b)))
}

/// Σ weight · (W S⁻¹ Wᵀ)_kk; `weighted` is W with its rows times the weights.
fn trace(w: &DMatrixView<f64>, s: &Matrix3<f64>, weighted: &DMatrixView<f64>) -> f64 {
    let Some(inverse) = s.try_inverse() else { return 0.0 };
    let gram = |a: usize, b: usize| w.column(a).dot(&weighted.column(b)) * inverse[(a, b)];
    gram(0, 0) + gram(1, 1) + gram(2, 2) + 2.0 * (gram(0, 1) + gram(0, 2) + gram(1, 2))
}

/// ln of the largest eigenvalue of Λ − Z Zᵀ, Z Zᵀ = Y S⁻¹ Yᵀ with Y = Qᵀ F W; `least` or more where it is no less than that.
///
/// Of Λ − Z Zᵀ − t as many eigenvalues are positive as of Λ − t and S − Yᵀ(Λ − t)⁻¹Y together, less three [Haynsworth 1968].
fn largest(values: &DVector<f64>, w: &DMatrixView<f64>, s: &Matrix3<f64>, least: f64) -> f64 {
    let is_below = |t: f64| {
        let above = values.iter().filter(|&&value| value > t).count();
        above + positive_eigenvalues(s, w, values, t) <= 3
    };
    let limit = least.exp().min(values.max() * (1.0 + 1e-12));
    if !is_below(limit) {
        return f64::INFINITY;
    }
    bisected(|t| !is_below(t), (0.0, limit), HALVINGS).1.ln()
}

/// Number of positive eigenvalues of S − Yᵀ(Λ − t)⁻¹Y.
fn positive_eigenvalues(s: &Matrix3<f64>, w: &DMatrixView<f64>, values: &DVector<f64>, t: f64) -> usize {
    let mut inner = *s;
    for (row, value) in w.row_iter().zip(values.iter()) {
        let row = row.fixed_columns::<3>(0).into_owned();
        inner -= row.transpose() * row / (value - t);
    }
    inner.symmetric_eigenvalues().iter().filter(|&&value| value > 0.0).count()
}
