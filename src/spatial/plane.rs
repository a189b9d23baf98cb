//! The normal of a plane by two numbers.

use nalgebra::Vector3;

use super::rotate;
use crate::scalar::Scalar;

/// Largest tilt of a normal against ẑ, and least rx of one that is told by its opposite \[rad\].
pub const MAX_NORMAL_TILT: f64 = 0.75 * std::f64::consts::PI;

/// The normal of a plane from its first two numbers \[rad\]: exp(\[(rx, ry, 0)\]×) ẑ, which is
/// singular at −ẑ; with rx above 3π/4 it is −exp(\[(rx − π, ry, 0)\]×) ẑ, which is not. With ry = 0
/// both are the same.
pub fn plane_normal<S: Scalar>(rx: S, ry: S) -> Vector3<S> {
    let of = |rx: S| {
        let zero = S::from(0.0);
        rotate(&Vector3::new(rx, ry, zero), &Vector3::new(zero, zero, S::from(1.0)))
    };
    if rx.re() > MAX_NORMAL_TILT { -of(rx - S::from(std::f64::consts::PI)) } else { of(rx) }
}
