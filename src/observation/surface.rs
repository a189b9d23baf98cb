//! Contact of the target with a plane or a sphere.

use nalgebra::Vector3;

use super::scene::{length, single_number};
use super::{Content, Field, FixtureKind, Kind, Needs, Scene};
use crate::quantity::Unit;
use crate::scalar::Scalar;
use crate::spatial::plane_normal;

pub(super) const KIND: Kind = Kind {
    name: "surface",
    numbers: 1,
    unit: Unit::Length,
    needs: Needs::Target,
    fields: &[
        Field::new("surface", "a surface", Content::Fixture),
        Field::new("offset", "an offset", Content::Number(Unit::Length)).optional(),
    ],
    declared_by: "[[surface]]",
    lacking: "",
    residuals: ("offset", &["offset"]),
    error_label: "distance from the surface, mm",
    row: ("contact with a surface", "contacts with surfaces"),
    measured: "contacts with surfaces",
    suspects: "the names in the column surface",
};

/// Predicts the distance of the target x from the surface \[m\]: n·x − d from a plane, ‖x − C‖ − ρ
/// from a sphere.
pub(super) fn predict<S: Scalar>(scene: &Scene<S>) -> Vector3<S> {
    let [surface, _] = scene.fixtures;
    let [x, y, z, radius, ..] = surface.numbers;
    single_number(if surface.kind == FixtureKind::Plane {
        plane_normal(x, y).dot(&scene.target) - z
    } else {
        length(&(scene.target - surface.position())) - radius
    })
}
