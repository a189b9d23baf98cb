//! Damped least squares by singular values, for matrices that may lack rank.

use nalgebra::{DMatrix, DVector};

use super::settings::MAX_RADIUS_DEVIATION;
use crate::least_squares::singular::Decomposition;

/// Maximum number of Newton steps on the secular equation.
const MAX_SECULAR_STEPS: usize = 50;

/// Singular value expansion of min ‖B q + c‖ with B = U Σ Vᵀ, restricted to the retained σᵢ.
#[derive(Debug, Clone)]
pub(super) struct Spectrum {
    terms: Vec<SpectralTerm>,
}

/// Term of the expansion that belongs to one singular value.
#[derive(Debug, Clone)]
struct SpectralTerm {
    /// Singular value σᵢ of B.
    singular: f64,
    /// Projection `−uᵢᵀc` of the constant.
    projected: f64,
    /// Right singular vector vᵢ.
    direction: DVector<f64>,
}

impl SpectralTerm {
    /// Returns the length of q(λ) along vᵢ, in a form that needs no σ² at λ = 0.
    fn length(&self, lambda: f64) -> f64 {
        self.projected / (self.singular + lambda / self.singular)
    }
}

impl Spectrum {
    /// Decomposes B and drops singular values σ ≤ `cut`·σ₁.
    pub(super) fn new(matrix: &DMatrix<f64>, constant: &DVector<f64>, cut: f64) -> Self {
        let Decomposition { columns, singular, projected } =
            Decomposition::new(matrix, Some(constant), cut);
        let largest = singular.iter().copied().fold(0.0, f64::max);
        let terms = (0..singular.len())
            .filter(|&i| singular[i] > cut * largest && singular[i].is_normal())
            .map(|i| SpectralTerm {
                singular: singular[i],
                projected: -projected[i],
                direction: columns.column(i) / singular[i],
            })
            .collect();
        Self { terms }
    }

    /// Returns q(λ) = −Σ σᵢ/(σᵢ² + λ) `(uᵢᵀc)` vᵢ, a vector of length `n`.
    pub(super) fn solution(&self, lambda: f64, n: usize) -> DVector<f64> {
        let mut q = DVector::zeros(n);
        for term in &self.terms {
            q.axpy(term.length(lambda), &term.direction, 1.0);
        }
        q
    }

    /// Returns λ ≥ 0 with ‖q(λ)‖ = Δ to within 10 %, or zero if ‖q(0)‖ is not longer.
    ///
    /// Newton's method on 1/‖q(λ)‖ = 1/Δ from λ = 0 converges monotonically [Hebden 1973; Moré
    /// 1978].
    pub(super) fn secular_root(&self, radius: f64) -> f64 {
        let mut lambda = 0.0;
        for _ in 0..MAX_SECULAR_STEPS {
            let (mut squares, mut slope) = (0.0, 0.0);
            for term in &self.terms {
                let square = term.length(lambda).powi(2);
                squares += square;
                slope += square / (term.singular * term.singular + lambda);
            }
            let length = f64::sqrt(squares);
            if length <= (1.0 + MAX_RADIUS_DEVIATION) * radius {
                break;
            }
            lambda += squares / slope * (length - radius) / radius;
        }
        lambda
    }
}
