//! Rotation vectors: exponential map, logarithm and its derivative, rotations about one axis.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::scalar::Scalar;

/// Squared angle \[rad²\] below which the coefficients of a rotation are computed by power series,
/// which are exact to rounding there; the closed forms divide by the angle.
const MAX_SERIES_ANGLE_SQUARED: f64 = 0.01;

/// Returns `vector` v rotated by the rotation vector `w` \[rad\]: exp(`[w]×`) v.
///
/// exp(`[w]×`) v = v + A w×v + B w×(w×v), A = sin φ / φ, B = (1 − cos φ) / φ², φ = ‖w‖
/// (Rodrigues). Smooth at w = 0, with its derivative.
pub fn rotate<S: Scalar>(w: &Vector3<S>, vector: &Vector3<S>) -> Vector3<S> {
    let (a, b) = coefficients(w.dot(w));
    let first = w.cross(vector);
    let second = w.cross(&first);
    vector + first * a + second * b
}

/// Returns the columns of the rotation matrix exp(`[w]×`) of a rotation vector `w` \[rad\].
///
/// R = cos φ I + A `[w]×` + B w wᵀ with A and B as in [`rotate`], cos φ = 1 − B φ².
pub fn rotation_axes<S: Scalar>(w: &Vector3<S>) -> [Vector3<S>; 3] {
    let squares = [w.x * w.x, w.y * w.y, w.z * w.z];
    let (a, b) = coefficients(squares[0] + squares[1] + squares[2]);
    let bw = w * b;
    let [xy, yz, zx] = [bw.x * w.y, bw.y * w.z, bw.z * w.x];
    let aw = w * a;
    let diagonal = |first: usize, second: usize| -(squares[first] + squares[second]) * b + 1.0;
    [
        Vector3::new(diagonal(1, 2), xy + aw.z, zx - aw.y),
        Vector3::new(xy - aw.z, diagonal(2, 0), yz + aw.x),
        Vector3::new(zx + aw.y, yz - aw.x, diagonal(0, 1)),
    ]
}

/// Returns the rotation vector \[rad\], reference frame, that rotates the axes `from` into the axes
/// `to`: log(R₂ R₁ᵀ) with R₁ = `from` and R₂ = `to`. Its length is at most π.
pub fn rotation_between(from: &[Vector3<f64>; 3], to: &[Vector3<f64>; 3]) -> Vector3<f64> {
    let rotation = Matrix3::from_columns(to) * Matrix3::from_columns(from).transpose();
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation)).scaled_axis()
}

/// Returns the inverse right Jacobian of SO(3), the derivative of log(exp(`[w]×`) exp(`[δ]×`)) with
/// respect to δ at δ = 0: J⁻¹ = I + ½ `[w]×` + C `[w]×`², C = (1 − φ/2 cot φ/2) / φ², φ = ‖w‖.
///
/// The rotation vector w \[rad\] is shorter than 2π. [Chirikjian 2012, ch. 10]
pub fn inverse_right_jacobian(w: &Vector3<f64>) -> Matrix3<f64> {
    let squared = w.norm_squared();
    let c = if squared < MAX_SERIES_ANGLE_SQUARED {
        1.0 / 12.0 + squared / 720.0 + squared * squared / 30_240.0 + squared.powi(3) / 1_209_600.0
    } else {
        let half = squared.sqrt() / 2.0;
        (1.0 - half / half.tan()) / squared
    };
    let cross = w.cross_matrix();
    Matrix3::identity() + cross * 0.5 + cross * cross * c
}

/// Returns a real vector rotated about the x axis by the angle with this (sin, cos).
#[inline]
pub fn rotated_about_x<S: Scalar>(sin_cos: (S, S), vector: &Vector3<f64>) -> Vector3<S> {
    let (y, z) = rotate_in_plane(sin_cos, vector.y, vector.z);
    Vector3::new(S::from(vector.x), y, z)
}

/// Returns a real vector rotated about the y axis by the angle with this (sin, cos).
#[inline]
pub fn rotated_about_y<S: Scalar>(sin_cos: (S, S), vector: &Vector3<f64>) -> Vector3<S> {
    let (z, x) = rotate_in_plane(sin_cos, vector.z, vector.x);
    Vector3::new(x, S::from(vector.y), z)
}

