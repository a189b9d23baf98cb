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
    /// Singular value σᵢ of the matrix B of the problem min ‖B q + c‖.
    singular: f64,
    /// Projection `−uᵢᵀc` of the constant c on the left singular vector uᵢ.
    projected: f64,
    /// Right singular vector vᵢ of the matrix B, length n.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the expansion of min ‖B q + c‖ for B = U diag(100, 4, 1) Vᵀ with rotations U and V,
    /// with B and c.
    fn example(cut: f64) -> (Spectrum, DMatrix<f64>, DVector<f64>) {
        let turn = |a, b, c| {
            let turn = nalgebra::Rotation3::from_euler_angles(a, b, c);
            DMatrix::from_column_slice(3, 3, turn.matrix().as_slice())
        };
        let sizes = DMatrix::from_diagonal(&DVector::from_vec(vec![100.0, 4.0, 1.0]));
        let matrix = turn(0.3, -0.7, 1.1) * sizes * turn(-0.2, 0.5, 0.9).transpose();
        let constant = DVector::from_vec(vec![40.0, -7.0, 3.0]);
        (Spectrum::new(&matrix, &constant, cut), matrix, constant)
    }

    #[test]
    fn solutions_satisfy_the_damped_normal_equations() {
        let (spectrum, matrix, constant) = example(0.0);
        for lambda in [0.0, 0.3, 50.0] {
            let q = spectrum.solution(lambda, 3);
            let normal = matrix.tr_mul(&(&matrix * &q + &constant)) + lambda * &q;
            assert!(normal.norm() < 1e-11 * matrix.tr_mul(&constant).norm(), "{normal}");
        }
    }

    #[test]
    fn the_damping_meets_the_radius() {
        let (spectrum, ..) = example(0.0);
        let full = spectrum.solution(0.0, 3).norm();
        assert!(spectrum.secular_root(full).abs() < 1e-300);
        for fraction in [0.7, 0.3, 0.05, 1e-3] {
            let lambda = spectrum.secular_root(fraction * full);
            let ratio = spectrum.solution(lambda, 3).norm() / (fraction * full);
            assert!(lambda > 0.0 && (ratio - 1.0).abs() <= MAX_RADIUS_DEVIATION + 1e-12, "{ratio}");
        }
    }

    #[test]
    fn directions_up_to_the_cut_do_not_move() {
        // Of the ratios 1, 0.04 and 0.01 to the largest singular value, 0.02 cuts the last.
        let (full, cut) = (example(0.0), example(0.02));
        let lost = full.0.solution(0.0, 3) - cut.0.solution(0.0, 3);
        assert!(lost.norm() > 1e-3);
        let image = &full.1 * &lost;
        assert!((image.norm() - lost.norm()).abs() < 1e-10 * lost.norm());
    }
}
