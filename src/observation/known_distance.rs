//! Known distance between two points of the surroundings.

use nalgebra::Vector3;

use super::scene::{length, single_number};
use super::{Kind, Needs, Scene};
use crate::quantity::Unit;
use crate::scalar::Scalar;

pub(super) const KIND: Kind = Kind {
    name: "known distance",
    numbers: 1,
    unit: Unit::Length,
    needs: Needs::Fixtures,
    fields: &[],
    declared_by: "",
    lacking: "",
    residuals: ("distance", &["distance"]),
    error_label: "known distance, mm",
    row: ("pose", "poses"),
    measured: "poses",
    suspects: "whether base and session are declared",
};

/// Predicts the distance ‖P₂ − P₁‖ between the two fixtures \[m\].
pub(super) fn predict<S: Scalar>(scene: &Scene<S>) -> Vector3<S> {
    let [first, second] = scene.fixtures;
    single_number(length(&(second.position() - first.position())))
}
