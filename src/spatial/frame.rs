//! Right-handed frames.

use nalgebra::Vector3;

use super::rotation_axes;
use crate::scalar::Scalar;

/// Frame given by its axes and its origin in a reference frame.
///
/// The methods that move the frame multiply its transform from the right: motions are given in the
/// frame's axes. A rotation about an axis combines two columns; no 4 × 4 product is formed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame<S> {
    /// Unit vectors along the frame's x, y and z axes, in the axes of the reference frame.
    pub axes: [Vector3<S>; 3],
    /// Position of the origin in the reference frame \[m\].
    pub origin: Vector3<S>,
}

impl<S: Scalar> Default for Frame<S> {
    fn default() -> Self {
        Self::identity()
    }
}

impl<S: Scalar> Frame<S> {
    /// Creates the identity: the reference frame itself.
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

    /// Creates the frame at `origin` \[m\] with the axes of the reference frame rotated by the
    /// rotation vector `w` \[rad\].
    pub fn from_rotation_vector(origin: Vector3<S>, w: &Vector3<S>) -> Self {
        Self { axes: rotation_axes(w), origin }
    }

    /// Rotates the frame about its x axis by the angle with this (sin, cos).
    #[inline]
    pub fn rotate_x(&mut self, (sin, cos): (S, S)) {
        self.rotate_in_plane(1, 2, sin, cos);
    }

    /// Rotates the frame about its y axis by the angle with this (sin, cos).
    #[inline]
    pub fn rotate_y(&mut self, (sin, cos): (S, S)) {
        self.rotate_in_plane(2, 0, sin, cos);
    }

    /// Rotates the frame about its z axis by the angle with this (sin, cos).
    #[inline]
    pub fn rotate_z(&mut self, (sin, cos): (S, S)) {
        self.rotate_in_plane(0, 1, sin, cos);
    }

    /// Rotates the axes with the indices `first` and `second` in their plane, from `first` towards
    /// `second`.
    fn rotate_in_plane(&mut self, first: usize, second: usize, sin: S, cos: S) {
        let (u, v) = (self.axes[first], self.axes[second]);
        self.axes[first] = u * cos + v * sin;
        self.axes[second] = v * cos - u * sin;
    }

    /// Rotates the frame by the rotation vector `w` \[rad\], which is given in the frame's axes.
    pub fn rotate(&mut self, w: &Vector3<S>) {
        self.axes = rotation_axes(w).map(|axis| self.vector(&axis));
    }

    /// Translates the frame along its x axis by `distance` \[m\].
    #[inline]
    pub fn translate_x(&mut self, distance: S) {
        self.origin += self.axes[0] * distance;
    }

    /// Translates the frame along its z axis by `distance` \[m\].
    #[inline]
    pub fn translate_z(&mut self, distance: S) {
        self.origin += self.axes[2] * distance;
    }

    /// Translates the frame by `displacement` \[m\], which is given in the frame's axes.
    pub fn translate(&mut self, displacement: &Vector3<S>) {
        self.origin = self.point(displacement);
    }

    /// Transforms the coordinates of a point \[m\] from this frame to the reference frame.
    #[inline]
    pub fn point(&self, point: &Vector3<S>) -> Vector3<S> {
        self.origin + self.vector(point)
    }

    /// Rotates the components of a vector from this frame's axes to those of the reference frame.
    #[inline]
    pub fn vector(&self, vector: &Vector3<S>) -> Vector3<S> {
        self.axes[0] * vector.x + self.axes[1] * vector.y + self.axes[2] * vector.z
    }

    /// Returns `frame`, which is given relative to this frame, relative to the reference frame.
    #[must_use]
    pub fn compose(&self, frame: &Self) -> Self {
        Self { axes: frame.axes.map(|axis| self.vector(&axis)), origin: self.point(&frame.origin) }
    }

    /// Returns the frame with the derivatives of its dual numbers set to zero.
    #[must_use]
    pub fn without_derivatives(&self) -> Self {
        let constant = |vector: &Vector3<S>| vector.map(|coordinate| S::from(coordinate.re()));
        Self { axes: self.axes.each_ref().map(constant), origin: constant(&self.origin) }
    }

    /// Rotates the components of a vector from the reference frame's axes to this frame's axes.
    pub fn resolve(&self, vector: &Vector3<S>) -> Vector3<S> {
        Vector3::new(self.axes[0].dot(vector), self.axes[1].dot(vector), self.axes[2].dot(vector))
    }
}
