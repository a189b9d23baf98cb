//! Start values of fixtures (points, anchors, surfaces, cameras, markers) in closed form, from the
//! target positions that the arm predicts.

use nalgebra::{DMatrix, DVector, Vector3};

use super::camera_start::{poses_from_views, undetermined_pair};
use super::marker_pose::principal_axes;
use crate::model::parameter::{Parameter, ParameterSite};
use crate::model::{Model, Pose};
use crate::problem::FixtureKind;
use crate::problem::fixture::lean;
use crate::spatial::plane_normal;

/// Largest ratio of the rms distance of points from their best plane to their spread within it, at
/// which the points count as coplanar.
const MAX_COPLANAR_RATIO: f64 = 1e-3;
/// Smallest difference of a measured offset from the mean at which offsets decide to which side the
/// normal of a plane points \[m\].
const MIN_OFFSET_DIFFERENCE: f64 = 1e-4;
/// Smallest distance of the arm's base from a plane at which the base decides to which side the
/// normal points, if the measured offsets do not decide it \[m\].
const MIN_BASE_DISTANCE: f64 = 0.05;

/// Locates fixtures in closed form from the `poses` that measure against them and writes their
/// parameters into the full parameter vector `x`.
///
/// It sets parameters that are free without prior and bounds, have no declared value, and for whose
/// index `chosen` returns true. Fixtures that no pose measures keep their values.
pub(crate) fn locate(
    model: &Model,
    poses: &[Pose],
    chosen: impl Fn(usize) -> bool,
    x: &mut DVector<f64>,
) {
    let free = free_coordinates(model, chosen);
    if free.is_empty() {
        return;
    }
    locate_cameras(model, poses, &free, x);
    let bases = model.base_frames(x.as_slice());
    let points = model.predicted_targets_in_base(poses, x.as_slice());
    let mut first = 0;
    while let Some(&(fixture, kind, ..)) = free.get(first) {
        let parameters: Vec<_> = free.iter().filter(|(of, ..)| *of == fixture).collect();
        first += parameters.len();
        let touches = |(pose, point): (&Pose, &Option<Vector3<f64>>)| {
            (pose.observation.fixture() == Some(fixture))
                .then(|| Some((bases[pose.base].point(point.as_ref()?), pose.measured.x)))?
        };
        let contacts: Vec<(Vector3<f64>, f64)> =
            poses.iter().zip(&points).filter_map(touches).collect();
        let base = poses.iter().find(|pose| pose.observation.fixture() == Some(fixture));
        let base = base.map_or(Vector3::zeros(), |pose| bases[pose.base].origin);
        let Some(mut found) = fixture_of_contacts(kind, &contacts, &base) else { continue };
        if kind == FixtureKind::Plane && model.declares_fixture_coordinate(fixture, 0) {
            // The normal is declared, so that only the distance is free.
            let [rx, ry, ..] = model.fixtures(x.as_slice())[fixture].numbers;
            found[2] = plane_distance(&contacts, &plane_normal(rx, ry));
        }
        for &&(_, _, axis, k) in &parameters {
            x[k] = found[axis] - model.parameters[k].nominal;
        }
    }
}

/// Returns the coordinates of fixtures that [`locate`] sets, as (fixture, kind, axis, index of the
/// parameter): free without prior and bounds, without a declared value, and chosen.
fn free_coordinates(
    model: &Model,
    chosen: impl Fn(usize) -> bool,
) -> Vec<(usize, FixtureKind, usize, usize)> {
    let free = |(k, parameter): (usize, &Parameter)| match parameter.site {
        ParameterSite::Fixture { fixture, kind, axis }
            if parameter.sigma.is_none()
                && !parameter.is_bounded()
                && !model.declares_fixture_coordinate(fixture, axis)
                && chosen(k) =>
        {
            Some((fixture, kind, axis, k))
        }
        _ => None,
    };
    model.parameters.iter().enumerate().filter_map(free).collect()
}

/// Returns the indices of the cameras and markers whose pose is free in all six coordinates.
fn wanted_poses(free: &[(usize, FixtureKind, usize, usize)]) -> Vec<usize> {
    let is_of_pose =
        |(_, kind, axis, _): &&(usize, FixtureKind, usize, usize)| kind.has_pose() && *axis < 6;
    let mut wanted: Vec<usize> = free.iter().map(|(fixture, ..)| *fixture).collect();
    wanted.dedup();
    wanted.retain(|fixture| {
        free.iter().filter(is_of_pose).filter(|(of, ..)| of == fixture).count() == 6
    });
    wanted
}

/// Returns a camera and a marker whose free poses the views in `poses` do not determine at the full
/// parameter vector `x`, with the reason; `None` if the views determine all of them.
pub(crate) fn undecided_views(
    model: &Model,
    poses: &[Pose],
    x: &DVector<f64>,
) -> Option<([usize; 2], &'static str)> {
    let wanted = wanted_poses(&free_coordinates(model, |_| true));
    if wanted.is_empty() { None } else { undetermined_pair(model, poses, &wanted, x) }
}

