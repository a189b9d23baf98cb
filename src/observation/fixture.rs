//! Points, anchors and surfaces around the arm.

use nalgebra::Vector3;

use crate::quantity::Unit;
use crate::scalar::Scalar;

/// Largest count of numbers that describe a fixture.
const MAX_NUMBERS: usize = 4;

/// Kind of a fixture, which determines its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FixtureKind {
    /// Point that the target touches, such as a socket: x, y, z \[m\].
    Point,
    /// Point that distances are measured to: x, y, z \[m\].
    Anchor,
    /// Plane n·x = d: rx, ry \[rad\], d \[m\], with n of
    /// [`plane_normal`](crate::spatial::plane_normal).
    Plane,
    /// Sphere: centre x, y, z and radius \[m\].
    Sphere,
}

impl FixtureKind {
    /// Returns the word that names its table, its column and its parameters.
    pub fn word(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Anchor => "anchor",
            Self::Plane | Self::Sphere => "surface",
        }
    }

    /// Returns the names of its numbers, as they follow the dot in the name of a parameter.
    pub fn fields(self) -> &'static [&'static str] {
        match self {
            Self::Point | Self::Anchor => &["x", "y", "z"],
            Self::Plane => &["rx", "ry", "d"],
            Self::Sphere => &["x", "y", "z", "radius"],
        }
    }

    /// Returns the keys of the problem file that declare one of its numbers.
    pub fn declared_by(self, axis: usize) -> &'static str {
        match (self, axis) {
            (Self::Plane, _) => "normal and at_m",
            (Self::Sphere, 3) => "radius_m",
            _ => "at_m",
        }
    }

    /// Returns the unit of one of its numbers.
    pub fn unit(self, axis: usize) -> Unit {
        if self == Self::Plane && axis < 2 { Unit::Angle } else { Unit::Length }
    }
}

/// Numbers of a fixture in the order of [`FixtureKind::fields`], SI, measuring frame, followed by
/// zeros.
#[derive(Debug, Clone, Copy)]
pub struct FixtureValues<S> {
    /// Kind of the fixture.
    pub kind: FixtureKind,
    /// Values of its numbers.
    pub numbers: [S; MAX_NUMBERS],
}

impl<S: Scalar> Default for FixtureValues<S> {
    fn default() -> Self {
        Self { kind: FixtureKind::Point, numbers: [S::from(0.0); MAX_NUMBERS] }
    }
}

impl FixtureValues<f64> {
    /// Creates the values of a fixture; undeclared numbers are 0.
    pub fn new(kind: FixtureKind, declared: &[Option<f64>]) -> Self {
        let mut values = Self { kind, ..Self::default() };
        for (number, declared) in values.numbers.iter_mut().zip(declared) {
            *number = declared.unwrap_or(0.0);
        }
        values
    }
}

impl<S: Scalar> FixtureValues<S> {
    /// Returns its position \[m\]: of a sphere the centre. A plane has none.
    pub fn position(&self) -> Vector3<S> {
        let [x, y, z, _] = self.numbers;
        Vector3::new(x, y, z)
    }
}
