//! Orientations from the columns of a table.

use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};

use crate::problem::RotationKind;

/// How far the length of a quaternion may be from 1 for rounding.
const ROUNDING: f64 = 0.01;

/// An orientation as its columns come.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cells {
    /// rx, ry, rz \[rad\].
    pub angles: Vector3<f64>,
    /// qx, qy, qz, qw.
    pub quaternion: [f64; 4],
}

impl Cells {
    /// The orientation that the three angles say.
    pub fn of_angles(&self, kind: RotationKind) -> UnitQuaternion<f64> {
        let [x, y, z] = self.angles.into();
        let (x, y, z) = (
            Rotation3::from_axis_angle(&Vector3::x_axis(), x),
            Rotation3::from_axis_angle(&Vector3::y_axis(), y),
            Rotation3::from_axis_angle(&Vector3::z_axis(), z),
        );
        match kind {
            RotationKind::Vector => UnitQuaternion::from_scaled_axis(self.angles),
            RotationKind::EulerXyz => (x * y * z).into(),
            RotationKind::RollPitchYaw => (z * y * x).into(),
        }
    }

    /// The orientation that the quaternion says; `None` where its length is not 1.
    pub fn of_quaternion(&self) -> Option<UnitQuaternion<f64>> {
        let [x, y, z, w] = self.quaternion;
        let quaternion = Quaternion::new(w, x, y, z);
        ((quaternion.norm() - 1.0).abs() <= ROUNDING)
            .then(|| UnitQuaternion::from_quaternion(quaternion))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_what_their_kind_says() {
        let angles = Vector3::new(0.3, -0.5, 1.2);
        let cells = Cells { angles, ..Cells::default() };
        let turn = |axis: usize| UnitQuaternion::from_scaled_axis(Vector3::ith(axis, angles[axis]));
        let (x, y, z) = (turn(0), turn(1), turn(2));
        for (kind, expected) in [
            (RotationKind::Vector, UnitQuaternion::from_scaled_axis(angles)),
            (RotationKind::EulerXyz, x * y * z),
            (RotationKind::RollPitchYaw, z * y * x),
        ] {
            assert!(cells.of_angles(kind).angle_to(&expected) < 1e-12, "{kind:?}");
        }
        let quaternion = expected_cells(&(x * y));
        assert!(quaternion.of_quaternion().is_some_and(|own| own.angle_to(&(x * y)) < 1e-12));
        assert!(Cells::default().of_quaternion().is_none());
    }

    fn expected_cells(of: &UnitQuaternion<f64>) -> Cells {
        Cells { quaternion: [of.i, of.j, of.k, of.w], ..Cells::default() }
    }
}
