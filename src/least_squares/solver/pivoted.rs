//! Linear least squares of full rank by column-pivoted QR, and its damped solutions.

use nalgebra::{DMatrix, DVector, Dyn, PermutationSequence};

use super::settings::RADIUS_SLACK;
use crate::least_squares::Triangle;
use crate::least_squares::inverse::regular_inverse;

/// Newton steps allowed to the secular equation before the singular values are asked.
const SECULAR_ITERATIONS: usize = 20;
/// A triangle none of whose singular values is below this part of the largest needs no pivots.
const WELL_CONDITIONED: f64 = 1e-8;

/// min ‖B q + c‖ with B S⁻¹ P = Q R of full rank; S holds the lengths of the columns of B.
/// Well-conditioned upper triangles B are their own factor.
#[derive(Debug, Clone)]
pub(super) struct Pivoted {
    /// R.
    triangle: DMatrix<f64>,
    /// `Qᵀc`.
    projected: DVector<f64>,
    /// 1/S in the order of the pivots.
    inverse_sizes: DVector<f64>,
    permutation: PermutationSequence<Dyn>,
    /// q at λ = 0.
    solution: DVector<f64>,
    /// Whether B is its own factor.
    pub(super) is_plain: bool,
}

impl Pivoted {
    /// Decomposes B, or gives nothing when `|Rₙₙ| ≤ tolerance·|R₁₁|`.
    pub(super) fn new(
        matrix: &DMatrix<f64>,
        constant: &DVector<f64>,
        tolerance: f64,
    ) -> Option<Self> {
        let n = matrix.ncols();
        if n == 0 || matrix.nrows() < n {
            return None;
        }
        let (unit, mut inverse_sizes) = with_unit_columns(matrix);
        if tolerance <= WELL_CONDITIONED && regular_inverse(&unit, WELL_CONDITIONED).is_some() {
            let (projected, permutation) =
                (constant.clone(), PermutationSequence::<Dyn>::identity_generic(Dyn(n)));
            let solution = solve(&unit, &projected, &inverse_sizes)?;
            return Some(Self {
                triangle: unit,
                projected,
                inverse_sizes,
                permutation,
                solution,
                is_plain: true,
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
        permutation.permute_rows(&mut inverse_sizes);
        let solution = solve(&triangle, &projected, &inverse_sizes)?;
        Some(Self { triangle, projected, inverse_sizes, permutation, solution, is_plain: false })
    }

    /// The minimiser of ‖B q + c‖.
    pub(super) fn solution(&self) -> DVector<f64> {
        self.in_order(self.solution.clone())
    }

    /// The minimiser with ‖q‖ = Δ to within the slack and its λ > 0, if Newton's method settles
    /// soon.
    ///
    /// λ ← λ + (‖q‖ − Δ) / (Δ ‖w‖²), `Rᵀw` = S⁻¹ q/‖q‖, with R of the damped problem      [Moré
    /// 1978, eqs. 5.8 and 5.9]
    pub(super) fn limited(&self, radius: f64) -> Option<(DVector<f64>, f64)> {
        let mut lambda = 0.0;
        let mut q = self.solution.clone();
        let mut triangle = self.triangle.clone();
        for _ in 0..SECULAR_ITERATIONS {
            let length = q.norm();
            if length <= (1.0 + RADIUS_SLACK) * radius {
                return Some((self.in_order(q), lambda));
            }
            let mut w = q.component_mul(&self.inverse_sizes) / length;
            if !triangle.tr_solve_upper_triangular_mut(&mut w) {
                return None;
            }
            lambda += (length - radius) / radius / w.norm_squared();
            let damped = Triangle::damped(
                &self.triangle,
                &self.projected,
                &(&self.inverse_sizes * lambda.sqrt()),
            );
            q = solve(&damped.triangle, &damped.projected, &self.inverse_sizes)?;
            triangle = damped.triangle;
        }
        None
    }

    /// −(`BᵀB` + λ)⁻¹ g.
    pub(super) fn response(&self, gradient: &DVector<f64>, lambda: f64) -> Option<DVector<f64>> {
        let mut q = gradient.clone();
        self.permutation.permute_rows(&mut q);
        q.component_mul_assign(&self.inverse_sizes);
        let damped = (lambda > 0.0).then(|| {
            Triangle::damped(
                &self.triangle,
                &self.projected,
                &(&self.inverse_sizes * lambda.sqrt()),
            )
            .triangle
        });
        let triangle = damped.as_ref().unwrap_or(&self.triangle);
        let solved = triangle.tr_solve_upper_triangular_mut(&mut q)
            && triangle.solve_upper_triangular_mut(&mut q);
        q.component_mul_assign(&self.inverse_sizes);
        let found = self.in_order(-q);
        (solved && found.iter().all(|value| value.is_finite())).then_some(found)
    }

    fn in_order(&self, mut q: DVector<f64>) -> DVector<f64> {
        self.permutation.inv_permute_rows(&mut q);
        q
    }
}

/// Whether B is a well-conditioned upper triangle, by columns brought to length one; then so is the
/// factor of any of its columns, with damping or without.
pub(super) fn is_well_conditioned(matrix: &DMatrix<f64>, tolerance: f64) -> bool {
    tolerance <= WELL_CONDITIONED
        && regular_inverse(&with_unit_columns(matrix).0, WELL_CONDITIONED).is_some()
}

/// B S⁻¹, and 1/S.
fn with_unit_columns(matrix: &DMatrix<f64>) -> (DMatrix<f64>, DVector<f64>) {
    let mut unit = matrix.clone();
    let mut inverse_sizes = DVector::from_element(matrix.ncols(), 1.0);
    for (mut column, inverse) in unit.column_iter_mut().zip(inverse_sizes.iter_mut()) {
        let size = column.norm();
        if size > 0.0 {
            column /= size;
            *inverse = size.recip();
        }
    }
    (unit, inverse_sizes)
}

/// −S⁻¹ R⁻¹ c.
fn solve(
    triangle: &DMatrix<f64>,
    projected: &DVector<f64>,
    inverse_sizes: &DVector<f64>,
) -> Option<DVector<f64>> {
    let mut q = triangle.solve_upper_triangular(projected)?;
    for (q, inverse) in q.iter_mut().zip(inverse_sizes) {
        *q *= -inverse;
    }
    q.iter().all(|v| v.is_finite()).then_some(q)
}
