//! A measured pose.

use nalgebra::Vector3;

use crate::paper::Measured;
use crate::problem::{PoseConditions, Problem};

/// A measured pose.
#[derive(Debug, Clone)]
pub struct MeasuredPose {
    /// What was set.
    pub conditions: PoseConditions,
    /// What the tracker read \[m\].
    pub position: Vector3<f64>,
}

impl MeasuredPose {
    /// For the paper's procedure.
    pub fn measured(&self) -> Measured<'_> {
        Measured { setup: self.conditions.view(), position: self.position }
    }

    /// The same with payload and hoist multiplied, those that `arm` declares where the pose says
    /// nothing.
    pub fn under(&self, (payload, hoist): (f64, f64), arm: &Problem) -> Self {
        let declared =
            arm.joints.iter().find_map(|joint| Some(joint.beam.as_ref()?.hoist.as_ref()?.force));
        let mut pose = self.clone();
        let own = &mut pose.conditions;
        own.payload = Some(own.payload.unwrap_or(arm.tool.payload_mass) * payload);
        own.hoist = own.hoist.or(declared).map(|force| force * hoist);
        pose
    }
}
