//! Measured rows in the form that the model predicts.

use nalgebra::{UnitQuaternion, Vector3};

use crate::problem::{Observation, PoseView};

/// Measured row with its conditions.
#[derive(Debug, Clone, Copy)]
pub struct Pose<'a> {
    /// Configuration and conditions of the row.
    pub setup: PoseView<'a>,
    /// Index of the base on which the arm stands in this row.
    pub base: usize,
    /// Index of the target that the row measures.
    pub target: usize,
    /// Quantity that is measured.
    pub observation: Observation,
    /// Measured numbers, followed by zeros \[m\], \[rad\] or \[px\]: a position in the measuring
    /// frame, a distance, tilts, a pixel, 0 for a contact.
    pub measured: &'a Vector3<f64>,
    /// 1 σ of each measured number \[m\], \[rad\] or \[px\].
    pub sigma: f64,
    /// Orientation of the target, if it is fitted.
    pub orientation: Option<MeasuredOrientation<'a>>,
}

impl Pose<'_> {
    /// Returns the number of measured scalars: those of the observation, plus three if an
    /// orientation is fitted.
    pub fn coordinates(&self) -> usize {
        self.observation.coordinates() + if self.orientation.is_some() { 3 } else { 0 }
    }
}

/// Measured orientation of a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredOrientation<'a> {
    /// Orientation in the measuring frame; `None` for planned poses, which are treated as measured
    /// without error.
    pub measured: Option<&'a UnitQuaternion<f64>>,
    /// Declared standard deviation of the orientation about each axis \[rad\].
    pub sigma: f64,
}

impl MeasuredOrientation<'_> {
    /// Returns the measured x, y and z axis of the target's frame, as unit vectors in the measuring
    /// frame; `None` if the row has no orientation.
    pub fn axes(&self) -> Option<[Vector3<f64>; 3]> {
        let measured = self.measured?;
        Some([Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| measured * axis))
    }
}

#[cfg(test)]
mod tests {
    use super::Pose;

    #[test]
    fn a_million_poses_have_room() {
        // A fit keeps 192 MB for a million poses besides their numbers.
        assert!(size_of::<Pose>() <= 192, "{}", size_of::<Pose>());
    }
}
