//! Start values of the poses of cameras and markers, from linear equations of the views; no guess
//! of the caller is needed.

use std::collections::BTreeMap;

use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix3, Point3, Rotation3, SMatrix, Translation3, Vector3,
};
use rand::seq::SliceRandom as _;

use super::marker_pose::{marker_in_camera, nearest_rotation};
use crate::model::{Model, Pose};
use crate::observation::{FixtureValues, Needs, slopes_of_pixel};
use crate::random;
use crate::spatial::Frame;

/// Smallest ratio of the second smallest to the largest singular value of the rotation equations at
/// which the views determine the rotations of camera and marker.
const MIN_SINGULAR_VALUE_RATIO: f64 = 1e-4;
/// Minimum number of views, each with a marker pose, from which camera and marker are solved
/// together.
const MIN_VIEWS: usize = 3;
/// Typical angle \[rad\] by which the points of a view miss poses of camera and marker, up to which
/// these poses are a good start.
const GOOD_ANGLE: f64 = 0.02;
/// Number of draws of a few views from which poses are solved if all views together give a bad
/// start. If a quarter of the views is spoiled, 42 % of the draws have none of these.
const DRAWS: u64 = 12;

/// View of one marker by one camera in one configuration.
struct View {
    camera: usize,
    marker: usize,
    /// Pose of the frame that carries the camera in the frame that carries the marker.
    carrier: Isometry3<f64>,
    /// Pose of the marker in the camera's frame, translation \[m\].
    marker_in_camera: Isometry3<f64>,
    /// Seen points \[m\], marker frame, with the unit vectors of their rays in the camera's frame.
    rays: Vec<(Vector3<f64>, Vector3<f64>)>,
}

impl View {
    /// Returns the rms angle \[rad\] between the rays of the points and their directions with these
    /// poses of camera and marker in the frames that carry them.
    fn miss(&self, [camera, marker]: &[Isometry3<f64>; 2]) -> f64 {
        let seen = (self.carrier * camera).inverse() * marker;
        let square = |(point, ray): &(Vector3<f64>, Vector3<f64>)| {
            let at = (seen * Point3::from(*point)).coords;
            at.angle(ray).powi(2)
        };
        (self.rays.iter().map(square).sum::<f64>() / self.rays.len().max(1) as f64).sqrt()
    }

    /// Returns the difference between the marker's pose in the camera's frame that its points give
    /// and that of these poses of camera and marker: rotation \[rad\] and shift relative to the
    /// distance.
    fn difference(&self, [camera, marker]: &[Isometry3<f64>; 2]) -> f64 {
        let seen = (self.carrier * camera).inverse() * marker;
        let located = &self.marker_in_camera;
        let shift = (seen.translation.vector - located.translation.vector).norm();
        located.rotation.angle_to(&seen.rotation) + shift / located.translation.vector.norm()
    }
}

/// Returns the poses of the `wanted` cameras and markers in the frames that carry them, as far as
/// the views in `poses` determine them at the full parameter vector `x`.
///
/// In each view, the marker's pose V in the camera's frame follows from its points. With the pose A
/// of the frame that carries the camera in the one that carries the marker, A C V = M. C is the
/// pose of the camera and M that of the marker in the frame that carries it. If both are unknown,
/// all views of the pair determine them together [Shah 2013].
pub(super) fn poses_from_views(
    model: &Model,
    poses: &[Pose],
    wanted: &[usize],
    x: &DVector<f64>,
) -> BTreeMap<usize, Isometry3<f64>> {
    let fixtures = model.fixtures(x.as_slice());
    let views = views(model, poses, &fixtures, x);
    let declared = (0..fixtures.len()).filter(|fixture| !wanted.contains(fixture));
    let mut located: BTreeMap<usize, Isometry3<f64>> =
        declared.map(|fixture| (fixture, isometry(&fixtures[fixture].frame()))).collect();
    loop {
        let half_located = views
            .iter()
            .find(|view| located.contains_key(&view.camera) != located.contains_key(&view.marker));
        if let Some(view) = half_located {
            let is_of_pair =
                |other: &&View| (other.camera, other.marker) == (view.camera, view.marker);
            let of_pair: Vec<&View> = views.iter().filter(is_of_pair).collect();
            let solve = |views: &[&View]| {
                if let Some(camera) = located.get(&view.camera) {
                    let marker = |view: &&View| view.carrier * camera * view.marker_in_camera;
                    return [*camera, mean_pose(views.iter().map(marker))];
                }
                let marker = located.get(&view.marker).copied().unwrap_or_default();
                let camera = |view: &&View| {
                    view.carrier.inverse() * marker * view.marker_in_camera.inverse()
                };
                [mean_pose(views.iter().map(camera)), marker]
            };
            let [camera, marker] =
                agreed(&of_pair, 1, |views| Some(solve(views))).unwrap_or_else(|| solve(&of_pair));
            located.insert(view.camera, camera);
            located.insert(view.marker, marker);
            continue;
        }
        let mut of_pairs: BTreeMap<(usize, usize), Vec<&View>> = BTreeMap::new();
        for view in views.iter().filter(|view| !located.contains_key(&view.camera)) {
            of_pairs.entry((view.camera, view.marker)).or_default().push(view);
        }
        let mut by_count: Vec<_> = of_pairs.into_iter().collect();
        by_count.sort_by_key(|(_, views)| std::cmp::Reverse(views.len()));
        let solved = by_count.iter().find_map(|((camera, marker), views)| {
            Some((*camera, *marker, agreed(views, MIN_VIEWS, solve_pair)?))
        });
        let Some((camera, marker, [of_camera, of_marker])) = solved else { break };
        located.insert(camera, of_camera);
        located.insert(marker, of_marker);
    }
    located.retain(|fixture, _| wanted.contains(fixture));
    located
}

