//! Singular values by one-sided Jacobi rotations: slow for large matrices, exact and never failing for ours.

use nalgebra::{DMatrix, DVector};

use super::settings::RADIUS_SLACK;
use crate::least_squares::orthogonalise;

/// Newton steps allowed to the secular equation.
const SECULAR_ITERATIONS: usize = 50;

/// The seen part of min ‖B q + c‖ with B = U Σ Vᵀ.
///
/// B P = Q R by column-pivoted QR; the columns of Rᵀ are then rotated until orthogonal: they become σᵢ Pᵀvᵢ, and the same
/// rotations turn Qᵀc into Uᵀc.                                                   [Hestenes 1958; Drmač & Veselić 2008]
///
/// The last rows of R, all together shorter than `cut`·σ₁/8, are left out before: they add no more than the square of that
/// to any σ², and would be the slowest to rotate.
#[derive(Debug, Clone)]
pub(super) struct Spectrum {
    terms: Vec<Term>,
}

/// One singular triplet.
#[derive(Debug, Clone)]
struct Term {
    /// σᵢ.
    singular: f64,
    /// `−uᵢᵀc`.
    projected: f64,
    /// vᵢ.
    direction: DVector<f64>,
}

impl Term {
    /// Length of q(λ) along vᵢ, written so that λ = 0 needs no σ².
    fn length(&self, lambda: f64) -> f64 {
        self.projected / (self.singular + lambda / self.singular)
    }
}

impl Spectrum {
    /// Decomposes B and drops σ ≤ `cut`·σ₁.
    pub(super) fn new(matrix: &DMatrix<f64>, constant: &DVector<f64>, cut: f64) -> Self {
        let n = matrix.ncols();
        let qr = matrix.clone().col_piv_qr();
        let mut projected = -constant;
        qr.q_tr_mul(&mut projected);
        let triangle = qr.r();
        // No row from k on is longer than √n |Rₖₖ|.
        let least = cut / (8.0 * n as f64) * triangle.get((0, 0)).map_or(0.0, |first| first.abs());
        let rank = (0..triangle.nrows()).take_while(|&k| triangle[(k, k)].abs() > least).count();
        let mut columns = triangle.rows(0, rank).transpose();
        let mut projected = projected.rows(0, rank).into_owned();
        orthogonalise(&mut columns, &mut projected);
        let singular: Vec<f64> = columns.column_iter().map(|c| c.norm()).collect();
        let largest = singular.iter().copied().fold(0.0, f64::max);
        let terms = (0..n.min(columns.ncols()))
            .filter(|&i| singular[i] > cut * largest && singular[i].is_normal())
            .map(|i| {
                let mut direction = columns.column(i) / singular[i];
                qr.p().inv_permute_rows(&mut direction);
                Term { singular: singular[i], projected: projected[i], direction }
            })
            .collect();
        Self { terms }
    }

    /// q(λ) = −Σ σᵢ/(σᵢ² + λ) `(uᵢᵀc)` vᵢ, of `n` entries.
    pub(super) fn solution(&self, lambda: f64, n: usize) -> DVector<f64> {
        let mut q = DVector::zeros(n);
        for term in &self.terms {
            q.axpy(term.length(lambda), &term.direction, 1.0);
        }
        q
    }

    /// λ ≥ 0 with ‖q(λ)‖ = Δ to within the slack, or zero if ‖q(0)‖ is no longer than that.
    ///
    /// Newton's method on 1/‖q(λ)‖ = 1/Δ from λ = 0, which approaches from one side        [Hebden 1973; Moré 1978]
    pub(super) fn secular_root(&self, radius: f64) -> f64 {
        let mut lambda = 0.0;
        for _ in 0..SECULAR_ITERATIONS {
            let (mut squares, mut slope) = (0.0, 0.0);
            for term in &self.terms {
                let square = term.length(lambda).powi(2);
                squares += square;
                slope += square / (term.singular * term.singular + lambda);
            }
            let length = f64::sqrt(squares);
            if length <= (1.0 + RADIUS_SLACK) * radius {
                break;
            }
            lambda += squares / slope * (length - radius) / radius;
        }
        lambda
    }
}
