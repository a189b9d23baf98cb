//! Registration: poses of bases and orientations of targets from measured poses, in closed form.

use nalgebra::{DVector, Matrix3, Matrix4, Quaternion, Rotation3, UnitQuaternion, Vector3};

use super::marker_pose::nearest_rotation;
use crate::model::parameter::{Parameter, ParameterSite};
use crate::model::{Model, Pose};
use crate::spatial::{Frame, rotate};

/// Largest ratio of the middle to the largest eigenvalue of SᵀS at which points count as collinear.
/// S is the cross-covariance of predicted and measured points.
const MAX_COLLINEAR_RATIO: f64 = 1e-12;

/// Sets the poses of bases and the orientations of targets in the full parameter vector `x` to
/// those that fit the `poses` best. It sets those that are free in all components, without priors
/// and bounds.
///
/// The pose of a base is the best rigid motion from predicted positions in the arm's base frame to
/// measured positions. Then the best orientation of each target is found. Bases and targets that no
/// pose uses keep their values.
///
/// min over R, t of Σ ‖y − R p − t‖²: the unit quaternion of R is the eigenvector of a symmetric 4
/// × 4 matrix  [Horn 1987].
pub fn register(model: &Model, poses: &[Pose], x: &mut DVector<f64>) {
    let poses: Vec<Pose> =
        poses.iter().filter(|pose| pose.observation.is_position()).copied().collect();
    let poses = &poses[..];
    let points = model.predicted_targets_in_base(poses, x.as_slice());
    let has_orientation = poses.iter().any(|pose| pose.orientation.is_some());
    let frames = if has_orientation { model.frames(poses, x.as_slice()) } else { Vec::new() };
    let oriented: Vec<(&Pose, Frame<f64>)> =
        poses.iter().zip(frames).filter_map(|(pose, last)| Some((pose, last?))).collect();
    let target_frames: Vec<Frame<f64>> = model
        .target_rotations(x.as_slice())
        .iter()
        .map(|rotation| Frame::from_rotation_vector(Vector3::zeros(), rotation))
        .collect();
    let is_orientation_free = |target: usize| {
        let is_of_target = |parameter: &&Parameter| matches!(parameter.site, ParameterSite::Target { target: of, axis: 3.. } if of == target);
        let free = |parameter: &&Parameter| parameter.sigma.is_none() && !parameter.is_bounded();
        model.parameters.iter().filter(is_of_target).filter(free).count() == 3
    };
    let nominal = model.base_poses(DVector::zeros(x.len()).as_slice());
    for (base, nominal) in nominal.iter().enumerate() {
        let columns: Vec<(usize, usize)> = model
            .parameters
            .iter()
            .enumerate()
            .filter(|(_, parameter)| parameter.sigma.is_none() && !parameter.is_bounded())
            .filter_map(|(k, parameter)| match parameter.site {
                ParameterSite::Base { base: of, axis } if of == base => Some((axis, k)),
                _ => None,
            })
            .collect();
        let of_base = |pose: &&Pose| pose.base == base;
        let pairs = poses.iter().zip(&points).filter(|(pose, _)| of_base(pose));
        let points: Vec<_> =
            pairs.filter_map(|(pose, point)| Some(((*point)?, *pose.measured))).collect();
        if columns.len() < 6 || points.is_empty() {
            continue;
        }
        let reference_poses =
            oriented.iter().filter(|(pose, _)| of_base(pose) && !is_orientation_free(pose.target));
        let pairs = reference_poses.filter_map(|(pose, last)| {
            Some((last.compose(&target_frames[pose.target]).axes, axes(pose)?))
        });
        let nominal_rotation = best_rotation(pairs).unwrap_or(nominal.rotation);
        let (rotation, translation) = rigid_motion(&points, &nominal_rotation);
        let rotation = rotation - nominal.rotation;
        let translation = translation - nominal.translation;
        for (axis, k) in columns {
            x[k] = if axis < 3 { translation[axis] } else { rotation[axis - 3] };
        }
    }
    register_target_orientations(model, &oriented, x, is_orientation_free);
}

/// Returns the three axes of the measured orientation of a pose, measuring frame; `None` if the row
/// has no orientation.
fn axes(pose: &Pose) -> Option<[Vector3<f64>; 3]> {
    pose.orientation?.axes()
}

