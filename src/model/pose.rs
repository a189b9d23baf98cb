//! A pose as the model sees it.

use nalgebra::{UnitQuaternion, Vector3};

use crate::problem::{Observation, PoseView};

/// One measured pose as the model sees it.
#[derive(Debug, Clone, Copy)]
pub struct Pose<'a> {
    /// What was set.
    pub setup: PoseView<'a>,
    /// Which base.
    pub base: usize,
    /// Which target.
    pub target: usize,
    /// What is measured of it.
    pub observation: Observation,
    /// The measured numbers, zeros behind them \[m\]: the position, measuring frame; a distance; 0
    /// of a contact.
    pub measured: &'a Vector3<f64>,
    /// 1 σ of each of them \[m\].
    pub sigma: f64,
    /// The orientation of the target, where it counts.
    pub orientation: Option<MeasuredOrientation<'a>>,
}

impl Pose<'_> {
    /// How many numbers are measured: those of the observation, and three of an orientation that
    /// counts.
    pub fn coordinates(&self) -> usize {
        self.observation.coordinates() + if self.orientation.is_some() { 3 } else { 0 }
    }
}

/// A measured orientation of a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeasuredOrientation<'a> {
    /// As measured, measuring frame; `None`: as predicted, of poses that are still to be measured.
    pub measured: Option<&'a UnitQuaternion<f64>>,
    /// 1 σ about each axis \[rad\].
    pub sigma: f64,
}

impl MeasuredOrientation<'_> {
    /// Its axes, measuring frame, where it was measured.
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
        // Of a million, 192 MB: what fits hold of each pose besides its numbers.
        assert!(size_of::<Pose>() <= 192, "{}", size_of::<Pose>());
    }
}
