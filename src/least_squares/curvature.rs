//! What linearised residuals leave out of the second derivatives of a cost.

use nalgebra::{DMatrix, DVector};

/// How far each unknown is moved: by its effect on all residuals together, as a part of their
/// length.
const STEP: f64 = 1e-4;

/// What is known of an objective at a point.
pub(super) struct Slopes {
    /// ½‖r‖².
    pub cost: f64,
    /// Jᵀr.
    pub gradient: DVector<f64>,
    /// JᵀJ.
    pub normal: DMatrix<f64>,
}

/// S = Σ rᵢ ∇²rᵢ = ∂(Jᵀr)/∂x − JᵀJ, by differences of the gradient Jᵀr.
///
/// One call of `slopes` for each unknown. An unknown is moved up, or down where `within` forbids
/// that; where it forbids both, its row and column hold what the others say of them.
pub(super) fn by_differences(
    slopes: impl Fn(&DVector<f64>) -> Slopes,
    x: &DVector<f64>,
    within: &dyn Fn(&DVector<f64>) -> bool,
) -> Option<DMatrix<f64>> {
    let Slopes { cost, gradient, normal } = slopes(x);
    let residual = (2.0 * cost).sqrt();
    let n = x.len();
    let mut second = DMatrix::zeros(n, n);
    let mut known = vec![false; n];
    for j in 0..n {
        let size = normal[(j, j)].sqrt();
        let h = if size > 0.0 { STEP * residual / size } else { continue };
        let moved = [h, -h].into_iter().find_map(|h| {
            let mut moved = x.clone();
            moved[j] += h;
            within(&moved).then_some(moved)
        });
        let Some(moved) = moved else { continue };
        let change = (slopes(&moved).gradient - &gradient) / (moved[j] - x[j]);
        second.set_column(j, &(change - normal.column(j)));
        known[j] = true;
    }
    let symmetric = DMatrix::from_fn(n, n, |i, j| match (known[i], known[j]) {
        (true, true) => 0.5 * (second[(i, j)] + second[(j, i)]),
        (true, false) => second[(j, i)],
        (false, true) => second[(i, j)],
        (false, false) => 0.0,
    });
    symmetric.iter().all(|value| value.is_finite()).then_some(symmetric)
}
