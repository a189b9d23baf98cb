//! Position of the target, as a tracker or another instrument reads it.

use nalgebra::Vector3;

use super::{Kind, Needs, Scene};
use crate::quantity::Unit;
use crate::scalar::Scalar;

pub(super) const KIND: Kind = Kind {
    name: "position",
    numbers: 3,
    unit: Unit::Length,
    needs: Needs::Target,
    reference: "",
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
