//! Linear least squares of full rank by column-pivoted QR, and its damped solutions.

use nalgebra::{DMatrix, DVector, Dyn, PermutationSequence};

use super::settings::MAX_RADIUS_DEVIATION;
use crate::least_squares::inverse::regular_inverse;
use crate::least_squares::{Linearisation, Triangle};

/// Maximum number of Newton steps on the secular equation ‖q(λ)‖ = Δ. If they do not suffice,
/// singular values are used.
const MAX_SECULAR_STEPS: usize = 20;
/// Smallest ratio of the last to the first singular value at which an upper triangle is used
/// without pivoting.
const MIN_UNPIVOTED_RATIO: f64 = 1e-8;

/// Least-squares problem min ‖B q + c‖ of full rank with B S⁻¹ P = Q R; S holds the column norms of
/// B.
///
/// A well-conditioned upper triangle B is used as the factor directly.
#[derive(Debug, Clone)]
pub(super) struct Pivoted {
    /// Triangular factor R of B S⁻¹ P: the matrix B with unit columns, permuted by P, shape = (n,
    /// n).
    triangle: DMatrix<f64>,
    /// Projection `Qᵀc` of the constant c of the problem min ‖B q + c‖, length n.
    projected: DVector<f64>,
    /// Inverse norms 1/S of the columns of B, in pivot order.
    inverse_norms: DVector<f64>,
    permutation: PermutationSequence<Dyn>,
    /// Minimiser q of ‖B q + c‖ without damping, in pivot order.
    solution: DVector<f64>,
    /// True if the matrix B is upper triangular and serves as the factor without pivoting.
    pub(super) is_unpivoted: bool,
}

impl Pivoted {
    /// Decomposes B; returns `None` if `|Rₙₙ| ≤ tolerance·|R₁₁|`.
    pub(super) fn new(
        matrix: &DMatrix<f64>,
        constant: &DVector<f64>,
        tolerance: f64,
    ) -> Option<Self> {
        let n = matrix.ncols();
        if n == 0 || matrix.nrows() < n {
            return None;
        }
        let (unit, mut inverse_norms) = with_unit_columns(matrix);
        if is_regular_triangle(&unit, tolerance) {
            let (projected, permutation) =
                (constant.clone(), PermutationSequence::<Dyn>::identity_generic(Dyn(n)));
            let solution = solve(&unit, &projected, &inverse_norms)?;
            return Some(Self {
                triangle: unit,
                projected,
                inverse_norms,
                permutation,
                solution,
                is_unpivoted: true,
            });
        }
        let qr = unit.col_piv_qr();
        let triangle = qr.r();
        let largest = triangle[(0, 0)].abs();
        if triangle.diagonal().iter().any(|d| d.abs() <= tolerance * largest) {
            return None;
        }
        let mut projected = constant.clone();
        qr.q_tr_mul(&mut projected);
        let projected = projected.rows(0, n).into_owned();
        let permutation = qr.p().clone();
        permutation.permute_rows(&mut inverse_norms);
        let solution = solve(&triangle, &projected, &inverse_norms)?;
        Some(Self {
            triangle,
            projected,
            inverse_norms,
            permutation,
            solution,
            is_unpivoted: false,
        })
    }

    /// Returns the minimiser of ‖B q + c‖.
    pub(super) fn solution(&self) -> DVector<f64> {
        self.unpermuted(self.solution.clone())
    }

