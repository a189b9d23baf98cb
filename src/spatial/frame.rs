//! A right-handed frame.

use nalgebra::Vector3;

use super::rotation_axes;
use crate::scalar::Scalar;

/// A frame seen from another: its axes and its origin \[m\].
///
/// Moving a frame multiplies its transform from the right, so motions are given in its own axes.
/// Rotations about an axis turn two columns; no 4 × 4 product is ever formed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame<S> {
    /// Unit axes x, y, z.
    pub axes: [Vector3<S>; 3],
    /// Origin \[m\].
    pub origin: Vector3<S>,
}

impl<S: Scalar> Default for Frame<S> {
    fn default() -> Self {
        Self::identity()
    }
}

impl<S: Scalar> Frame<S> {
    /// The reference frame itself.
    pub fn identity() -> Self {
        let (zero, one) = (S::from(0.0), S::from(1.0));
        Self {
            axes: [
                Vector3::new(one, zero, zero),
                Vector3::new(zero, one, zero),
                Vector3::new(zero, zero, one),
            ],
            origin: Vector3::from_element(zero),
        }
    }

    /// The frame at `origin` \[m\] turned by the rotation vector `w` \[rad\].
    pub fn from_rotation_vector(origin: Vector3<S>, w: &Vector3<S>) -> Self {
        Self { axes: rotation_axes(w), origin }
    }

    /// Turns about the own x axis, given (sin, cos).
    #[inline]
    pub fn rotate_x(&mut self, (sin, cos): (S, S)) {
        self.turn(1, 2, sin, cos);
    }

    /// Turns about the own y axis, given (sin, cos).
    #[inline]
    pub fn rotate_y(&mut self, (sin, cos): (S, S)) {
        self.turn(2, 0, sin, cos);
    }

    /// Turns about the own z axis, given (sin, cos).
    #[inline]
    pub fn rotate_z(&mut self, (sin, cos): (S, S)) {
        self.turn(0, 1, sin, cos);
    }

    fn turn(&mut self, first: usize, second: usize, sin: S, cos: S) {
        let (u, v) = (self.axes[first], self.axes[second]);
        self.axes[first] = u * cos + v * sin;
        self.axes[second] = v * cos - u * sin;
    }

    /// Turns by the rotation vector `w` \[rad\], own axes.
    pub fn rotate(&mut self, w: &Vector3<S>) {
        self.axes = rotation_axes(w).map(|axis| self.vector(&axis));
    }

    /// Moves along the own x axis by `distance` \[m\].
    #[inline]
    pub fn translate_x(&mut self, distance: S) {
        self.origin += self.axes[0] * distance;
    }

    /// Moves along the own z axis by `distance` \[m\].
    #[inline]
    pub fn translate_z(&mut self, distance: S) {
        self.origin += self.axes[2] * distance;
    }

    /// Moves by `displacement` \[m\], own axes.
    pub fn translate(&mut self, displacement: &Vector3<S>) {
        self.origin = self.point(displacement);
    }

    /// Reference coordinates of a point \[m\] given in this frame.
    #[inline]
    pub fn point(&self, point: &Vector3<S>) -> Vector3<S> {
        self.origin + self.vector(point)
    }

    /// Reference coordinates of a vector given in this frame.
    #[inline]
    pub fn vector(&self, vector: &Vector3<S>) -> Vector3<S> {
        self.axes[0] * vector.x + self.axes[1] * vector.y + self.axes[2] * vector.z
    }

    /// A frame given in this one, as seen from the reference frame.
    #[must_use]
    pub fn compose(&self, frame: &Self) -> Self {
        Self { axes: frame.axes.map(|axis| self.vector(&axis)), origin: self.point(&frame.origin) }
    }

    /// The same frame without derivatives.
    #[must_use]
    pub fn without_derivatives(&self) -> Self {
        let constant = |vector: &Vector3<S>| vector.map(|coordinate| S::from(coordinate.re()));
        Self { axes: self.axes.each_ref().map(constant), origin: constant(&self.origin) }
    }

    /// This frame's coordinates of a vector given in the reference frame.
    pub fn resolve(&self, vector: &Vector3<S>) -> Vector3<S> {
        Vector3::new(self.axes[0].dot(vector), self.axes[1].dot(vector), self.axes[2].dot(vector))
    }
}
