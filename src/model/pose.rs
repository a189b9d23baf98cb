//! A pose as the model sees it.

use nalgebra::Vector3;

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
    /// The measured numbers, zeros behind them \[m\]: the position, measuring frame; a distance; 0 of a contact.
    pub measured: Vector3<f64>,
    /// 1 σ of each of them \[m\].
    pub sigma: f64,
    /// The orientation of the target, where it counts.
    pub orientation: Option<SeenOrientation>,
}

impl Pose<'_> {
    /// How many numbers are measured: those of the observation, and three of an orientation that counts.
    pub fn coordinates(&self) -> usize {
        self.observation.coordinates() + if self.orientation.is_some() { 3 } else { 0 }
    }
}

/// A measured orientation of a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenOrientation {
    /// Its axes, measuring frame; `None`: as predicted, of poses that are still to be measured.
    pub axes: Option<[Vector3<f64>; 3]>,
    /// 1 σ about each axis \[rad\].
    pub sigma: f64,
}
