//! Pixel of a point of a marker in the image of a camera.

use nalgebra::Vector3;

use super::lens::distorted;
use super::{Content, Field, Kind, Needs, Scene};
use crate::quantity::Unit;
use crate::scalar::Scalar;

pub(super) const KIND: Kind = Kind {
    name: "pixel",
    numbers: 2,
    unit: Unit::Pixel,
    needs: Needs::Carriers,
    fields: &[
        Field::new("camera", "a camera", Content::Fixture),
        Field::new("marker", "a marker", Content::Fixture),
        Field::new("point", "a point", Content::Index),
        Field::new("u", "a pixel", Content::Number(Unit::Pixel)),
        Field::new("v", "a pixel", Content::Number(Unit::Pixel)),
    ],
    declared_by: "[[camera]] and [[marker]]",
    lacking: "its pixel",
    residuals: ("pixel", &["u", "v"]),
    error_label: "reprojection, px",
    row: ("point in an image", "points in images"),
    measured: "pixels",
    suspects: "the names in the columns camera and marker, and the numbers in the column point",
};

/// Predicts the pixel (u, v) of the marker's point \[px\]; NaN behind the camera.
///
/// With the point (X, Y, Z) in the camera's frame, whose z axis looks into the scene, x = X/Z and
/// y = Y/Z: u = fx x′ + cx, v = fy y′ + cy for the [`distorted`] slopes x′, y′.
pub(super) fn predict<S: Scalar>(scene: &Scene<S>) -> Vector3<S> {
    let ([camera, marker], [carrier, marker_carrier]) = (&scene.fixtures, &scene.carriers);
    let point = marker_carrier.point(&marker.frame().point(&scene.point));
    let frame = carrier.compose(&camera.frame());
    let seen = frame.resolve(&(point - frame.origin));
    if seen.z.re() <= 0.0 {
        return Vector3::from_element(S::from(f64::NAN));
    }
    let [_, _, _, _, _, _, fx, fy, cx, cy, ..] = camera.numbers;
    let [x, y] = distorted(camera, seen.x / seen.z, seen.y / seen.z);
    Vector3::new(fx * x + cx, fy * y + cy, S::from(0.0))
}

#[cfg(test)]
mod tests {
    use nalgebra::{Matrix4, Rotation3, Vector4};
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::observation::{FixtureKind, FixtureValues};
    use crate::spatial::Frame;

    /// Projects a point of a marker by homogeneous matrices and angles, apart from the library.
    fn projected(scene: &Scene<f64>) -> Option<[f64; 2]> {
        let matrix = |frame: &Frame<f64>| {
            let column = |v: &Vector3<f64>, w| Vector4::new(v.x, v.y, v.z, w);
            let [x, y, z] = &frame.axes;
            Matrix4::from_columns(&[
                column(x, 0.0),
                column(y, 0.0),
                column(z, 0.0),
                column(&frame.origin, 1.0),
            ])
        };
        let pose = |numbers: &[f64]| {
            let turn = Rotation3::from_scaled_axis(Vector3::from_column_slice(&numbers[3..6]));
            Matrix4::new_translation(&Vector3::from_column_slice(&numbers[..3]))
                * turn.to_homogeneous()
        };
        let [camera, marker] = &scene.fixtures;
        let of_camera = matrix(&scene.carriers[0]) * pose(&camera.numbers);
        let of_marker = matrix(&scene.carriers[1]) * pose(&marker.numbers);
        let seen = of_camera.try_inverse()? * of_marker * scene.point.push(1.0);
        let (a, b) = (seen.x / seen.z, seen.y / seen.z);
        let [fx, fy, cx, cy, k1, k2, c, d, e] = camera.numbers[6..15] else { return None };
        let (u, v) = if camera.kind == FixtureKind::Fisheye {
            let (angle, way) = (a.hypot(b).atan(), b.atan2(a));
            let powers = [(k1, 3), (k2, 5), (c, 7), (d, 9)];
            let bent = angle + powers.iter().map(|(k, n)| k * angle.powi(*n)).sum::<f64>();
            (bent * way.cos(), bent * way.sin())
        } else {
            let r = a.hypot(b);
            let radial = 1.0 + k1 * r.powi(2) + k2 * r.powi(4) + e * r.powi(6);
            (
                a * radial + 2.0 * c * a * b + d * (r * r + 2.0 * a * a),
                b * radial + c * (r * r + 2.0 * b * b) + 2.0 * d * a * b,
            )
        };
        (seen.z > 0.0).then_some([fx * u + cx, fy * v + cy])
    }

    #[test]
    fn the_projection_is_that_of_another_program() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut within = |size: f64| size * random.random_range(-1.0..1.0);
        let (mut seen, mut behind, mut worst) = (0, 0, 0.0_f64);
        while seen < 10_000 {
            let fisheye = seen % 3 == 0;
            let kind = if fisheye { FixtureKind::Fisheye } else { FixtureKind::Camera };
            let mut numbers: Vec<f64> = (0..3).map(|_| within(2.0)).collect();
            numbers.extend((0..3).map(|_| within(1.5)));
            numbers.extend([900.0, 880.0, 640.0, 360.0].map(|nominal| nominal + within(100.0)));
            let size = if fisheye { 0.02 } else { 0.1 };
            numbers.extend((0..if fisheye { 4 } else { 5 }).map(|_| within(size)));
            let declared: Vec<Option<f64>> = numbers.into_iter().map(Some).collect();
            let pose: Vec<Option<f64>> = (0..6).map(|_| Some(within(2.0))).collect();
            let mut frame = || {
                Frame::from_rotation_vector(
                    Vector3::from_fn(|_, _| within(2.0)),
                    &Vector3::from_fn(|_, _| within(2.0)),
                )
            };
            let carriers = [frame(), frame()];
            let scene = Scene {
                fixtures: [
                    FixtureValues::new(kind, &declared),
                    FixtureValues::new(FixtureKind::Marker, &pose),
                ],
                carriers,
                point: Vector3::from_fn(|_, _| within(0.3)),
                ..Scene::default()
            };
            let pixel = predict(&scene);
            let Some([u, v]) = projected(&scene) else {
                assert!(pixel.x.is_nan() && pixel.y.is_nan(), "{pixel}");
                behind += 1;
                continue;
            };
            // Rays far from the axis have pixels of any size.
            if u.hypot(v) < 1e4 {
                worst = worst.max((pixel.x - u).abs().max((pixel.y - v).abs()));
                seen += 1;
            }
        }
        assert!(worst < 1e-9 && behind > 1000, "{worst:e} px, {behind} points behind");
    }
}
