//! A pose as the model sees it.

use nalgebra::Vector3;

use crate::problem::PoseView;

/// One measured pose as the model sees it.
#[derive(Debug, Clone, Copy)]
pub struct Pose<'a> {
    /// What was set.
    pub setup: PoseView<'a>,
    /// Which base.
    pub base: usize,
    /// Which target.
    pub target: usize,
    /// Measured position, measuring frame \[m\].
    pub measured: Vector3<f64>,
    /// 1 σ of each coordinate \[m\].
    pub sigma: f64,
    /// The orientation of the target, where it counts.
    pub orientation: Option<SeenOrientation>,
}

/// A measured orientation of a target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenOrientation {
    /// Its axes, measuring frame; `None`: as predicted, of poses that are still to be measured.
    pub axes: Option<[Vector3<f64>; 3]>,
    /// 1 σ about each axis \[rad\].
    pub sigma: f64,
}
