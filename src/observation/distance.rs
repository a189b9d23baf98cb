//! Distance from the target to an anchor, as a wire or a ranging instrument measures it.

use nalgebra::Vector3;

use super::scene::{length, single_number};
use super::{Content, Field, Kind, Needs, Scene};
use crate::quantity::Unit;
use crate::scalar::Scalar;

pub(super) const KIND: Kind = Kind {
    name: "distance",
    numbers: 1,
    unit: Unit::Length,
    needs: Needs::Target,
    fields: &[
        Field::new("anchor", "an anchor", Content::Fixture),
        Field::new("distance", "a distance", Content::Positive(Unit::Length)),
    ],
    declared_by: "[[anchor]]",
    lacking: "a distance",
    residuals: ("distance", &["distance"]),
    error_label: "distance, mm",
    row: ("distance", "distances"),
    measured: "distances",
    suspects: "the names in the column anchor",
};

/// Predicts the distance ‖x − A‖ from the target x to the anchor A \[m\].
pub(super) fn predict<S: Scalar>(scene: &Scene<S>) -> Vector3<S> {
    single_number(length(&(scene.target - scene.fixtures[0].position())))
}