/// Returns a real vector rotated about the z axis by the angle with this (sin, cos).
#[inline]
pub fn rotated_about_z<S: Scalar>(sin_cos: (S, S), vector: &Vector3<f64>) -> Vector3<S> {
    let (x, y) = rotate_in_plane(sin_cos, vector.x, vector.y);
    Vector3::new(x, y, S::from(vector.z))
}

/// Returns the plane coordinates (u, v) rotated from u towards v by the angle with this (sin, cos).
#[inline]
fn rotate_in_plane<S: Scalar>((sin, cos): (S, S), u: f64, v: f64) -> (S, S) {
    (cos * u - sin * v, sin * u + cos * v)
}

/// Returns the coefficients (sin φ / φ, (1 − cos φ) / φ²) of [`rotate`] from `squared` = φ²
/// \[rad²\].
fn coefficients<S: Scalar>(squared: S) -> (S, S) {
    if squared.re() < MAX_SERIES_ANGLE_SQUARED {
        let horner = |c: [f64; 5]| {
            (((squared * c[4] + S::from(c[3])) * squared + S::from(c[2])) * squared + S::from(c[1]))
                * squared
                + S::from(c[0])
        };
        let a = horner([1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362_880.0]);
        let b = horner([0.5, -1.0 / 24.0, 1.0 / 720.0, -1.0 / 40_320.0, 1.0 / 3_628_800.0]);
        (a, b)
    } else {
        let angle = squared.sqrt();
        let (sin, cos) = angle.sin_cos();
        (sin / angle, (-cos + 1.0) / squared)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scalar::{gradient, seeded};

    #[test]
    fn derivative_at_zero_is_the_cross_product() {
        let w = Vector3::from_fn(|i, _| seeded::<3>(0.0, Some(i)));
        let v = Vector3::new(0.3, -0.5, 0.8);
        let rotated = rotate(&w, &v.map(Into::into));
        for (j, axis) in [Vector3::x(), Vector3::y(), Vector3::z()].iter().enumerate() {
            let derivative = rotated.map(|coordinate| gradient(&coordinate)[j]);
            assert!((derivative - axis.cross(&v)).norm() < 1e-15);
        }
    }

    #[test]
    fn the_logarithm_and_its_slope_invert_the_exponential() {
        let direction = Vector3::new(0.3, -0.5, 0.8).normalize();
        for angle in [0.0, 1e-6, 0.05, 0.099_99, 0.100_01, 1.0, 3.0] {
            let (w, base) = (direction * angle, Vector3::new(1.0, 2.0, -0.5));
            let from = rotation_axes(&base);
            let to = from.map(|axis| rotate(&w, &axis));
            assert!((rotation_between(&from, &to) - w).norm() < 1e-12, "{angle}");
            for k in 0..3 {
                let near = |step: f64| {
                    let delta = rotation_axes(&Vector3::ith(k, step));
                    let turned = delta.map(|axis| rotate(&w, &axis));
                    rotation_between(&rotation_axes(&Vector3::zeros()), &turned)
                };
                let difference = (near(1e-5) - near(-1e-5)) / 2e-5;
                assert!(
                    (inverse_right_jacobian(&w).column(k) - difference).norm() < 1e-8,
                    "{angle}"
                );
            }
        }
    }

    #[test]
    fn series_and_closed_form_meet() {
        let at = |angle: f64| {
            let w = Vector3::new(0.3, -0.5, 0.8).normalize() * angle;
            rotate(&w, &Vector3::new(1.0, 2.0, 3.0))
        };
        let reference = |angle: f64| {
            let w = Vector3::new(0.3, -0.5, 0.8).normalize() * angle;
            Rotation3::new(w) * Vector3::new(1.0, 2.0, 3.0)
        };
        for angle in [1e-9, 1e-3, 0.099_999, 0.1, 0.100_001, 1.0, 3.0] {
            assert!((at(angle) - reference(angle)).norm() < 1e-14, "{angle}");
        }
    }

    #[test]
    fn axes_are_the_rotated_unit_vectors() {
        for w in [Vector3::zeros(), Vector3::new(1e-3, -2e-3, 5e-4), Vector3::new(1.0, -2.0, 0.5)] {
            let rotated = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| rotate(&w, &axis));
            for (axis, rotated) in rotation_axes(&w).iter().zip(&rotated) {
                assert!((axis - rotated).norm() < 1e-15);
            }
        }
    }
}
