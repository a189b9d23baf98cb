//! Elementary motions.

use nalgebra::Vector3;
use num_dual::Dual64;

use super::Frame;
use crate::scalar::Scalar;

/// A motion along or about one of a frame's own axes; rotations by (sin, cos), translations in [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Motion<S> {
    /// About x.
    RotateX((S, S)),
    /// About y.
    RotateY((S, S)),
    /// About z.
    RotateZ((S, S)),
    /// Along x.
    TranslateX(S),
    /// Along z.
    TranslateZ(S),
}

impl<S: Scalar> Motion<S> {
    /// Moves `frame`.
    #[inline]
    pub fn apply(self, frame: &mut Frame<S>) {
        match self {
            Self::RotateX(sin_cos) => frame.rotate_x(sin_cos),
            Self::RotateY(sin_cos) => frame.rotate_y(sin_cos),
            Self::RotateZ(sin_cos) => frame.rotate_z(sin_cos),
            Self::TranslateX(distance) => frame.translate_x(distance),
            Self::TranslateZ(distance) => frame.translate_z(distance),
        }
    }

    /// Coordinates before the motion of a point [m] given after it.
    #[inline]
    pub fn carry(self, point: &Vector3<f64>) -> Vector3<S> {
        let turn = |(sin, cos): (S, S), u: f64, v: f64| (cos * u - sin * v, sin * u + cos * v);
        let [x, y, z] = [point.x, point.y, point.z];
        match self {
            Self::RotateX(sin_cos) => {
                let (y, z) = turn(sin_cos, y, z);
                Vector3::new(S::from(x), y, z)
            }
            Self::RotateY(sin_cos) => {
                let (z, x) = turn(sin_cos, z, x);
                Vector3::new(x, S::from(y), z)
            }
            Self::RotateZ(sin_cos) => {
                let (x, y) = turn(sin_cos, x, y);
                Vector3::new(x, y, S::from(z))
            }
            Self::TranslateX(distance) => Vector3::new(distance + x, S::from(y), S::from(z)),
            Self::TranslateZ(distance) => Vector3::new(S::from(x), S::from(y), distance + z),
        }
    }
}

impl Motion<Dual64> {
    /// The motion without its derivative.
    #[inline]
    pub fn re(self) -> Motion<f64> {
        let real = |(sin, cos): (Dual64, Dual64)| (sin.re, cos.re);
        match self {
            Self::RotateX(sin_cos) => Motion::RotateX(real(sin_cos)),
            Self::RotateY(sin_cos) => Motion::RotateY(real(sin_cos)),
            Self::RotateZ(sin_cos) => Motion::RotateZ(real(sin_cos)),
            Self::TranslateX(distance) => Motion::TranslateX(distance.re),
            Self::TranslateZ(distance) => Motion::TranslateZ(distance.re),
        }
    }
}
