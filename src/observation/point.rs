//! Contact of the target with a point, such as a socket or a touch point.

use nalgebra::Vector3;

use super::{Content, Field, Kind, Needs, Scene};
use crate::quantity::Unit;
use crate::scalar::Scalar;

pub(super) const KIND: Kind = Kind {
    name: "point",
    numbers: 3,
    unit: Unit::Length,
    needs: Needs::Target,
    fields: &[Field::new("point", "a point", Content::Fixture)],
    declared_by: "[[point]]",
    lacking: "",
    residuals: ("position", &["x", "y", "z"]),
    error_label: "missed point, mm",
    row: ("contact with a point", "contacts with points"),
    measured: "contacts with points",
    suspects: "the names in the column point",
};

/// Predicts the offset x − P of the target x from the point P, arm base frame \[m\]; 0 in contact.
pub(super) fn predict<S: Scalar>(scene: &Scene<S>) -> Vector3<S> {
    let offset = scene.target - scene.fixtures[0].position();
    Vector3::from_fn(|axis, _| scene.base[axis].dot(&offset))
}
