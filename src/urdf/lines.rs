//! What lies between two axes, in the numbers of our joints.

use std::f64::consts::{FRAC_PI_2, PI};

use crate::spatial::Frame;

/// Sine of the angle below which axes count as parallel \[1\].
const PARALLEL: f64 = 0.1;
/// Shorter distances than this have no direction \[m\].
const NO_DISTANCE: f64 = 1e-12;

/// Rz(θ₀) Tz(d₀) Ry(β) Rx(α) Tx(a) Rz(θ) Tz(d): the first two move along the axis before, the last
/// two along the axis behind.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Step {
    pub theta_before: f64,
    pub d_before: f64,
    pub beta: f64,
    pub alpha: f64,
    pub a: f64,
    pub theta: f64,
    pub d: f64,
}

impl Step {
    /// Of a frame on the axis behind, seen from one on the axis before: along the common normal,
    /// with β = 0, where the axes cross; \[Hayati1983\] with d₀ = 0, so that it stays near, where
    /// they are parallel or nearly so.
    pub fn to(frame: &Frame<f64>) -> Self {
        let mut step = if frame.axes[2].x.hypot(frame.axes[2].y) > PARALLEL {
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
        let rest = line.inverse().compose(frame);
        (step.theta, step.d) = (rest.axes[0].y.atan2(rest.axes[0].x), rest.origin.z);
        step
    }
}

fn crossing(frame: &Frame<f64>) -> Step {
    let (z, p) = (&frame.axes[2], &frame.origin);
    let sin = z.x.hypot(z.y);
    // e_z × z, the direction of the common normal.
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

fn parallel(frame: &Frame<f64>) -> Step {
    let (z, p) = (&frame.axes[2], &frame.origin);
    let foot = p - z * p.dot(z);
    let distance = foot.norm();
    let mut step = Step::default();
    if distance > NO_DISTANCE {
        let (theta_before, sign) = near_zero(foot.y.atan2(foot.x));
        let along = foot * (sign / distance);
        (step.theta_before, step.a) = (theta_before, sign * distance);
        // The normal is across the axis behind; its own z is lost to rounding where it is short.
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

/// The angle of a line without direction that lies in (−90°, 90°], and whether that is the
/// direction given (1) or the other (−1).
fn near_zero(angle: f64) -> (f64, f64) {
    const ROUNDING: f64 = 1e-9;
    if angle > FRAC_PI_2 + ROUNDING {
        (angle - PI, -1.0)
    } else if angle <= ROUNDING - FRAC_PI_2 {
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
    fn every_line_is_reached() {
        let angles = [0.0, 1e-9, 0.02, -0.06, 0.09, 0.11, -1.0, FRAC_PI_2, 2.5, PI, PI - 0.01];
        for (roll, pitch) in angles.iter().flat_map(|roll| angles.map(|pitch| (*roll, pitch))) {
            for xyz in [
                Vector3::zeros(),
                Vector3::new(0.3, -0.2, 0.5),
                Vector3::new(0.0, 0.0, 1.0),
                Vector3::y(),
            ] {
                let frame = Frame::from_xyz_rpy(&xyz, &Vector3::new(roll, pitch, 0.7));
                let step = Step::to(&frame);
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
