//! Parameterisation of the normal of a plane by two angles.

use nalgebra::Vector3;

use super::rotate;
use crate::scalar::Scalar;

/// Largest angle rx \[rad\] for which [`plane_normal`] rotates ẑ to the normal itself; for larger
/// ones it rotates ẑ to the opposite normal. 3π/4 is far from the singularities of both forms.
pub const MAX_NORMAL_TILT: f64 = 0.75 * std::f64::consts::PI;

/// Returns the unit normal exp(\[(rx, ry, 0)\]×) ẑ of a plane from the first two of its three
/// parameters, the angles rx and ry \[rad\].
///
/// This form is singular at −ẑ. For rx above 3π/4 the normal is therefore
/// −exp(\[(rx − π, ry, 0)\]×) ẑ, which is regular there. Both forms agree for ry = 0.
pub fn plane_normal<S: Scalar>(rx: S, ry: S) -> Vector3<S> {
    let rotated_z = |rx: S| {
        let zero = S::from(0.0);
        rotate(&Vector3::new(rx, ry, zero), &Vector3::new(zero, zero, S::from(1.0)))
    };
    if rx.re() > MAX_NORMAL_TILT {
        -rotated_z(rx - S::from(std::f64::consts::PI))
    } else {
        rotated_z(rx)
    }
}
