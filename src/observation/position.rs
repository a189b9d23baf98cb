//! Position of the target, as a tracker or another instrument reads it.

use nalgebra::Vector3;

use super::{Content, Field, Kind, Needs, Scene};
use crate::quantity::Unit;
use crate::scalar::Scalar;

pub(super) const KIND: Kind = Kind {
    name: "position",
    numbers: 3,
    unit: Unit::Length,
    needs: Needs::Target,
    fields: &[
        Field::new("x", "a position", Content::Number(Unit::Length)),
        Field::new("y", "a position", Content::Number(Unit::Length)),
        Field::new("z", "a position", Content::Number(Unit::Length)),
    ],
    declared_by: "",
    lacking: "a position",
    residuals: ("position", &["x", "y", "z"]),
    error_label: "error, mm",
    row: ("pose", "poses"),
    measured: "measurements",
    suspects: "whether base and session are declared",
};

/// Predicts the position that the instrument reads, measuring frame \[m\].
pub(super) fn predict<S: Scalar>(scene: &Scene<S>) -> Vector3<S> {
    scene.target
}
