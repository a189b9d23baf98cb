//! Images of the rig: pixels of the points of markers that cameras see.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use rand_chacha::ChaCha8Rng;

use super::chain::PieceFrame;
use super::draw::{Row, between, rounded_command};
use super::equilibrium::Equilibrium;
use super::truth::Truth;
use super::{NoEquilibrium, Rig};
use crate::laws::{At, FOCAL, Law};
use crate::problem::{
    CENTRE_X, Effect, FOCAL_X, Fixture, FixtureKind, JointKind, Observation, PoseConditions,
};
use crate::random::normal;
use crate::spatial::Frame;

/// Maximum number of configurations that are drawn until one shows a point of a marker.
const MAX_DRAWS: usize = 3000;
/// Smallest cosine of the angle between the line of sight and the normal of a flat marker at which
/// its points are found: 60°.
const MIN_COS_INCIDENCE: f64 = 0.5;
/// Largest distance of a marker's point from the plane of the others at which the marker counts as
/// flat. It is a fraction of the marker's size, the largest distance from its first point.
const MAX_FLAT_RATIO: f64 = 0.05;

impl Rig {
    /// Takes images of a pose with all cameras. Returns a row for each marker point in view, with
    /// noise; `None` if there is none. If `may_move` is true, configurations are drawn until one
    /// shows a point, at most [`MAX_DRAWS`] times.
    pub(super) fn take_images(
        &self,
        row: &mut Row,
        truth: &Truth,
        may_move: bool,
        random: &mut ChaCha8Rng,
    ) -> Result<Option<Vec<Row>>, NoEquilibrium> {
        for _ in 0..if may_move { MAX_DRAWS } else { 1 } {
            let seen = self.points_in_view(&row.conditions)?;
            if !seen.is_empty() {
                return Ok(Some(self.rows_of_points(row, truth, seen, random)));
            }
            if may_move {
                let ranges = self.arm.joints.iter().zip(&truth.poses.joints);
                for ((joint, range), q) in ranges.zip(&mut row.conditions.configuration) {
                    if joint.command_kind() != JointKind::Fixed {
                        *q = rounded_command(joint.kind, between(random, *range));
                    }
                }
            }
        }
        Ok(None)
    }

    /// Returns a row for each seen point, with noise on its pixel and the conditions of the pose
    /// `row`. The σ of the noise is that of the truth, or else of the camera.
    fn rows_of_points(
        &self,
        row: &mut Row,
        truth: &Truth,
        seen: Vec<(Observation, [f64; 2])>,
        random: &mut ChaCha8Rng,
    ) -> Vec<Row> {
        let past = std::mem::take(&mut row.conditions.past);
        let of_point = |(observation, [u, v]): (Observation, [f64; 2])| {
            let camera = observation.fixtures()[0].and_then(|camera| self.arm.fixtures.get(camera));
            let sigma = truth
                .kind_sigmas
                .get(observation.kind())
                .copied()
                .or_else(|| camera.and_then(|camera| camera.sigma));
            let mut noisy = |pixel: f64| pixel + sigma.unwrap_or(0.0) * normal(random);
            let position = Vector3::new(noisy(u), noisy(v), 0.0);
            Row { observation, position, orientation: None, ..row.clone() }
        };
        let rows = seen.into_iter().map(of_point).collect();
        row.conditions.past = past;
        rows
    }

    /// Returns the points of markers that cameras see in static equilibrium, with their pixels
    /// without noise.
    fn points_in_view(
        &self,
        conditions: &PoseConditions,
    ) -> Result<Vec<(Observation, [f64; 2])>, NoEquilibrium> {
        let (chain, frames) = self.chain(conditions);
        let equilibrium = Equilibrium::find(&chain).ok_or(NoEquilibrium)?;
        let base = Frame::from_rotation_vector(self.arm.base.translation, &self.arm.base.rotation);
        let base = isometry(&self.mounting_frame(conditions).compose(&base));
        let foot = PieceFrame { piece: Some(0), frame: Frame::identity() };
        let of_fixture = |fixture: &Fixture| {
            let number = |k: usize| fixture.known.get(k).copied().flatten().unwrap_or(0.0);
            let position = Translation3::new(number(0), number(1), number(2));
            let turn = Vector3::new(number(3), number(4), number(5));
            let mounted = Isometry3::from_parts(position, UnitQuaternion::from_scaled_axis(turn));
            let Some(carrier) = fixture.carrier else { return Some(mounted) };
            let carrier = carrier.checked_sub(1).map_or(Some(&foot), |joint| frames.get(joint))?;
            Some(base * isometry(&equilibrium.frame(carrier)) * mounted)
        };
        let mut seen = Vec::new();
        for (camera, lens) in numbered(&self.arm.fixtures, "camera") {
            let lens = &self.lens(lens, conditions);
            let of_camera = of_fixture(lens).ok_or(NoEquilibrium)?;
            for (marker, board) in numbered(&self.arm.fixtures, "marker") {
                if lens.carrier == board.carrier {
                    continue;
                }
                let view = of_camera.inverse() * of_fixture(board).ok_or(NoEquilibrium)?;
                let normal = normal_of(&board.points).map(|normal| view * normal);
                for (number, point) in (0..).zip(&board.points) {
                    let point = view * Point3::from(*point);
                    if let Some(pixel) = pixel(lens, &point, normal.as_ref()) {
                        seen.push((Observation::Pixel(camera, marker, number), pixel));
                    }
                }
            }
        }
        Ok(seen)
    }

