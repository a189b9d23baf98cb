//! Pose with its measured position.

use nalgebra::Vector3;

use crate::paper::Measured;
use crate::problem::{PoseConditions, Problem};

/// Commanded conditions of a pose with the measured position.
#[derive(Debug, Clone)]
pub struct MeasuredPose {
    /// Commanded configuration, payload and hoist.
    pub conditions: PoseConditions,
    /// Measured position, measuring frame \[m\].
    pub position: Vector3<f64>,
}

impl MeasuredPose {
    /// Returns the pose in the form that the procedure of [Chen2021] expects.
    pub fn measured(&self) -> Measured<'_> {
        Measured { setup: self.conditions.view(), position: self.position }
    }

    /// Returns the pose with payload and hoist force multiplied by the given factors. A load that
    /// the pose does not state is taken from `arm`.
    pub fn with_scaled_loads(&self, (payload, hoist): (f64, f64), arm: &Problem) -> Self {
        let declared =
            arm.joints.iter().find_map(|joint| Some(joint.beam.as_ref()?.hoist.as_ref()?.force));
        let mut pose = self.clone();
        let conditions = &mut pose.conditions;
        conditions.payload = Some(conditions.payload.unwrap_or(arm.tool.payload_mass) * payload);
        conditions.hoist = conditions.hoist.or(declared).map(|force| force * hoist);
        pose
    }
}
