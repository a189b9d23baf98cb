//! Normal of a plane by two numbers.

use nalgebra::Vector3;

use super::rotate;
use crate::scalar::Scalar;

/// Largest angle between a normal and ẑ for which the normal is parameterised directly \[rad\];
/// beyond it, the opposite normal is.
pub const MAX_NORMAL_TILT: f64 = 0.75 * std::f64::consts::PI;

/// Returns the normal of a plane from its first two numbers \[rad\]: exp(\[(rx, ry, 0)\]×) ẑ. This
/// form is singular at −ẑ. For rx above 3π/4 the normal is therefore −exp(\[(rx − π, ry, 0)\]×) ẑ,
/// which is regular there. Both forms agree for ry = 0.
pub fn plane_normal<S: Scalar>(rx: S, ry: S) -> Vector3<S> {
    let of = |rx: S| {
        let zero = S::from(0.0);
        rotate(&Vector3::new(rx, ry, zero), &Vector3::new(zero, zero, S::from(1.0)))
    };
    if rx.re() > MAX_NORMAL_TILT { -of(rx - S::from(std::f64::consts::PI)) } else { of(rx) }
}