/// Sets in `x` the poses of the cameras and markers that are free in all six coordinates, as far as
/// the views in `poses` determine them.
fn locate_cameras(
    model: &Model,
    poses: &[Pose],
    free: &[(usize, FixtureKind, usize, usize)],
    x: &mut DVector<f64>,
) {
    let of_pose = |fixture: usize| {
        free.iter()
            .filter(move |(of, kind, axis, _)| *of == fixture && kind.has_pose() && *axis < 6)
    };
    let wanted = wanted_poses(free);
    if wanted.is_empty() {
        return;
    }
    for (fixture, pose) in poses_from_views(model, poses, &wanted, x) {
        let (at, turn) = (pose.translation.vector, pose.rotation.scaled_axis());
        for (&(.., k), number) in of_pose(fixture).zip(at.iter().chain(&turn)) {
            x[k] = number - model.parameters[k].nominal;
        }
    }
}

/// Returns the parameters of a fixture that fit its contacts best, in the order of its axes. A
/// contact is a predicted target and the measured distance or offset \[m\]. Targets and `base`, the
/// origin of the arm's base, are in the measuring frame. `None` if there are no contacts, or for
/// cameras and markers.
fn fixture_of_contacts(
    kind: FixtureKind,
    contacts: &[(Vector3<f64>, f64)],
    base: &Vector3<f64>,
) -> Option<[f64; 4]> {
    if contacts.is_empty() {
        return None;
    }
    let numbers = |place: Vector3<f64>, last: f64| [place.x, place.y, place.z, last];
    let values = match kind {
        FixtureKind::Point => numbers(centre(contacts), 0.0),
        FixtureKind::Anchor => numbers(anchor(contacts), 0.0),
        FixtureKind::Sphere => {
            let (place, radius) = sphere(contacts);
            numbers(place, radius)
        }
        FixtureKind::Plane => plane(contacts, base),
        FixtureKind::Camera | FixtureKind::Fisheye | FixtureKind::Marker => return None,
    };
    values.iter().all(|number| number.is_finite()).then_some(values)
}

/// Returns the centroid (mean position) of the predicted points of some contacts \[m\].
fn centre(contacts: &[(Vector3<f64>, f64)]) -> Vector3<f64> {
    contacts.iter().map(|(point, _)| point).sum::<Vector3<f64>>() / contacts.len() as f64
}

/// Returns the least-squares solution u of the equations a·u = b given by rows (a, b); `None` if
/// there are no rows.
fn least_squares(rows: &[(Vec<f64>, f64)]) -> Option<DVector<f64>> {
    let n = rows.first()?.0.len();
    let matrix = DMatrix::from_fn(rows.len(), n, |i, j| rows[i].0[j]);
    let right = DVector::from_iterator(rows.len(), rows.iter().map(|(_, b)| *b));
    let size = matrix.amax();
    matrix.svd(true, true).solve(&right, 1e-12 * size).ok()
}

/// Returns the position of the anchor A that has the measured distances ℓ from the points p:
/// ‖p‖² − ℓ² = 2 p·A − ‖A‖² is linear in A and ‖A‖².
///
/// If the points lie in a plane, the distance of the anchor from the plane follows from ‖A‖². Of
/// the two sides, the one that fits better is taken, or the upper one if both fit equally.
fn anchor(contacts: &[(Vector3<f64>, f64)]) -> Vector3<f64> {
    let centre = centre(contacts);
    let axes = principal_axes(contacts.iter().map(|(point, _)| point), &centre);
    let flat = axes[2].1 < MAX_COPLANAR_RATIO * MAX_COPLANAR_RATIO * axes[1].1;
    let used = if flat { &axes[..2] } else { &axes[..] };
    let row = |(point, length): &(Vector3<f64>, f64)| {
        let p = point - centre;
        let mut row: Vec<f64> = used.iter().map(|(axis, _)| 2.0 * axis.dot(&p)).collect();
        row.push(-1.0);
        (row, p.norm_squared() - length * length)
    };
    let Some(solved) = least_squares(&contacts.iter().map(row).collect::<Vec<_>>()) else {
        return centre;
    };
    let within: Vector3<f64> = used.iter().zip(solved.iter()).map(|((axis, _), &u)| axis * u).sum();
    if !flat {
        return centre + within;
    }
    let height = (solved[2] - within.norm_squared()).max(0.0).sqrt();
    let up = if axes[2].0.z < 0.0 { -axes[2].0 } else { axes[2].0 };
    let misfit = |at: &Vector3<f64>| -> f64 {
        contacts.iter().map(|(point, length)| ((point - at).norm() - length).powi(2)).sum()
    };
    let sides = [centre + within + up * height, centre + within - up * height];
    if misfit(&sides[1]) < misfit(&sides[0]) { sides[1] } else { sides[0] }
}

