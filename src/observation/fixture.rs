//! Points, anchors and surfaces around the arm; cameras and markers, which may move with the arm.

use nalgebra::Vector3;

use crate::quantity::Unit;
use crate::scalar::Scalar;
use crate::spatial::Frame;

/// Largest number of values that describe a fixture (a camera with its lens distortion).
pub(crate) const MAX_FIXTURE_NUMBERS: usize = 15;

/// Kind of a fixture, which determines its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum FixtureKind {
    /// Point that the target touches, such as a socket: x, y, z \[m\].
    Point,
    /// Point from which distances are measured: x, y, z \[m\].
    Anchor,
    /// Plane n·x = d: rx, ry \[rad\], d \[m\], with n of
    /// [`plane_normal`](crate::spatial::plane_normal).
    Plane,
    /// Sphere: centre x, y, z and radius \[m\].
    Sphere,
    /// Pinhole camera: position \[m\] and rotation vector \[rad\] in the frame that carries it,
    /// focal lengths and centre \[px\], distortion.
    Camera,
    /// Camera with an equidistant (fisheye) lens: the numbers of a pinhole camera with another
    /// distortion model.
    Fisheye,
    /// Object with points that cameras observe: position \[m\] and rotation vector \[rad\] in the
    /// frame that carries it.
    Marker,
}

impl FixtureKind {
    /// Returns the word that names the kind's table in a problem file, its column and its
    /// parameters.
    pub fn word(self) -> &'static str {
        match self {
            Self::Point => "point",
            Self::Anchor => "anchor",
            Self::Plane | Self::Sphere => "surface",
            Self::Camera | Self::Fisheye => "camera",
            Self::Marker => "marker",
        }
    }

    /// Returns true if the first six numbers of the fixture are a pose in the frame that carries
    /// it.
    pub fn has_pose(self) -> bool {
        matches!(self, Self::Camera | Self::Fisheye | Self::Marker)
    }

    /// Returns the names of the fixture's numbers, which are the last part of parameter names.
    pub fn fields(self) -> &'static [&'static str] {
        match self {
            Self::Point | Self::Anchor => &["x", "y", "z"],
            Self::Plane => &["rx", "ry", "d"],
            Self::Sphere => &["x", "y", "z", "radius"],
            Self::Camera => &[
                "x", "y", "z", "rx", "ry", "rz", "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2",
                "k3",
            ],
            Self::Fisheye => {
                &["x", "y", "z", "rx", "ry", "rz", "fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"]
            }
            Self::Marker => &["x", "y", "z", "rx", "ry", "rz"],
        }
    }

    /// Returns the keys of the problem file that declare number `axis` of the fixture.
    pub fn declared_by(self, axis: usize) -> &'static str {
        match (self, axis) {
            (Self::Plane, _) => "normal and at_m",
            (Self::Sphere, 3) => "radius_m",
            (kind, _) if kind.has_pose() => "at_m and rotation_deg",
            _ => "at_m",
        }
    }

    /// Returns the unit of number `axis` of the fixture.
    pub fn unit(self, axis: usize) -> Unit {
        match (self, axis) {
            (Self::Plane, 0 | 1) => Unit::Angle,
            (kind, 3..6) if kind.has_pose() => Unit::Angle,
            (Self::Camera | Self::Fisheye, 6..10) => Unit::Pixel,
            (Self::Camera | Self::Fisheye, 10..) => Unit::Number,
            _ => Unit::Length,
        }
    }
}

/// Numbers of a fixture in the order of [`FixtureKind::fields`], in SI units or px, followed by
/// zeros. Those of cameras and markers are in the frame that carries them, others in the measuring
/// frame.
#[derive(Debug, Clone, Copy)]
pub struct FixtureValues<S> {
    /// Kind of the fixture.
    pub kind: FixtureKind,
    /// Values of the fixture's numbers, in the order of [`FixtureKind::fields`].
    pub numbers: [S; MAX_FIXTURE_NUMBERS],
}

impl<S: Scalar> Default for FixtureValues<S> {
    fn default() -> Self {
        Self { kind: FixtureKind::Point, numbers: [S::from(0.0); MAX_FIXTURE_NUMBERS] }
    }
}

impl FixtureValues<f64> {
    /// Creates the values of a fixture (point, surface, camera or marker of the set-up) from its
    /// declared numbers; missing ones are 0.
    pub fn new(kind: FixtureKind, declared: &[Option<f64>]) -> Self {
        let mut values = Self { kind, ..Self::default() };
        for (number, declared) in values.numbers.iter_mut().zip(declared) {
            *number = declared.unwrap_or(0.0);
        }
        values
    }
}

impl<S: Scalar> FixtureValues<S> {
    /// Returns the position of the fixture \[m\], for a sphere the centre. Not meaningful for a
    /// plane.
    pub fn position(&self) -> Vector3<S> {
        let [x, y, z, ..] = self.numbers;
        Vector3::new(x, y, z)
    }

    /// Returns the frame of a camera or marker in the frame that carries it.
    pub fn frame(&self) -> Frame<S> {
        let [_, _, _, rx, ry, rz, ..] = self.numbers;
        Frame::from_rotation_vector(self.position(), &Vector3::new(rx, ry, rz))
    }
}
