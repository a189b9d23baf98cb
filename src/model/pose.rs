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
}