/// Returns a `wanted` camera and a `wanted` marker whose poses the views do not determine, with the
/// reason; `None` if no view shows such a pair.
pub(super) fn undetermined_pair(
    model: &Model,
    poses: &[Pose],
    wanted: &[usize],
    x: &DVector<f64>,
) -> Option<([usize; 2], &'static str)> {
    let located = poses_from_views(model, poses, wanted, x);
    let is_open = |fixture: &usize| wanted.contains(fixture) && !located.contains_key(fixture);
    let views = views(model, poses, &model.fixtures(x.as_slice()), x);
    let open = views.iter().find(|view| is_open(&view.camera) && is_open(&view.marker))?;
    let pair = [open.camera, open.marker];
    let count = views.iter().filter(|view| [view.camera, view.marker] == pair).count();
    let why = if count < MIN_VIEWS {
        "fewer than three configurations show them together"
    } else {
        "the camera does not turn about two axes that are not parallel"
    };
    Some((pair, why))
}

/// Returns the views in which the marker has enough measured points to determine its pose in the
/// camera's frame.
fn views(
    model: &Model,
    poses: &[Pose],
    fixtures: &[FixtureValues<f64>],
    x: &DVector<f64>,
) -> Vec<View> {
    let of_cameras =
        poses.iter().filter(|pose| pose.observation.description().needs == Needs::Carriers);
    let of_cameras: Vec<Pose> = of_cameras.copied().collect();
    let carriers = model.carrier_frames(&of_cameras, x.as_slice());
    let bits = |frame: &Frame<f64>| -> Vec<u64> {
        let numbers = frame.axes.iter().chain([&frame.origin]).flatten();
        numbers.map(|number| number.to_bits()).collect()
    };
    let mut points: BTreeMap<_, Vec<(Vector3<f64>, [f64; 2])>> = BTreeMap::new();
    let mut carriers_of = BTreeMap::new();
    for (pose, carriers) in of_cameras.iter().zip(carriers) {
        let ([Some(camera), Some(marker)], Some(carriers)) =
            (pose.observation.fixtures(), carriers)
        else {
            continue;
        };
        let key = (camera, marker, bits(&carriers[0]), bits(&carriers[1]));
        carriers_of.insert(key.clone(), carriers);
        let pixel = [pose.measured.x, pose.measured.y];
        points.entry(key).or_default().push((model.fixture_point(pose.observation), pixel));
    }
    let view = |(key, points): (_, Vec<_>)| {
        let [of_camera, of_marker] = carriers_of.get(&key)?.each_ref().map(isometry);
        let (camera, marker, ..) = key;
        let ray = |(point, pixel): &(Vector3<f64>, [f64; 2])| {
            let [x, y] = slopes_of_pixel(&fixtures[camera], *pixel);
            (*point, Vector3::new(x, y, 1.0).normalize())
        };
        Some(View {
            camera,
            marker,
            carrier: of_marker.inverse() * of_camera,
            marker_in_camera: marker_in_camera(&fixtures[camera], &points)?,
            rays: points.iter().map(ray).collect(),
        })
    };
    points.into_iter().filter_map(view).collect()
}

