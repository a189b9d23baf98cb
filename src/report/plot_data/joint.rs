//! How positions answer to one coordinate of the arm.

use nalgebra::{DVector, Vector3};

use super::states::{Arm, Sight};
use crate::least_squares::jacobian;
use crate::model::PoseResiduals;
use crate::model::parameter::Slot;

/// A pose whose position moves by less than this part of the most is left out: it says little about the coordinate.
pub(super) const LEAST_LEVER: f64 = 0.1;

/// ∂p/∂(coordinate) of some rows [m/rad] or [m/m].
pub(super) fn levers(arm: &Arm, sight: &Sight, rows: &[usize], slot: Slot) -> Vec<Vector3<f64>> {
    let model = arm.model.probing(&[(slot, 0.0)]);
    let x = arm.x.clone().insert_row(arm.x.len(), 0.0);
    let unknown = arm.x.len();
    let poses = sight.placement.poses(sight.measurements, rows, 1.0);
    let sigmas: Vec<f64> = poses.iter().map(|pose| pose.sigma).collect();
    let residuals = PoseResiduals::new(&model, poses, vec![unknown], x);
    let column = jacobian(&residuals, &DVector::zeros(1));
    (0..rows.len()).map(|k| Vector3::from_fn(|axis, _| -column[(3 * k + axis, 0)] * sigmas[k])).collect()
}

/// Whether each pose says enough about the coordinate.
pub(super) fn telling(levers: &[Vector3<f64>]) -> Vec<bool> {
    let most = levers.iter().map(Vector3::norm).fold(0.0, f64::max);
    levers.iter().map(|lever| lever.norm() > LEAST_LEVER * most).collect()
}

/// The change of a coordinate that explains a displacement best.
pub(super) fn along(lever: &Vector3<f64>, displacement: &Vector3<f64>) -> f64 {
    lever.dot(displacement) / lever.norm_squared()
}