/// Sets in `x` the best orientations of the targets for which `is_chosen` returns true. Each pose
/// is paired with the frame of the arm that carries its target, given in the arm's base frame.
fn register_target_orientations(
    model: &Model,
    poses: &[(&Pose, Frame<f64>)],
    x: &mut DVector<f64>,
    is_chosen: impl Fn(usize) -> bool,
) {
    let bases = model.base_frames(x.as_slice());
    let nominal = model.target_rotations(DVector::zeros(x.len()).as_slice());
    for (target, nominal) in nominal.iter().enumerate().filter(|(target, _)| is_chosen(*target)) {
        // The target's rotation R rotates the axes of the frame that carries it into the measured
        // axes, all given in that frame.
        let pairs =
            poses.iter().filter(|(pose, _)| pose.target == target).filter_map(|(pose, last)| {
                let last = bases[pose.base].compose(last);
                Some((
                    [Vector3::x(), Vector3::y(), Vector3::z()],
                    axes(pose)?.map(|axis| last.resolve(&axis)),
                ))
            });
        let Some(rotation) = best_rotation(pairs) else { continue };
        for (k, parameter) in model.parameters.iter().enumerate() {
            if let ParameterSite::Target { target: of, axis: axis @ 3.. } = parameter.site
                && of == target
            {
                x[k] = rotation[axis - 3] - nominal[axis - 3];
            }
        }
    }
}

/// Returns the rotation vector \[rad\] that best rotates the first axes A of each pair into the
/// second axes B; `None` without pairs.
///
/// min over R of Σ ‖R A − B‖²: R = U diag(1, 1, ±1) Vᵀ with the singular value decomposition U D Vᵀ
/// of Σ B Aᵀ  [Arun, Huang & Blostein 1987].
fn best_rotation(
    pairs: impl Iterator<Item = ([Vector3<f64>; 3], [Vector3<f64>; 3])>,
) -> Option<Vector3<f64>> {
    let product = |(from, to): ([Vector3<f64>; 3], [Vector3<f64>; 3])| {
        Matrix3::from_columns(&to) * Matrix3::from_columns(&from).transpose()
    };
    let rotation = nearest_rotation(&pairs.map(product).reduce(|a, b| a + b)?);
    let rotation = Rotation3::from_matrix_unchecked(rotation);
    Some(UnitQuaternion::from_rotation_matrix(&rotation).scaled_axis())
}

/// Returns the rotation vector \[rad\] and translation \[m\] of the rigid motion that best moves
/// the first points of the pairs to the second ones. If the points are collinear, so that the
/// rotation about their line is undetermined, the rotation is `nominal`.
fn rigid_motion(
    pairs: &[(Vector3<f64>, Vector3<f64>)],
    nominal: &Vector3<f64>,
) -> (Vector3<f64>, Vector3<f64>) {
    let n = pairs.len() as f64;
    let (from, to) = pairs
        .iter()
        .fold((Vector3::zeros(), Vector3::zeros()), |(a, b), (p, y)| (a + p / n, b + y / n));
    let s: Matrix3<f64> = pairs.iter().map(|(p, y)| (p - from) * (y - to).transpose()).sum();
    let mut spread = (s.transpose() * s).symmetric_eigenvalues();
    spread.as_mut_slice().sort_by(f64::total_cmp);
    if spread[1] <= MAX_COLLINEAR_RATIO * spread[2] {
        return (*nominal, to - rotate(nominal, &from));
    }
    let skew = Vector3::new(s[(1, 2)] - s[(2, 1)], s[(2, 0)] - s[(0, 2)], s[(0, 1)] - s[(1, 0)]);
    let symmetric = s + s.transpose() - Matrix3::identity() * s.trace();
    let mut normal = Matrix4::zeros();
    normal[(0, 0)] = s.trace();
    normal.fixed_view_mut::<3, 1>(1, 0).copy_from(&skew);
    normal.fixed_view_mut::<1, 3>(0, 1).copy_from(&skew.transpose());
    normal.fixed_view_mut::<3, 3>(1, 1).copy_from(&symmetric);
    let eigen = normal.symmetric_eigen();
    let q = eigen.eigenvectors.column(eigen.eigenvalues.imax());
    let rotation = UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]));
    (rotation.scaled_axis(), to - rotation * from)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_motion_is_found_from_points_in_a_plane() {
        for w in [
            Vector3::zeros(),
            Vector3::new(0.0, 0.0, 3.1),
            Vector3::new(1.0, -2.0, 0.5),
            Vector3::new(2.2, 2.2, 0.0),
        ] {
            let shift = Vector3::new(3.0, -1.0, 0.2);
            let points = [[0.0, 0.0], [1.0, 0.0], [0.0, 2.0], [1.5, 1.0]]
                .map(|[x, y]| Vector3::new(x, y, 0.3));
            let pairs = points.map(|p| (p, rotate(&w, &p) + shift));
            let (found, translation) = rigid_motion(&pairs, &Vector3::zeros());
            for (p, y) in pairs {
                assert!((rotate(&found, &p) + translation - y).norm() < 1e-12, "{w}");
            }
        }
    }
}
