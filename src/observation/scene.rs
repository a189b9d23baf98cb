//! Quantities from which rows are predicted.

use nalgebra::Vector3;

use super::FixtureValues;
use crate::scalar::Scalar;
use crate::spatial::Frame;

/// Quantities from which a row is predicted, in the measuring frame unless stated otherwise.
#[derive(Debug, Clone, Copy)]
pub struct Scene<S> {
    /// Position of the target \[m\]. For position rows it is the reading of the instrument.
    pub target: Vector3<S>,
    /// Axes of the arm's base.
    pub base: [Vector3<S>; 3],
    /// Fixtures that the row refers to, in its order.
    pub fixtures: [FixtureValues<S>; 2],
    /// Axes of the frame whose tilt is measured, arm base frame.
    pub frame: [Vector3<S>; 3],
    /// Gravity, arm base frame [m/s²].
    pub gravity: Vector3<S>,
    /// Frames that carry the fixtures, in their order.
    pub carriers: [Frame<S>; 2],
    /// Point of the second fixture, in its frame \[m\].
    pub point: Vector3<S>,
}

impl<S: Scalar> Default for Scene<S> {
    fn default() -> Self {
        let axes = [0, 1, 2].map(|k| Vector3::from_fn(|i, _| S::from(f64::from(u8::from(i == k)))));
        Self {
            target: Vector3::from_element(S::from(0.0)),
            base: axes,
            fixtures: [FixtureValues::default(); 2],
            frame: axes,
            gravity: Vector3::from_element(S::from(0.0)),
            carriers: [Frame::identity(); 2],
            point: Vector3::from_element(S::from(0.0)),
        }
    }
}

/// Squared length that is added under the square root, so that a length of 0 has a derivative
/// \[m²\].
const MIN_SQUARED_LENGTH: f64 = 1e-24;

/// Returns the length of a vector, with a derivative of 0 at length 0.
pub(super) fn length<S: Scalar>(vector: &Vector3<S>) -> S {
    (vector.x * vector.x + vector.y * vector.y + vector.z * vector.z + MIN_SQUARED_LENGTH).sqrt()
}

/// Returns a vector whose first entry is the only number that a row measures.
pub(super) fn single_number<S: Scalar>(value: S) -> Vector3<S> {
    Vector3::new(value, S::from(0.0), S::from(0.0))
}
