//! Linear least squares under linear inequalities by Clarabel's interior-point method.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SecondOrderConeT, SupportedConeT,
    ZeroConeT,
};
use nalgebra::DVector;

use super::Factor;

/// Tolerance on duality gap and feasibility, relative to the scaled problem of unit columns.
const CLARABEL_TOLERANCE: f64 = 1e-11;

/// Half-space g·q ≥ h, with g given as pairs of unknown and coefficient.
#[derive(Debug, Clone)]
pub(super) struct HalfSpace {
    pub(super) normal: Vec<(usize, f64)>,
    pub(super) offset: f64,
}

/// Minimises ½‖B q + c‖² + ½λ‖q‖² within all half-spaces and, if there is a `radius`, within ‖q‖ ≤
/// `radius`. Returns q and the damping that has the effect of the radius, 0 if the radius does not
/// limit q.
///
/// The solver works with z = S q (unit columns) and y = B q + c, so that `BᵀB` is never formed;
/// normals are scaled to unit length. Returns `None` if q is not finite.
pub(super) fn solve_by_interior_point(
    factor: &Factor,
    lambda: f64,
    spaces: &[HalfSpace],
    radius: Option<f64>,
) -> Option<(DVector<f64>, f64)> {
    let matrix = factor.matrix();
    let (rows, n) = matrix.shape();
    let column_norms: Vec<f64> = matrix
        .column_iter()
        .map(|c| (c.norm_squared() + lambda).sqrt())
        .map(|s| if s > 0.0 { s } else { 1.0 })
        .collect();
    let scale = match factor.projected().norm() {
        0.0 => spaces.iter().fold(f64::MIN_POSITIVE, |scale, space| scale.max(space.offset.abs())),
        norm => norm,
    };

    // Rows: y − B S⁻¹ z = c, then −g S⁻¹ z ≤ −h.
    let (mut row_indices, mut column_indices, mut values) = (Vec::new(), Vec::new(), Vec::new());
    let mut push_entry = |i: usize, j: usize, value: f64| {
        row_indices.push(i);
        column_indices.push(j);
        values.push(value);
    };
    let mut right = Vec::with_capacity(rows + spaces.len());
    for i in 0..rows {
        push_entry(i, n + i, 1.0);
        (0..n).for_each(|j| push_entry(i, j, -matrix[(i, j)] / column_norms[j]));
        right.push(factor.projected()[i] / scale);
    }
    for space in spaces {
        let length =
            space.normal.iter().map(|&(j, g)| (g / column_norms[j]).powi(2)).sum::<f64>().sqrt();
        space
            .normal
            .iter()
            .for_each(|&(j, g)| push_entry(right.len(), j, -g / column_norms[j] / length));
        right.push(-space.offset / scale / length);
    }
    if let Some(radius) = radius {
        right.push(radius / scale);
        for (j, size) in column_norms.iter().enumerate() {
            push_entry(right.len(), j, -size.recip());
            right.push(0.0);
        }
    }
    let constraints =
        CscMatrix::new_from_triplets(right.len(), n + rows, row_indices, column_indices, values);
    let diagonal: Vec<f64> = column_norms
        .iter()
        .map(|s| lambda / (s * s))
        .chain(std::iter::repeat_n(1.0, rows))
        .collect();
    let indices: Vec<usize> = (0..n + rows).collect();
    let quadratic =
        CscMatrix::new_from_triplets(n + rows, n + rows, indices.clone(), indices, diagonal);
    let mut cones: Vec<SupportedConeT<f64>> = vec![ZeroConeT(rows), NonnegativeConeT(spaces.len())];
    cones.extend(radius.map(|_| SecondOrderConeT(n + 1)));
    let settings = DefaultSettings {
        verbose: false,
        presolve_enable: false,
        tol_gap_abs: CLARABEL_TOLERANCE,
        tol_gap_rel: CLARABEL_TOLERANCE,
        tol_feas: CLARABEL_TOLERANCE,
        ..DefaultSettings::default()
    };
    let linear = vec![0.0; n + rows];
    let mut solver =
        DefaultSolver::new(&quadratic, &linear, &constraints, &right, &cones, settings).ok()?;
    solver.solve();
    let z = solver.solution.x.get(..n)?;
    let q =
        DVector::from_iterator(n, z.iter().zip(&column_norms).map(|(z, size)| z * scale / size));
    // The multiplier of the cone is λ q, of length λ Δ.
    let damping = radius
        .and_then(|radius| Some(solver.solution.z.get(rows + spaces.len())? * scale / radius));
    let damping = damping.filter(|lambda| *lambda > CLARABEL_TOLERANCE).unwrap_or(0.0);
    q.iter().all(|v| v.is_finite()).then_some((q, damping))
}
