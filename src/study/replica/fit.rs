//! The paper's procedure on some poses, and what it leaves of others.

use super::measured_pose::MeasuredPose;
use crate::fit::{ErrorSummary, IdentifyError};
use crate::measurement::{Dataset, DatasetError};
use crate::paper::{self, EndPoint, Identified, Measured, Options, Parameters, Reading};
use crate::problem::Problem;

/// Why there are no replicas.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the message of each variant says what it stands for")]
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

/// The paper's procedure on some poses.
pub(super) fn fitted(
    problem: &Problem,
    poses: &[MeasuredPose],
    options: &Options,
) -> Result<Identified, ReplicaError> {
    let poses: Vec<Measured> = poses.iter().map(MeasuredPose::measured).collect();
    Ok(paper::identify(problem, &poses, options)?)
}

/// What an arm leaves of some poses, predicted by the paper's closed forms.
pub(super) fn judged(
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

/// Poses to identify with, and those that are held out.
pub(super) fn dataset(
    poses: &[MeasuredPose],
    held_out: &[MeasuredPose],
) -> Result<Dataset, DatasetError> {
    let all = || poses.iter().chain(held_out);
    let of =
        |value: fn(&MeasuredPose) -> Option<f64>| all().map(value).collect::<Option<Vec<f64>>>();
    let configurations = all().map(|pose| pose.conditions.configuration.clone());
    let mut builder =
        Dataset::builder(configurations, all().map(|pose| pose.position).collect::<Vec<_>>())
            .held_out(poses.len()..poses.len() + held_out.len());
    if let Some(payload) = of(|pose| pose.conditions.payload) {
        builder = builder.payload(payload);
    }
    if let Some(hoist) = of(|pose| pose.conditions.hoist) {
        builder = builder.hoist(hoist);
    }
    builder.build()
}