    /// Returns a camera with its numbers in a pose, as laws and effects change them.
    fn lens(&self, declared: &Fixture, conditions: &PoseConditions) -> Fixture {
        let mut lens = declared.clone();
        let mut add = |axis: usize, by: f64| {
            if by != 0.0
                && let Some(number) = lens.known.get_mut(axis)
            {
                *number = Some(number.unwrap_or(0.0) + by);
            }
        };
        let is_of = |camera: &String| *camera == declared.name;
        let fields = declared.kind.fields().iter().copied().enumerate();
        for (axis, field) in fields.chain([(FOCAL_X, FOCAL), (FOCAL_X + 1, FOCAL)]) {
            let is_there =
                |law: &Law| law.at() == At::Camera(field) && law.camera() == Some(&declared.name);
            add(axis, self.added_by_laws(conditions, is_there));
        }
        for effect in self.effect_values() {
            match effect {
                (Effect::LensThermalDrift { camera }, [rate]) if is_of(camera) => {
                    let change = rate * self.warming(conditions);
                    (FOCAL_X..CENTRE_X).for_each(|axis| add(axis, change));
                }
                (Effect::LensSag { camera, joint }, [x_sin, x_cos, y_sin, y_cos])
                    if is_of(camera) =>
                {
                    let angle = conditions.configuration.get(joint.wrapping_sub(1)).copied();
                    let (sin, cos) = angle.unwrap_or(0.0).sin_cos();
                    add(CENTRE_X, x_sin * sin + x_cos * cos);
                    add(CENTRE_X + 1, y_sin * sin + y_cos * cos);
                }
                _ => {}
            }
        }
        lens
    }
}

/// Returns the fixtures whose kind has the name `word`, with their indices among all fixtures.
fn numbered<'a>(
    fixtures: &'a [Fixture],
    word: &'static str,
) -> impl Iterator<Item = (u32, &'a Fixture)> {
    (0..).zip(fixtures).filter(move |(_, fixture)| fixture.kind.word() == word)
}

/// Returns the pixel of a point, which is given in the camera frame \[m\]; `None` if it is behind
/// the camera, outside the image, or seen at more than 60° from the `normal` of its marker.
fn pixel(lens: &Fixture, point: &Point3<f64>, normal: Option<&Vector3<f64>>) -> Option<[f64; 2]> {
    let number = |k: usize| lens.known.get(k).copied().flatten().unwrap_or(0.0);
    let is_flat_on = normal.is_none_or(|normal| {
        normal.dot(&point.coords).abs() >= MIN_COS_INCIDENCE * point.coords.norm()
    });
    if point.z <= 0.0 || !is_flat_on {
        return None;
    }
    let [fx, fy, cx, cy, k1, k2] = [6, 7, 8, 9, 10, 11].map(number);
    // Radius and direction of the ray in the image plane at unit distance.
    let (radius, way) = ((point.x / point.z).hypot(point.y / point.z), point.y.atan2(point.x));
    let (a, b) = (radius * way.cos(), radius * way.sin());
    let [x, y] = if lens.kind == FixtureKind::Fisheye {
        let angle = radius.atan();
        let bent = angle
            + k1 * angle.powi(3)
            + k2 * angle.powi(5)
            + number(12) * angle.powi(7)
            + number(13) * angle.powi(9);
        [bent * way.cos(), bent * way.sin()]
    } else {
        let [p1, p2, k3] = [12, 13, 14].map(number);
        let r = radius;
        let radial = 1.0 + k1 * r.powi(2) + k2 * r.powi(4) + k3 * r.powi(6);
        [
            a * radial + 2.0 * p1 * a * b + p2 * (r * r + 2.0 * a * a),
            b * radial + p1 * (r * r + 2.0 * b * b) + 2.0 * p2 * a * b,
        ]
    };
    let [u, v] = [fx * x + cx, fy * y + cy];
    let [width, height] = lens.image.unwrap_or([2.0 * cx, 2.0 * cy]);
    ((0.0..width).contains(&u) && (0.0..height).contains(&v)).then_some([u, v])
}

/// Returns the unit normal of points in a plane; `None` for points in space or on a line, and
/// without points.
fn normal_of(points: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let first = points.first()?;
    let from_first = || points.iter().map(|point| point - first);
    let longest = from_first().max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
    let across = from_first().map(|arm| longest.cross(&arm));
    let across = across.max_by(|a, b| a.norm().total_cmp(&b.norm()))?;
    let size = longest.norm();
    let normal = across.try_normalize(MAX_FLAT_RATIO * size * size)?;
    from_first().all(|arm| arm.dot(&normal).abs() <= MAX_FLAT_RATIO * size).then_some(normal)
}

/// Returns a frame as a rigid motion.
fn isometry(frame: &Frame<f64>) -> Isometry3<f64> {
    let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&frame.axes));
    Isometry3::from_parts(Translation3::from(frame.origin), turn.into())
}