    /// Returns the minimiser with ‖q‖ ≤ Δ, to within [`MAX_RADIUS_DEVIATION`], and its damping
    /// λ ≥ 0, or `None` if Newton's method does not converge in [`MAX_SECULAR_STEPS`].
    ///
    /// λ ← λ + (‖q‖ − Δ) / (Δ ‖w‖²), `Rᵀw` = S⁻¹ q/‖q‖, with R of the damped problem
    ///
    /// \[Moré 1978, eqs. 5.8 and 5.9\]
    pub(super) fn limited(&self, radius: f64) -> Option<(DVector<f64>, f64)> {
        let mut lambda = 0.0;
        let mut q = self.solution.clone();
        let mut triangle = self.triangle.clone();
        for _ in 0..MAX_SECULAR_STEPS {
            let length = q.norm();
            if length <= (1.0 + MAX_RADIUS_DEVIATION) * radius {
                return Some((self.unpermuted(q), lambda));
            }
            let mut w = q.component_mul(&self.inverse_norms) / length;
            if !triangle.tr_solve_upper_triangular_mut(&mut w) {
                return None;
            }
            lambda += (length - radius) / radius / w.norm_squared();
            let damped = self.damped(lambda);
            q = solve(&damped.triangle, &damped.projected, &self.inverse_norms)?;
            triangle = damped.triangle;
        }
        None
    }

    /// Returns −(`BᵀB` + λ)⁻¹ g for the vector g = `gradient`, or `None` if it is not finite.
    pub(super) fn response(&self, gradient: &DVector<f64>, lambda: f64) -> Option<DVector<f64>> {
        let mut q = gradient.clone();
        self.permutation.permute_rows(&mut q);
        q.component_mul_assign(&self.inverse_norms);
        let damped = (lambda > 0.0).then(|| self.damped(lambda).triangle);
        let triangle = damped.as_ref().unwrap_or(&self.triangle);
        let is_solved = triangle.tr_solve_upper_triangular_mut(&mut q)
            && triangle.solve_upper_triangular_mut(&mut q);
        q.component_mul_assign(&self.inverse_norms);
        let response = self.unpermuted(-q);
        (is_solved && response.iter().all(|value| value.is_finite())).then_some(response)
    }

    /// Returns the problem with the damping λ, in triangular form.
    fn damped(&self, lambda: f64) -> Linearisation {
        let damping = &self.inverse_norms * lambda.sqrt();
        Triangle::damped(&self.triangle, &self.projected, &damping)
    }

    /// Returns q in the order of the columns of B.
    fn unpermuted(&self, mut q: DVector<f64>) -> DVector<f64> {
        self.permutation.inv_permute_rows(&mut q);
        q
    }
}

/// Returns true if B is a well-conditioned upper triangle after scaling to unit columns. The
/// triangular factor of any subset of its columns is then well conditioned, too, with or without
/// damping.
pub(super) fn is_well_conditioned(matrix: &DMatrix<f64>, tolerance: f64) -> bool {
    is_regular_triangle(&with_unit_columns(matrix).0, tolerance)
}

/// Returns true if a matrix with unit columns is an upper triangle that is used without pivoting;
/// `tolerance` is that of the decomposition.
fn is_regular_triangle(unit: &DMatrix<f64>, tolerance: f64) -> bool {
    tolerance <= MIN_UNPIVOTED_RATIO && regular_inverse(unit, MIN_UNPIVOTED_RATIO).is_some()
}

/// Returns B S⁻¹ and 1/S, with S the column norms of B.
fn with_unit_columns(matrix: &DMatrix<f64>) -> (DMatrix<f64>, DVector<f64>) {
    let mut unit = matrix.clone();
    let mut inverse_norms = DVector::from_element(matrix.ncols(), 1.0);
    for (mut column, inverse) in unit.column_iter_mut().zip(inverse_norms.iter_mut()) {
        let norm = column.norm();
        if norm > 0.0 {
            column /= norm;
            *inverse = norm.recip();
        }
    }
    (unit, inverse_norms)
}

/// Returns −S⁻¹ R⁻¹ c, where `inverse_norms` holds 1/S; `None` if it is not finite.
fn solve(
    triangle: &DMatrix<f64>,
    projected: &DVector<f64>,
    inverse_norms: &DVector<f64>,
) -> Option<DVector<f64>> {
    let mut q = triangle.solve_upper_triangular(projected)?;
    for (q, inverse) in q.iter_mut().zip(inverse_norms) {
        *q *= -inverse;
    }
    q.iter().all(|v| v.is_finite()).then_some(q)
}