/// Returns the centre C and the radius ρ of the sphere that the points p touch, ‖p‖² = 2 p·C +
/// (ρ² − ‖C‖²), which is linear in C and the bracket. Measured offsets of points from the surface,
/// positive outwards, only correct the radius.
fn sphere(contacts: &[(Vector3<f64>, f64)]) -> (Vector3<f64>, f64) {
    let middle = centre(contacts);
    let row = |(point, _): &(Vector3<f64>, f64)| {
        let p = point - middle;
        (vec![2.0 * p.x, 2.0 * p.y, 2.0 * p.z, 1.0], p.norm_squared())
    };
    let Some(solved) = least_squares(&contacts.iter().map(row).collect::<Vec<_>>()) else {
        return (middle, 0.0);
    };
    let place = middle + Vector3::new(solved[0], solved[1], solved[2]);
    let radius =
        contacts.iter().map(|(point, offset)| (point - place).norm() - offset).sum::<f64>();
    (place, radius / contacts.len() as f64)
}

/// Returns the parameters (rx, ry, d, 0) of the plane from which the points have the smallest
/// spread. Its normal points to the side of larger offsets. If these do not differ, the normal
/// points to the arm's base, or up if the base is near the plane.
fn plane(contacts: &[(Vector3<f64>, f64)], base: &Vector3<f64>) -> [f64; 4] {
    let n = contacts.len() as f64;
    let middle = centre(contacts);
    let offset = contacts.iter().map(|(_, offset)| offset).sum::<f64>() / n;
    let normal = principal_axes(contacts.iter().map(|(point, _)| point), &middle)[2].0;
    let along: f64 = contacts
        .iter()
        .map(|(point, measured)| normal.dot(&(point - middle)) * (measured - offset))
        .sum::<f64>()
        / n;
    let differ = contacts.iter().map(|(_, measured)| (measured - offset).abs()).fold(0.0, f64::max)
        > MIN_OFFSET_DIFFERENCE;
    let to_base = normal.dot(&(base - middle));
    let side = match differ {
        true => along,
        false if to_base.abs() > MIN_BASE_DISTANCE => to_base,
        false => normal.z,
    };
    let normal = if side < 0.0 { -normal } else { normal };
    let [rx, ry] = lean(&normal);
    [rx, ry, plane_distance(contacts, &normal), 0.0]
}

/// Returns the signed distance d of the plane with this unit normal from the origin \[m\], positive
/// along the normal: the mean of n·p − offset over the contacts.
fn plane_distance(contacts: &[(Vector3<f64>, f64)], normal: &Vector3<f64>) -> f64 {
    contacts.iter().map(|(point, offset)| normal.dot(point) - offset).sum::<f64>()
        / contacts.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points() -> Vec<Vector3<f64>> {
        (0..12_u8)
            .map(f64::from)
            .map(|k| {
                Vector3::new((1.3 * k).sin(), (2.1 * k).cos(), 0.4 * (0.7 * k).sin())
                    + Vector3::new(0.2, 0.3, 0.5)
            })
            .collect()
    }

    #[test]
    fn every_kind_is_found_from_exact_contacts() {
        let at = Vector3::new(0.4, -1.1, 1.7);
        let distances: Vec<_> = points().into_iter().map(|p| (p, (p - at).norm())).collect();
        assert!((anchor(&distances) - at).norm() < 1e-9);
        let flat: Vec<_> = points()
            .into_iter()
            .map(|p| Vector3::new(p.x, p.y, 0.5))
            .map(|p| (p, (p - at).norm()))
            .collect();
        assert!((anchor(&flat) - at).norm() < 1e-6, "{}", anchor(&flat));
        let ball: Vec<_> =
            points().iter().map(|p| (at + (p - at).normalize() * 0.3, 0.0)).collect();
        let (place, radius) = sphere(&ball);
        assert!((place - at).norm() < 1e-9 && (radius - 0.3).abs() < 1e-9);
        let normal = Vector3::new(0.2, -0.3, -0.9).normalize();
        for offset in [0.0, 0.004] {
            let touch = |(k, p): (usize, &Vector3<f64>)| {
                let measured = offset * k as f64;
                (p - normal * (normal.dot(p) - 0.7 - measured), measured)
            };
            let wall: Vec<_> = points().iter().enumerate().map(touch).collect();
            let [rx, ry, d, _] = plane(&wall, &(normal * 3.0));
            let found = plane_normal(rx, ry);
            assert!((found - normal).norm() < 0.05 && (d - 0.7).abs() < 0.05, "{found} {d}");
        }
    }
}
