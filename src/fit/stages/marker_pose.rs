//! Pose of a marker in the frame of a camera that sees it.

use nalgebra::{
    DMatrix, Isometry3, Matrix3, Rotation3, SMatrix, SVector, SymmetricEigen, Translation3,
    UnitQuaternion, Vector3,
};

use crate::observation::{FixtureValues, slopes_of_pixel};

/// Largest ratio of the smallest to the largest spread of points at which they count as coplanar.
const MAX_COPLANAR_RATIO: f64 = 1e-6;
/// Minimum number of points from which a pose is computed: coplanar points, and points in space.
const MIN_POINTS: [usize; 2] = [MIN_POINTS_OF_POSE, 6];
/// Minimum number of points of any marker from which a pose is computed.
pub(super) const MIN_POINTS_OF_POSE: usize = 4;
/// Number of Gauss–Newton steps that refine the linear pose.
const REFINEMENT_STEPS: usize = 10;

/// Returns the pose of a marker in the camera's frame, by the direct linear transform and a
/// refinement. `points` holds the points of the marker \[m\], marker frame, with their pixels.
/// `None` if they do not determine the pose.
pub(super) fn marker_in_camera(
    camera: &FixtureValues<f64>,
    points: &[(Vector3<f64>, [f64; 2])],
) -> Option<Isometry3<f64>> {
    let slopes: Vec<[f64; 2]> =
        points.iter().map(|(_, pixel)| slopes_of_pixel(camera, *pixel)).collect();
    let places: Vec<Vector3<f64>> = points.iter().map(|(place, _)| *place).collect();
    let start = linear_pose(&places, &slopes)?;
    refined(start, &places, &slopes)
}

/// Returns the pose of a marker in the camera's frame by the direct linear transform, from its
/// points `places` \[m\], marker frame, and their undistorted image coordinates `slopes` (x/z,
/// y/z).
///
/// In the principal axes of the points, it solves for the columns of (r₁ r₂ t), or (r₁ r₂ r₃ t) for
/// points in space, up to scale. `None` if the points are too few or lie on a line.
fn linear_pose(places: &[Vector3<f64>], slopes: &[[f64; 2]]) -> Option<Isometry3<f64>> {
    let middle = places.iter().sum::<Vector3<f64>>() / places.len() as f64;
    let axes = principal_axes(places.iter(), &middle);
    let [first, second, third] = axes.map(|(_, squares)| squares.max(0.0).sqrt());
    let is_flat = third < MAX_COPLANAR_RATIO * first;
    let (min_points, columns) = if is_flat { (MIN_POINTS[0], 3) } else { (MIN_POINTS[1], 4) };
    if places.len() < min_points || second < MAX_COPLANAR_RATIO * first {
        return None;
    }
    let [(x, _), (y, _), _] = axes;
    let axes = Matrix3::from_columns(&[x, y, x.cross(&y)]);
    let scale = first / (places.len() as f64).sqrt();
    let mut matrix = DMatrix::zeros(2 * places.len(), 3 * columns);
    for (k, (place, slope)) in places.iter().zip(slopes).enumerate() {
        let local = axes.transpose() * (place - middle) / scale;
        let mut entries = local.as_slice()[..columns - 1].to_vec();
        entries.push(1.0);
        for (column, entry) in entries.into_iter().enumerate() {
            for axis in 0..2 {
                matrix[(2 * k + axis, 3 * column + axis)] = entry;
                matrix[(2 * k + axis, 3 * column + 2)] = -entry * slope[axis];
            }
        }
    }
    let normal = SymmetricEigen::new(matrix.transpose() * &matrix);
    let smallest = normal.eigenvalues.imin();
    let solution = normal.eigenvectors.column(smallest);
    let column = |k: usize| Vector3::new(solution[3 * k], solution[3 * k + 1], solution[3 * k + 2]);
    let shift = column(columns - 1);
    // The points are in front of the camera.
    let sign = if shift.z < 0.0 { -1.0 } else { 1.0 };
    let [first, second] = [column(0) * sign, column(1) * sign];
    let third = if is_flat { first.cross(&second) } else { column(2) * sign };
    let length = if is_flat {
        f64::midpoint(first.norm(), second.norm())
    } else {
        (first.norm() + second.norm() + third.norm()) / 3.0
    };
    let third = if is_flat { third / length } else { third };
    let turn = nearest_rotation(&Matrix3::from_columns(&[first, second, third]));
    let rotation = Rotation3::from_matrix(&(turn * axes.transpose()));
    let shift = shift * sign * scale / length - rotation * middle;
    shift
        .iter()
        .all(|x| x.is_finite())
        .then(|| Isometry3::from_parts(Translation3::from(shift), rotation.into()))
}

/// Returns the pose of a marker with the smallest squared error of the image coordinates `slopes`
/// (x/z, y/z) of its points `places`, by Gauss–Newton steps from `pose`. `None` if a point is
/// behind the camera, or the points do not determine the pose.
fn refined(
    mut pose: Isometry3<f64>,
    places: &[Vector3<f64>],
    slopes: &[[f64; 2]],
) -> Option<Isometry3<f64>> {
    for _ in 0..REFINEMENT_STEPS {
        let (mut normal, mut right) = (SMatrix::<f64, 6, 6>::zeros(), SVector::<f64, 6>::zeros());
        for (place, slope) in places.iter().zip(slopes) {
            let turned = pose.rotation * place;
            let in_camera = turned + pose.translation.vector;
            if in_camera.z <= 0.0 {
                return None;
            }
            for axis in 0..2 {
                let mut by_position = Vector3::zeros();
                by_position[axis] = 1.0 / in_camera.z;
                by_position.z = -in_camera[axis] / (in_camera.z * in_camera.z);
                let by_turn = turned.cross(&by_position);
                let row =
                    SVector::<f64, 6>::from_iterator(by_position.iter().chain(&by_turn).copied());
                normal += row * row.transpose();
                right += row * (slope[axis] - in_camera[axis] / in_camera.z);
            }
        }
        let step = normal.cholesky()?.solve(&right);
        pose.translation.vector += step.fixed_rows::<3>(0);
        let turn = UnitQuaternion::from_scaled_axis(step.fixed_rows::<3>(3).into_owned());
        pose.rotation = turn * pose.rotation;
    }
    let in_front = places.iter().all(|place| (pose * nalgebra::Point3::from(*place)).z > 0.0);
    in_front.then_some(pose)
}

/// Returns the principal directions of points about their `centre`, with the sums of squares along
/// them, largest first.
pub(super) fn principal_axes<'a>(
    points: impl Iterator<Item = &'a Vector3<f64>>,
    centre: &Vector3<f64>,
) -> [(Vector3<f64>, f64); 3] {
    let spread: Matrix3<f64> =
        points.map(|point| (point - centre) * (point - centre).transpose()).sum();
    let eigen = SymmetricEigen::new(spread);
    let mut order = [0, 1, 2];
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    order.map(|k| (eigen.eigenvectors.column(k).into_owned(), eigen.eigenvalues[k]))
}

/// Returns the rotation matrix nearest to `matrix` in the Frobenius norm; the identity if `matrix`
/// has no singular value decomposition.
pub(super) fn nearest_rotation(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let svd = matrix.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Matrix3::identity() };
    let mirror = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, (u * v_t).determinant().signum()));
    u * mirror * v_t
}
