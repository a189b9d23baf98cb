//! Row of the joint table of a problem that is made from a URDF.

use nalgebra::Vector3;

use crate::spatial::Frame;

/// Table `[[joint]]` of the problem that is written.
#[derive(Default)]
pub(super) struct Row {
    /// Name of the joint.
    pub name: String,
    /// Index of the moving joint in the robot; `None` for a fixed joint.
    pub joint: Option<usize>,
    /// Number of the joint on which the first row of a further chain stands, from 1; 0 for the base.
    pub parent: Option<usize>,
    /// Frame of the row with all joints at zero, in the frame of the base.
    pub frame: Frame<f64>,
    /// Kind of the joint as in problem files: `revolute`, `prismatic` or `fixed`.
    pub kind: &'static str,
    /// Placement by xyz and rpy; `None` for moving joints.
    pub placement: Option<Frame<f64>>,
    /// Index in the robot of the joint that a mimic joint follows, and the factor.
    pub mimic: Option<(usize, f64)>,
    /// Joint parameters α \[rad\], a \[m\], θ \[rad\], d \[m\], β \[rad\].
    pub numbers: [f64; 5],
    /// Limits of the command \[rad\] or \[m\]; `None` for fixed and mimic joints.
    pub limits: Option<(f64, f64)>,
    /// Name, mass \[kg\] and centre of mass \[m\], joint frame, of each body.
    pub bodies: Vec<(String, f64, Vector3<f64>)>,
}

impl Row {
    /// Returns `frame` transformed by the row at q = 0.
    pub fn advanced(&self, frame: &Frame<f64>) -> Frame<f64> {
        let mut frame =
            self.placement.as_ref().map_or(*frame, |placement| frame.compose(placement));
        let [alpha, a, theta, d, beta] = self.numbers;
        frame.rotate_x(alpha.sin_cos());
        frame.translate_x(a);
        frame.rotate_z(theta.sin_cos());
        frame.translate_z(d);
        frame.rotate_y(beta.sin_cos());
        frame
    }
}
