//! Second-order term Σ rᵢ ∇²rᵢ of the Hessian of a least-squares cost.

use nalgebra::{DMatrix, DVector};

/// Difference step of an unknown: the step that changes the residual vector by this fraction of
/// ‖r‖.
const DIFFERENCE_STEP: f64 = 1e-4;

/// Cost, gradient and Gauss–Newton matrix of an objective at one point.
pub(super) struct QuadraticModel {
    /// Cost ½‖r‖² at the point about which the cost is expanded.
    pub cost: f64,
    /// Gradient Jᵀr of the cost with respect to the unknowns, length n.
    pub gradient: DVector<f64>,
    /// Gauss–Newton matrix JᵀJ of the Jacobian J, shape = (n, n).
    pub normal: DMatrix<f64>,
}

/// Returns S = Σ rᵢ ∇²rᵢ = ∂(Jᵀr)/∂x − JᵀJ from differences of the gradient Jᵀr.
///
/// Calls `slopes` at x and once for each unknown that has an effect. An unknown is moved up, or
/// down where `within` is false at the upper point. If both points are outside, its row and column
/// come from the differences of the other unknowns. Returns `None` if an entry is not finite.
pub(super) fn curvature_by_differences(
    slopes: impl Fn(&DVector<f64>) -> QuadraticModel,
    x: &DVector<f64>,
    within: &dyn Fn(&DVector<f64>) -> bool,
) -> Option<DMatrix<f64>> {
    let QuadraticModel { cost, gradient, normal } = slopes(x);
    let residual = (2.0 * cost).sqrt();
    let n = x.len();
    let mut second = DMatrix::zeros(n, n);
    let mut is_formed = vec![false; n];
    for j in 0..n {
        let size = normal[(j, j)].sqrt();
        let h = if size > 0.0 { DIFFERENCE_STEP * residual / size } else { continue };
        let moved = [h, -h].into_iter().find_map(|h| {
            let mut moved = x.clone();
            moved[j] += h;
            within(&moved).then_some(moved)
        });
        let Some(moved) = moved else { continue };
        let change = (slopes(&moved).gradient - &gradient) / (moved[j] - x[j]);
        second.set_column(j, &(change - normal.column(j)));
        is_formed[j] = true;
    }
    let symmetric = DMatrix::from_fn(n, n, |i, j| match (is_formed[i], is_formed[j]) {
        (true, true) => 0.5 * (second[(i, j)] + second[(j, i)]),
        (true, false) => second[(j, i)],
        (false, true) => second[(i, j)],
        (false, false) => 0.0,
    });
    symmetric.iter().all(|value| value.is_finite()).then_some(symmetric)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_suit_the_sizes_of_residual_and_unknowns() {
        // r₁ = u (a + a² b), r₂ = u (2 b − a³ − 3) with a = x₀ / s₀, b = x₁ / s₁.
        for (unit, sizes) in [(1.0, [1.0, 1.0]), (1e4, [1e-3, 1e5]), (1e-4, [1e6, 1e-4])] {
            let slopes = |x: &DVector<f64>| {
                let (a, b) = (x[0] / sizes[0], x[1] / sizes[1]);
                let r = DVector::from_vec(vec![a + a * a * b, 2.0 * b - a.powi(3) - 3.0]) * unit;
                let d = [1.0 + 2.0 * a * b, a * a, -3.0 * a * a, 2.0];
                let jacobian = DMatrix::from_fn(2, 2, |i, j| unit * d[2 * i + j] / sizes[j]);
                QuadraticModel {
                    cost: 0.5 * r.norm_squared(),
                    gradient: jacobian.tr_mul(&r),
                    normal: jacobian.tr_mul(&jacobian),
                }
            };
            let (a, b) = (0.7, -0.4);
            let x = DVector::from_vec(vec![a * sizes[0], b * sizes[1]]);
            let (r1, r2) = (a + a * a * b, 2.0 * b - a.powi(3) - 3.0);
            let cross = r1 * 2.0 * a;
            let exact = [r1 * 2.0 * b - r2 * 6.0 * a, cross, cross, 0.0];
            let everywhere = |_: &DVector<f64>| true;
            let second = curvature_by_differences(slopes, &x, &everywhere).unwrap();
            for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let found = second[(i, j)] * sizes[i] * sizes[j] / (unit * unit);
                assert!((found - exact[2 * i + j]).abs() < 2e-2, "{unit}: {second}");
            }
            // Only x₀ may move, and only downwards: the entry of x₁ alone is unknown.
            let below =
                |moved: &DVector<f64>| moved[0] <= x[0] && moved[1].to_bits() == x[1].to_bits();
            let second = curvature_by_differences(slopes, &x, &below).unwrap();
            let found = second[(0, 1)] * sizes[0] * sizes[1] / (unit * unit);
            assert!((found - cross).abs() < 2e-2 && second[(1, 1)] == 0.0, "{unit}: {second}");
        }
    }
}
