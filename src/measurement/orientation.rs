//! Orientations from the columns of a table.

use nalgebra::{Quaternion, Rotation3, UnitQuaternion, Vector3};

use crate::problem::RotationKind;

/// Largest deviation of a quaternion's norm from 1 that counts as rounding.
const NORM_TOLERANCE: f64 = 0.01;

/// Numbers of one row from which its orientation is computed.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cells {
    /// Angles rx, ry, rz \[rad\].
    pub angles: Vector3<f64>,
    /// Components qx, qy, qz, qw.
    pub quaternion: [f64; 4],
}

impl Cells {
    /// Returns the orientation from the three angles, in the convention `kind`.
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

    /// Returns the orientation from the quaternion, or `None` if its norm is not 1.
    pub fn of_quaternion(&self) -> Option<UnitQuaternion<f64>> {
        let [x, y, z, w] = self.quaternion;
        let quaternion = Quaternion::new(w, x, y, z);
        ((quaternion.norm() - 1.0).abs() <= NORM_TOLERANCE)
            .then(|| UnitQuaternion::from_quaternion(quaternion))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_follow_their_convention() {
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
        let quaternion = quaternion_cells(&(x * y));
        assert!(quaternion.of_quaternion().is_some_and(|found| found.angle_to(&(x * y)) < 1e-12));
        assert!(Cells::default().of_quaternion().is_none());
    }

    fn quaternion_cells(q: &UnitQuaternion<f64>) -> Cells {
        Cells { quaternion: [q.i, q.j, q.k, q.w], ..Cells::default() }
    }
}
