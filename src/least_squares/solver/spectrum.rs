//! Least squares by singular values, for any damping, where B may lack rank.

use nalgebra::{DMatrix, DVector};

use super::settings::RADIUS_SLACK;
use crate::least_squares::singular::Decomposition;

/// Newton steps allowed to the secular equation.
const SECULAR_ITERATIONS: usize = 50;

/// The seen part of min ‖B q + c‖ with B = U Σ Vᵀ.
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
        let Decomposition { columns, singular, projected } =
            Decomposition::new(matrix, Some(constant), cut);
        let largest = singular.iter().copied().fold(0.0, f64::max);
        let terms = (0..singular.len())
            .filter(|&i| singular[i] > cut * largest && singular[i].is_normal())
            .map(|i| Term {
                singular: singular[i],
                projected: -projected[i],
                direction: columns.column(i) / singular[i],
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
    /// Newton's method on 1/‖q(λ)‖ = 1/Δ from λ = 0, which approaches from one side        [Hebden
    /// 1973; Moré 1978]
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
