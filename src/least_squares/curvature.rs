//! Second-order term Σ rᵢ ∇²rᵢ of the Hessian of a least-squares cost.

use nalgebra::{DMatrix, DVector};

/// Difference step of an unknown: the step that changes the residual vector by this fraction of
/// ‖r‖.
const DIFFERENCE_STEP: f64 = 1e-4;

/// Cost, gradient and Gauss–Newton matrix of an objective at one point.
pub(super) struct QuadraticModel {
    /// Cost ½‖r‖² at the point.
    pub cost: f64,
    /// Gradient Jᵀr of the cost.
    pub gradient: DVector<f64>,
    /// Gauss–Newton matrix JᵀJ.
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
