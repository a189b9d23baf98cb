//! Joint origins in the frames of the description that Universal Robots publishes. Each row of the
//! table is the origin of a link in the frame of the previous one \[m\], \[rad\].
//!
//! | link | x y z | roll pitch yaw, nominal |
//! |---|---|---|
//! | shoulder | 0 0 d₁ | 0 0 0 |
//! | upper_arm | 0 0 0 | π/2 0 0 |
//! | forearm | a₂ 0 0 | 0 0 0 |
//! | wrist_1 | a₃ 0 d₄ | 0 0 0 |
//! | wrist_2 | 0 −d₅ 0 | π/2 0 0 |
//! | wrist_3 | 0 d₆ 0 | −π/2 0 0 |

use std::f64::consts::FRAC_PI_2;

use super::export::Steps;
use crate::spatial::Frame;

/// Names of the links in the calibration file.
pub(super) const LINKS: [&str; 6] =
    ["shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3"];
/// Nominal roll of each link \[rad\].
const ROLLS: [f64; 6] = [0.0, FRAC_PI_2, 0.0, 0.0, FRAC_PI_2, -FRAC_PI_2];
/// Largest deviation of the nominal arm from the table of this module \[rad\] or \[m\].
const FORM_TOLERANCE: f64 = 1e-6;

/// Returns the origins of the six links of an identified arm, in the gauges in which the nominal
/// arm has the origins of the table.
///
/// # Errors
/// Returns a description of the difference if the nominal arm cannot have these origins.
pub(super) fn origins(nominal: &Steps, identified: &Steps) -> Result<Vec<Frame<f64>>, String> {
    if nominal.before.len() != LINKS.len() {
        return Err(format!("it has {} moving joints, not 6", nominal.before.len()));
    }
    // The base of a problem is that of the controller, or base_link, which is turned by 180°.
    let mut half = Frame::identity();
    half.rotate_z((0.0, -1.0));
    let gauges = gauges(nominal, &Frame::identity()).or_else(|_| gauges(nominal, &half))?;
    let pairs = gauges.iter().zip(gauges.iter().skip(1));
    Ok(identified
        .before
        .iter()
        .zip(pairs)
        .map(|(step, (before, after))| before.compose(step).compose(&after.inverse()))
        .collect())
}

/// Returns the gauge of each axis, after that of the base, in which the nominal arm has the origins
/// of the table. `base` is the gauge of the base.
fn gauges(nominal: &Steps, base: &Frame<f64>) -> Result<Vec<Frame<f64>>, String> {
    let mut gauges = vec![*base];
    let mut before = *base;
    for (k, (step, (roll, link))) in
        nominal.before.iter().zip(ROLLS.into_iter().zip(LINKS)).enumerate()
    {
        let frame = before.compose(step);
        let mut turned = Frame::identity();
        turned.rotate_x(roll.sin_cos());
        // The remainder is a rotation about the axis and a shift of the origin along it.
        let remainder = turned.inverse().compose(&frame);
        if remainder.axes[2].xy().norm() > FORM_TOLERANCE || remainder.axes[2].z < 0.0 {
            return Err(format!("the axis of {link} does not lie as that maker's arms have it"));
        }
        let next = nominal.before.get(k + 1);
        let along = match k {
            // The origin is at the point nearest to the next axis, so that the next origin has no
            // shift along this axis.
            0 | 3 | 4 => remainder.origin.z + next.map_or(0.0, nearest),
            5 => remainder.origin.z + nominal.end.origin.z,
            _ => 0.0,
        };
        let mut gauge = Frame::identity();
        gauge.rotate_z((remainder.axes[0].y, remainder.axes[0].x));
        gauge.translate_z(remainder.origin.z - along);
        before = gauge;
        gauges.push(gauge);
        let placed = frame.compose(&gauge.inverse()).origin;
        let off = match k {
            0 => placed.xy().norm(),
            1 => placed.norm(),
            2 => placed.yz().norm(),
            3 => placed.y.abs(),
            _ => placed.xz().norm(),
        };
        if off > FORM_TOLERANCE {
            return Err(format!(
                "{link} lies {:.3} mm off where that maker's arms have it",
                off * 1e3
            ));
        }
    }
    Ok(gauges)
}

/// Returns the z coordinate \[m\] of the point on the reference z axis that is nearest to the z
/// axis of `frame`; 0 if the axes are parallel.
fn nearest(frame: &Frame<f64>) -> f64 {
    let (z, p) = (&frame.axes[2], &frame.origin);
    let square = z.xy().norm_squared();
    if square > FORM_TOLERANCE { (p.z - z.z * p.dot(z)) / square } else { 0.0 }
}
