//! Where the arm stands: a base pose from measured points, with no guess to start from.

use nalgebra::{DVector, Matrix3, Vector3};

use crate::arm::{Equilibrated, Workspace};
use crate::model::{Model, Pose};
use crate::parameter::Slot;
use crate::spatial::rotation_vector;

/// Sets every base that is wholly free and has no prior to the best rigid motion from the arm's own frame to the
/// measured points of `poses`, in the full parameter vector `x`. Bases that no pose uses stay as they are.
///
/// min over R, t of Σ ‖y − R p − t‖², by the singular values of the covariance of p and y  [Arun 1987, Umeyama 1991].
pub fn register(model: &Model, poses: &[Pose], x: &mut DVector<f64>) {
    let arm = model.arm(|k| x[k]);
    let targets = model.target_positions(x.as_slice());
    let nominal = model.base_poses(DVector::zeros(x.len()).as_slice());
    let (mut ws, mut rest) = (Workspace::default(), Equilibrated::default());
    for (base, nominal) in nominal.iter().enumerate() {
        let columns: Vec<(usize, usize)> = model
            .parameters
            .iter()
            .enumerate()
            .filter(|(_, parameter)| parameter.sigma.is_none() && !parameter.is_bounded())
            .filter_map(|(k, parameter)| match parameter.slot {
                Slot::Base { base: own, axis } if own == base => Some((axis, k)),
                _ => None,
            })
            .collect();
        let mut points = Vec::new();
        for pose in poses.iter().filter(|pose| pose.base == base) {
            if arm.equilibrate(&pose.setup, &mut ws, &mut rest).is_ok() {
                points.push((rest.frame.point(&targets[pose.target]), pose.measured));
            }
        }
        if columns.len() < 6 || points.is_empty() {
            continue;
        }
        let (rotation, translation) = rigid_motion(&points);
        let rotation = rotation_vector(&rotation) - nominal.rotation;
        let translation = translation - nominal.translation;
        for (axis, k) in columns {
            x[k] = if axis < 3 { translation[axis] } else { rotation[axis - 3] };
        }
    }
}

/// The rotation and translation that carry the first points of the pairs to the second ones best.
fn rigid_motion(pairs: &[(Vector3<f64>, Vector3<f64>)]) -> (Matrix3<f64>, Vector3<f64>) {
    let n = pairs.len() as f64;
    let (from, to) = pairs.iter().fold((Vector3::zeros(), Vector3::zeros()), |(a, b), (p, y)| (a + p / n, b + y / n));
    let covariance: Matrix3<f64> = pairs.iter().map(|(p, y)| (y - to) * (p - from).transpose()).sum();
    let svd = covariance.svd(true, true);
    let rotation = match (svd.u, svd.v_t) {
        (Some(u), Some(v_t)) => {
            let mut last = Vector3::from_element(1.0);
            // A reflection fits best only along the direction that the points tell least about.
            last[svd.singular_values.imin()] = (u * v_t).determinant().signum();
            u * Matrix3::from_diagonal(&last) * v_t
        }
        _ => Matrix3::identity(),
    };
    (rotation, to - rotation * from)
}