/// Returns the poses of camera and marker on which most of `views` agree; `solve` finds them from
/// at least `fewest` views. `None` if all views together do not determine them.
///
/// A view whose points lie near a line, or show the marker from afar, may have a marker pose that
/// is far from the true one, and a single one of these spoils the solution of all views. If that
/// solution is no good start, poses are also solved from draws of a few views [Fischler & Bolles
/// 1981], each followed by the half of the views that differs least [Rousseeuw 1984]. The poses with
/// the smallest median miss of the points are taken.
fn agreed(
    views: &[&View],
    fewest: usize,
    solve: impl Fn(&[&View]) -> Option<[Isometry3<f64>; 2]>,
) -> Option<[Isometry3<f64>; 2]> {
    let miss = |found: &[Isometry3<f64>; 2]| {
        let mut misses: Vec<f64> = views.iter().map(|view| view.miss(found)).collect();
        misses.sort_by(f64::total_cmp);
        misses[misses.len() / 2]
    };
    let mut best = solve(views)?;
    let mut least = miss(&best);
    let half = views.len().div_ceil(2);
    if least <= GOOD_ANGLE || half < fewest {
        return Some(best);
    }
    for draw in 0..DRAWS {
        if least <= GOOD_ANGLE {
            break;
        }
        let mut chosen = views.to_vec();
        chosen.shuffle(&mut random::stream(0, draw));
        chosen.truncate(fewest);
        for _ in 0..2 {
            let Some(found) = solve(&chosen) else { break };
            let miss = miss(&found);
            if miss < least {
                (best, least) = (found, miss);
            }
            chosen = views.to_vec();
            chosen.sort_by(|a, b| a.difference(&found).total_cmp(&b.difference(&found)));
            chosen.truncate(half);
        }
    }
    Some(best)
}

/// Returns the poses C of the camera and M of the marker from all views of the pair, A C V = M;
/// `None` if the views do not determine them. A is `carrier` and V `marker_in_camera` of a view.
///
/// For the rotations, (Vᵀ ⊗ A) vec C − vec M = 0 is linear; for the translations,
/// A t_C − t_M = −t_A − A C t_V.
fn solve_pair(views: &[&View]) -> Option<[Isometry3<f64>; 2]> {
    if views.len() < MIN_VIEWS {
        return None;
    }
    let mut normal = SMatrix::<f64, 18, 18>::zeros();
    for view in views {
        let turn = |pose: &Isometry3<f64>| *pose.rotation.to_rotation_matrix().matrix();
        let of_camera = turn(&view.marker_in_camera).transpose().kronecker(&turn(&view.carrier));
        let mut rows = SMatrix::<f64, 9, 18>::zeros();
        rows.fixed_view_mut::<9, 9>(0, 0).copy_from(&of_camera);
        rows.fixed_view_mut::<9, 9>(0, 9).fill_with_identity();
        rows.fixed_view_mut::<9, 9>(0, 9).neg_mut();
        normal += rows.transpose() * rows;
    }
    let eigen = normal.symmetric_eigen();
    let mut order: Vec<usize> = (0..18).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    let largest = eigen.eigenvalues[order[17]];
    if eigen.eigenvalues[order[1]] < MIN_SINGULAR_VALUE_RATIO.powi(2) * largest {
        return None;
    }
    let solution = eigen.eigenvectors.column(order[0]);
    let matrix = |first: usize| Matrix3::from_fn(|i, j| solution[first + 3 * j + i]);
    let sign = matrix(0).determinant().signum();
    let [camera, marker] =
        [0, 9].map(|first| Rotation3::from_matrix(&nearest_rotation(&(matrix(first) * sign))));
    let mut matrix = DMatrix::zeros(3 * views.len(), 6);
    let mut right = DVector::zeros(3 * views.len());
    for (k, view) in views.iter().enumerate() {
        let turn = view.carrier.rotation.to_rotation_matrix();
        matrix.fixed_view_mut::<3, 3>(3 * k, 0).copy_from(turn.matrix());
        matrix.fixed_view_mut::<3, 3>(3 * k, 3).copy_from(&-Matrix3::identity());
        let shift = view.carrier.translation.vector
            + turn * (camera * view.marker_in_camera.translation.vector);
        right.fixed_rows_mut::<3>(3 * k).copy_from(&-shift);
    }
    let size = matrix.amax();
    let solved = matrix.svd(true, true).solve(&right, 1e-9 * size).ok()?;
    let pose = |first: usize, rotation: Rotation3<f64>| {
        let translation = Vector3::new(solved[first], solved[first + 1], solved[first + 2]);
        Isometry3::from_parts(Translation3::from(translation), rotation.into())
    };
    let found = [pose(0, camera), pose(3, marker)];
    found.iter().all(|pose| pose.translation.vector.iter().all(|x| x.is_finite())).then_some(found)
}

/// Returns the mean of poses: the mean position, and the rotation nearest to the mean of the
/// rotation matrices.
fn mean_pose(poses: impl Iterator<Item = Isometry3<f64>>) -> Isometry3<f64> {
    let (mut turn, mut shift, mut count) = (Matrix3::zeros(), Vector3::zeros(), 0.0);
    for pose in poses {
        turn += pose.rotation.to_rotation_matrix().matrix();
        shift += pose.translation.vector;
        count += 1.0;
    }
    let rotation = Rotation3::from_matrix(&nearest_rotation(&turn));
    Isometry3::from_parts(Translation3::from(shift / count), rotation.into())
}

/// Returns a frame as the rigid motion from its coordinates to those of the reference frame.
fn isometry(frame: &Frame<f64>) -> Isometry3<f64> {
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&frame.axes));
    Isometry3::from_parts(Translation3::from(frame.origin), rotation.into())
}
