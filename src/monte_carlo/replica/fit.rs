//! The paper's procedure on some poses, and what it leaves of others.

use super::shot::Shot;
use crate::identify::{ErrorSummary, IdentifyError};
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
pub(super) fn fitted(problem: &Problem, shots: &[Shot], options: &Options) -> Result<Identified, ReplicaError> {
    let poses: Vec<Measured> = shots.iter().map(Shot::measured).collect();
    Ok(paper::identify(problem, &poses, options)?)
}

/// What an arm leaves of some poses, predicted by the paper's closed forms.
pub(super) fn judged(problem: &Problem, shots: &[Shot], parameters: &Parameters, reading: &Reading) -> ErrorSummary {
    let error = |shot: &Shot| {
        shot.position - EndPoint::new(problem, parameters, &shot.conditions.view(), reading).position(parameters)
    };
    ErrorSummary::of(&shots.iter().map(error).collect::<Vec<_>>())
}

/// Poses to identify with, and those that are held out.
pub(super) fn dataset(shots: &[Shot], held_out: &[Shot]) -> Result<Dataset, DatasetError> {
    let all = || shots.iter().chain(held_out);
    let of = |value: fn(&Shot) -> Option<f64>| all().map(value).collect::<Option<Vec<f64>>>();
    let configurations = all().map(|shot| shot.conditions.configuration.clone());
    let mut builder = Dataset::builder(configurations, all().map(|shot| shot.position).collect::<Vec<_>>())
        .held_out(shots.len()..shots.len() + held_out.len());
    if let Some(payload) = of(|shot| shot.conditions.payload) {
        builder = builder.payload(payload);
    }
    if let Some(hoist) = of(|shot| shot.conditions.hoist) {
        builder = builder.hoist(hoist);
    }
    builder.build()
}
