//! Conversion of standard (distal) DH tables to the modified form.

use nalgebra::Vector3;

use super::{Joint, JointKind, Placement};
use crate::spatial::Frame;

/// Converts rows of standard DH, T = Rz(θ+q) Tz(d) Tx(a) Rx(α), to joints of modified DH.
///
/// a and α of a row become those of the next joint, where Rx(α) Tx(a) = Tx(a) Rx(α) come first.
/// Those of the last row belong to an added fixed joint. Bodies keep their physical positions;
/// their coordinates change, because a body's frame no longer includes the row's a and α.
pub(super) fn modified(rows: Vec<Joint>) -> Vec<Joint> {
    let mut joints = Vec::with_capacity(rows.len() + 1);
    // Values of a and α in the previous row.
    let mut previous = (0.0, 0.0);
    let mut last = None;
    for mut row in rows {
        let (a, alpha) = (row.a, row.alpha);
        (row.a, row.alpha) = previous;
        if let Some(Placement { xyz, rpy }) = &mut row.placement {
            let frame = link(previous).compose(&Frame::from_xyz_rpy(xyz, rpy));
            (*xyz, *rpy) = (frame.origin, frame.roll_pitch_yaw());
            (row.a, row.alpha) = (0.0, 0.0);
        }
        for body in &mut row.bodies {
            body.position = link((a, alpha)).point(&body.position);
        }
        previous = (a, alpha);
        last = Some(row.location.clone());
        joints.push(row);
    }
    if let Some(location) = last {
        let (a, alpha) = previous;
        joints.push(Joint {
            name: "flange".to_owned(),
            kind: JointKind::Fixed,
            parent: joints.len().checked_sub(1),
            placement: None,
            mimic: None,
            alpha,
            a,
            theta: 0.0,
            d: 0.0,
            beta: 0.0,
            limits: (f64::NEG_INFINITY, f64::INFINITY),
            stiffness: None,
            beam: None,
            bodies: Vec::new(),
            location,
        });
    }
    joints
}

/// Returns the transform Tx(a) Rx(α) of a link.
fn link((a, alpha): (f64, f64)) -> Frame<f64> {
    Frame::from_xyz_rpy(&Vector3::new(a, 0.0, 0.0), &Vector3::new(alpha, 0.0, 0.0))
}
