//! Lenses of cameras: distortion and its inverse.

use nalgebra::{Matrix2, Vector2};
use num_dual::DualSVec64;

use super::{FixtureKind, FixtureValues};
use crate::scalar::{Scalar, gradient, seeded};

/// Squared slope (tangent squared) that is added to that of a ray, so that its angle has a
/// derivative on the optical axis. There, angle and tangent are equal to rounding.
const MIN_SQUARED_SLOPE: f64 = 1e-20;

/// Number of Newton steps that invert the distortion.
const NEWTON_STEPS: usize = 20;

/// Returns the distorted slopes (x′, y′) of a ray that enters the lens with slopes (x, y) = (X/Z,
/// Y/Z), with r² = x² + y².
///
/// Pinhole [Brown 1971; Conrady 1919]: x′ = x (1 + k₁r² + k₂r⁴ + k₃r⁶) + 2 p₁xy + p₂(r² + 2x²),
/// y′ = y (1 + k₁r² + k₂r⁴ + k₃r⁶) + p₁(r² + 2y²) + 2 p₂xy. Equidistant lens
/// [Kannala & Brandt 2006]: (x′, y′) = (x, y) θ (1 + k₁θ² + k₂θ⁴ + k₃θ⁶ + k₄θ⁸) / r, θ = atan r.
pub(super) fn distorted<S: Scalar>(camera: &FixtureValues<S>, x: S, y: S) -> [S; 2] {
    let [_, _, _, _, _, _, _, _, _, _, k1, k2, third, fourth, k3] = camera.numbers;
    let r2 = x * x + y * y;
    if camera.kind == FixtureKind::Fisheye {
        let r = (r2 + MIN_SQUARED_SLOPE).sqrt();
        let angle = r.atan();
        let a2 = angle * angle;
        let scale = angle / r * ((((fourth * a2 + third) * a2 + k2) * a2 + k1) * a2 + 1.0);
        return [x * scale, y * scale];
    }
    let (p1, p2) = (third, fourth);
    let radial = ((k3 * r2 + k2) * r2 + k1) * r2 + 1.0;
    let (twice_xy, xx, yy) = (x * y * 2.0, x * x * 2.0, y * y * 2.0);
    [x * radial + p1 * twice_xy + p2 * (r2 + xx), y * radial + p1 * (r2 + yy) + p2 * twice_xy]
}

/// Returns the slopes X/Z and Y/Z of the ray through a pixel \[px\]; without distortion if the
/// inverse of the distortion is not finite.
pub(crate) fn slopes_of_pixel(camera: &FixtureValues<f64>, [u, v]: [f64; 2]) -> [f64; 2] {
    let [_, _, _, _, _, _, fx, fy, cx, cy, ..] = camera.numbers;
    let measured = Vector2::new((u - cx) / fx, (v - cy) / fy);
    let lens =
        FixtureValues { kind: camera.kind, numbers: camera.numbers.map(DualSVec64::<2>::from_re) };
    let mut slopes = measured;
    for _ in 0..NEWTON_STEPS {
        let [x, y] = distorted(&lens, seeded(slopes.x, Some(0)), seeded(slopes.y, Some(1)));
        let jacobian = Matrix2::from_rows(&[gradient(&x).transpose(), gradient(&y).transpose()]);
        let Some(inverse) = jacobian.try_inverse() else { break };
        slopes -= inverse * (Vector2::new(x.re, y.re) - measured);
    }
    if slopes.iter().all(|slope| slope.is_finite()) { slopes.into() } else { measured.into() }
}
