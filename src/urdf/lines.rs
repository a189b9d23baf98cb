//! Conversion of the transform between two axes to joint parameters.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::spatial::Frame;

/// Largest sine of the angle between two axes at which they are treated as parallel.
const MAX_PARALLEL_SINE: f64 = 0.1;
/// Smallest distance between two points that defines a direction \[m\].
const MIN_DISTANCE: f64 = 1e-12;

/// Transform Rz(θ₀) Tz(d₀) Ry(β) Rx(α) Tx(a) Rz(θ) Tz(d) between two axes, angles \[rad\] and
/// lengths \[m\]. The first two factors act along the first axis, the last two along the second.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Step {
    /// Rotation θ₀ about the first axis.
    pub theta_before: f64,
    /// Shift d₀ along the first axis.
    pub d_before: f64,
    pub beta: f64,
    pub alpha: f64,
    pub a: f64,
    pub theta: f64,
    pub d: f64,
}

impl Step {
    /// Decomposes a frame on the second axis, given in a frame on the first axis. For crossing axes
    /// the common normal is used, with β = 0. For parallel or nearly parallel axes the form of
    /// \[Hayati1983\] is used, with d₀ = 0, so that the origin stays near.
    pub fn from_frame(frame: &Frame<f64>) -> Self {
        let mut step = if frame.axes[2].x.hypot(frame.axes[2].y) > MAX_PARALLEL_SINE {
            crossing(frame)
        } else {
            parallel(frame)
        };
        let mut line = Frame::identity();
        line.rotate_z(step.theta_before.sin_cos());
        line.translate_z(step.d_before);
        line.rotate_y(step.beta.sin_cos());
        line.rotate_x(step.alpha.sin_cos());
        line.translate_x(step.a);
        let remainder = line.inverse().compose(frame);
        (step.theta, step.d) = (remainder.axes[0].y.atan2(remainder.axes[0].x), remainder.origin.z);
        step
    }
}

/// Returns the factors up to Tx(a) for crossing axes, from their common normal.
fn crossing(frame: &Frame<f64>) -> Step {
    let (z, p) = (&frame.axes[2], &frame.origin);
    let sin = z.x.hypot(z.y);
    // This is the direction of the common normal, e_z × z.
    let (x, y) = (-z.y / sin, z.x / sin);
    let normal = y.atan2(x);
    let (theta_before, sign) = near_zero(normal);
    Step {
        theta_before,
        d_before: (p.z - z.z * p.dot(z)) / (sin * sin),
        alpha: sign * sin.atan2(z.z),
        a: sign * (p.x * x + p.y * y),
        ..Step::default()
    }
}

/// Returns the factors up to Tx(a) for parallel or nearly parallel axes, with d₀ = 0.
fn parallel(frame: &Frame<f64>) -> Step {
    let (z, p) = (&frame.axes[2], &frame.origin);
    let foot = p - z * p.dot(z);
    let distance = foot.norm();
    let mut step = Step::default();
    if distance > MIN_DISTANCE {
        let (theta_before, sign) = near_zero(foot.y.atan2(foot.x));
        let along = foot * (sign / distance);
        (step.theta_before, step.a) = (theta_before, sign * distance);
        // The normal is perpendicular to the second axis; its z component would lose digits for a
        // short normal.
        let rise = -(along.x * z.x + along.y * z.y) / z.z;
        step.beta = (-rise).atan2(along.x.hypot(along.y));
    } else {
        step.beta = (z.x / z.z).atan();
    }
    let mut tilted = Frame::identity();
    tilted.rotate_z(step.theta_before.sin_cos());
    tilted.rotate_y(step.beta.sin_cos());
    step.alpha = (-z.dot(&tilted.axes[1])).atan2(z.dot(&tilted.axes[2]));
    step
}

/// Reduces the angle of an undirected line \[rad\] to (−90°, 90°]. Also returns −1 if the direction
/// was reversed for that, else 1.
fn near_zero(angle: f64) -> (f64, f64) {
    const MAX_ROUNDING: f64 = 1e-9;
    if angle > FRAC_PI_2 + MAX_ROUNDING {
        (angle - PI, -1.0)
    } else if angle <= MAX_ROUNDING - FRAC_PI_2 {
        (angle + PI, -1.0)
    } else {
        (angle, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;

    #[test]
    fn decomposition_reproduces_the_frame() {
        let angles = [0.0, 1e-9, 0.02, -0.06, 0.09, 0.11, -1.0, FRAC_PI_2, 2.5, PI, PI - 0.01];
        for (roll, pitch) in angles.iter().flat_map(|roll| angles.map(|pitch| (*roll, pitch))) {
            for xyz in [
                Vector3::zeros(),
                Vector3::new(0.3, -0.2, 0.5),
                Vector3::new(0.0, 0.0, 1.0),
                Vector3::y(),
            ] {
                let frame = Frame::from_xyz_rpy(&xyz, &Vector3::new(roll, pitch, 0.7));
                let step = Step::from_frame(&frame);
                let mut again = Frame::identity();
                again.rotate_z(step.theta_before.sin_cos());
                again.translate_z(step.d_before);
                again.rotate_y(step.beta.sin_cos());
                again.rotate_x(step.alpha.sin_cos());
                again.translate_x(step.a);
                again.rotate_z(step.theta.sin_cos());
                again.translate_z(step.d);
                let off =
                    (0..3).map(|k| (frame.axes[k] - again.axes[k]).norm()).fold(0.0, f64::max);
                assert!(
                    off + (frame.origin - again.origin).norm() < 1e-12,
                    "{roll} {pitch} {xyz}: {step:?}"
                );
                assert!(step.d_before.abs() + step.d.abs() < 200.0, "{step:?}");
            }
        }
    }
}
