//! Tilt of a frame of the arm against gravity, as an inclinometer measures it.

use nalgebra::Vector3;

use super::{Content, Field, Kind, Needs, Scene};
use crate::quantity::Unit;
use crate::scalar::Scalar;

pub(super) const KIND: Kind = Kind {
    name: "tilt",
    numbers: 2,
    unit: Unit::Angle,
    needs: Needs::Frame,
    fields: &[
        Field::new("frame", "a frame", Content::Frame).optional(),
        Field::new("tilt_x", "a tilt", Content::Number(Unit::Angle)),
        Field::new("tilt_y", "a tilt", Content::Number(Unit::Angle)),
    ],
    declared_by: "tilt_sigma_deg in [data]",
    lacking: "its tilts",
    residuals: ("tilt", &["tilt_x", "tilt_y"]),
    error_label: "tilt, °",
    row: ("row of tilts", "rows of tilts"),
    measured: "tilts",
    suspects: "the names in the column frame",
};

/// Squared cosine that is added to that of a tilt, so that the tilt has a derivative at 90°.
const MIN_SQUARED_COSINE: f64 = 1e-18;

/// Predicts the angles τ of the frame's x and y axes above the horizontal \[rad\]: sin τ = a·u for
/// an axis a and the direction u against gravity.
pub(super) fn predict<S: Scalar>(scene: &Scene<S>) -> Vector3<S> {
    let (zero, gravity) = (S::from(0.0), scene.gravity);
    let magnitude = gravity.dot(&gravity).sqrt();
    let up = if magnitude.re() > 0.0 {
        -gravity / magnitude
    } else {
        Vector3::new(zero, zero, S::from(1.0))
    };
    let tilt = |axis: &Vector3<S>| {
        let sine = axis.dot(&up);
        let level = axis.cross(&up);
        let cosine = (level.dot(&level) + MIN_SQUARED_COSINE).sqrt();
        sine.atan2(cosine)
    };
    Vector3::new(tilt(&scene.frame[0]), tilt(&scene.frame[1]), zero)
}
