//! Procedure of \[Chen2021\] on measured poses, and its errors at held-out poses.

use nalgebra::Vector3;

use crate::fit::{ErrorSummary, IdentifyError};
use crate::measurement::{Dataset, DatasetError};
use crate::paper::{self, EndPoint, Identified, Measured, Options, Parameters, Reading};
use crate::problem::{PoseConditions, Problem};

/// Error that prevents the replicas of an experiment.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReplicaError {
    #[error(
        "no flexibility of the arm makes the rigid fit leave {:.4} mm; check rigid_leaves_mm, stiffnesses and masses", leaves * 1e3
    )]
    Scale { leaves: f64 },
    #[error(transparent)]
    Paper(#[from] paper::IdentifyError),
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    #[error(transparent)]
    Dataset(#[from] DatasetError),
}

/// Identifies an arm from some poses by the procedure of \[Chen2021\].
pub(super) fn identify_as_published(
    problem: &Problem,
    poses: &[MeasuredPose],
    options: &Options,
) -> Result<Identified, ReplicaError> {
    let poses: Vec<Measured> = poses.iter().map(MeasuredPose::measured).collect();
    Ok(paper::identify(problem, &poses, options)?)
}

/// Returns the errors (measured − predicted position) at some poses, predicted by the closed forms
/// of \[Chen2021\].
pub(super) fn position_errors(
    problem: &Problem,
    poses: &[MeasuredPose],
    parameters: &Parameters,
    reading: &Reading,
) -> ErrorSummary {
    let error = |pose: &MeasuredPose| {
        pose.position
            - EndPoint::new(problem, parameters, &pose.conditions.view(), reading)
                .position(parameters)
    };
    ErrorSummary::of(&poses.iter().map(error).collect::<Vec<_>>())
}

/// Returns the dataset of identification poses and held-out poses.
pub(super) fn dataset(
    poses: &[MeasuredPose],
    held_out: &[MeasuredPose],
) -> Result<Dataset, DatasetError> {
    let rows = || poses.iter().chain(held_out);
    let column =
        |value: fn(&MeasuredPose) -> Option<f64>| rows().map(value).collect::<Option<Vec<f64>>>();
    let configurations = rows().map(|pose| pose.conditions.configuration.clone());
    let mut builder =
        Dataset::builder(configurations, rows().map(|pose| pose.position).collect::<Vec<_>>())
            .held_out(poses.len()..poses.len() + held_out.len());
    if let Some(payload) = column(|pose| pose.conditions.payload) {
        builder = builder.payload(payload);
    }
    if let Some(hoist) = column(|pose| pose.conditions.hoist) {
        builder = builder.hoist(hoist);
    }
    builder.build()
}

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
