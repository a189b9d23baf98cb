//! Conversion of frames from and to xyz and roll, pitch, yaw, as in URDF.

use nalgebra::Vector3;

use super::Frame;

impl Frame<f64> {
    /// Creates the frame T(xyz) Rz(yaw) Ry(pitch) Rx(roll) from `xyz` \[m\] and `rpy` \[rad\], in
    /// which roll comes first.
    pub fn from_xyz_rpy(xyz: &Vector3<f64>, rpy: &Vector3<f64>) -> Self {
        let mut frame = Self { origin: *xyz, ..Self::identity() };
        frame.rotate_z(rpy.z.sin_cos());
        frame.rotate_y(rpy.y.sin_cos());
        frame.rotate_x(rpy.x.sin_cos());
        frame
    }

    /// Returns roll, pitch and yaw \[rad\] of the frame's axes; yaw is 0 if pitch is ±90°.
    ///
    /// Yaw follows from the x axis and roll from the remaining rotation, which is exact to rounding
    /// at every pitch.
    pub fn roll_pitch_yaw(&self) -> Vector3<f64> {
        let [x, y, z] = &self.axes;
        let horizontal = x.x.hypot(x.y);
        let yaw = if horizontal > 1e-12 { x.y.atan2(x.x) } else { 0.0 };
        let (sin, cos) = yaw.sin_cos();
        let roll = (sin * z.x - cos * z.y).atan2(cos * y.y - sin * y.x);
        Vector3::new(roll, (-x.z).atan2(horizontal), yaw)
    }

    /// Returns the inverse transform: the reference frame relative to this frame.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let axes = [0, 1, 2].map(|k| self.axes.map(|axis| axis[k]).into());
        Self { axes, origin: -self.resolve(&self.origin) }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, PI};

    use super::*;

    #[test]
    fn angles_come_back_at_every_pitch() {
        let angles = [0.0, 0.3, -1.2, FRAC_PI_2, -FRAC_PI_2, FRAC_PI_2 - 1e-9, PI, 1.57, -2.9];
        let combinations = angles.iter().flat_map(|&roll| {
            angles.iter().flat_map(move |&pitch| angles.map(|yaw| [roll, pitch, yaw]))
        });
        for rpy in combinations {
            let frame = Frame::from_xyz_rpy(&Vector3::new(1.0, -2.0, 0.5), &rpy.into());
            let again = Frame::from_xyz_rpy(&frame.origin, &frame.roll_pitch_yaw());
            let off = (0..3).map(|k| (frame.axes[k] - again.axes[k]).norm()).fold(0.0, f64::max);
            assert!(off < 1e-12, "{rpy:?}: {off}");
            let back = frame.compose(&frame.inverse());
            assert!((back.origin.norm() + (back.axes[0] - Vector3::x()).norm()) < 1e-14);
        }
    }
}
