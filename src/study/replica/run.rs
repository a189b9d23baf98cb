//! Identifies every specimen in every way.

use rayon::prelude::*;

use super::alternative::AlternativeModel;
use super::fit::{ReplicaError, dataset, fitted, judged};
use super::measured_pose::MeasuredPose;
use super::reading::{NamedReading, readings};
use super::results::{Left, Replica, ReplicaResults};
use super::simulated_arm::SimulatedArm;
use super::size::sizes;
use super::study::{Case, MisprintStudy};
use crate::fit::{ErrorSummary, Options as FitOptions, Strategy, identify};
use crate::paper::{Form, Options, Parameters, Reading, StiffnessStage};
use crate::problem::Problem;
use crate::random::stream;

/// Draws every specimen and identifies it in every way; calls `done` after each.
///
/// # Errors
/// A specimen cannot be scaled, or a procedure cannot be set up.
pub fn replicate(
    study: &MisprintStudy,
    done: impl Fn() + Sync,
) -> Result<ReplicaResults, ReplicaError> {
    let readings = readings();
    let of_case = |case| (0..study.specimens).map(move |index| (case, index));
    let all: Vec<(&Case, usize)> = study.cases.iter().flat_map(of_case).collect();
    let one = |&(case, index): &(&Case, usize)| {
        let replica = replica(study, &readings, case, index);
        done();
        replica
    };
    let replicas = all.par_iter().map(one).collect::<Result<Vec<Replica>, ReplicaError>>()?;
    Ok(ReplicaResults { sizes: sizes(study), readings, replicas })
}

fn replica(
    study: &MisprintStudy,
    readings: &[NamedReading],
    case: &Case,
    index: usize,
) -> Result<Replica, ReplicaError> {
    use rand::Rng as _;
    let seed = stream(study.seed, index as u64).next_u64();
    let own = SimulatedArm::find(study, case, seed)?;
    let twice = [own.identification.as_slice(), own.again.as_slice()].concat();
    let left = |problem: &Problem,
                poses: &[MeasuredPose],
                reading: &Reading,
                stage|
     -> Result<Left, ReplicaError> {
        let options = Options::new(*reading, stage);
        let found = fitted(problem, poses, &options)?;
        let judged = || judged(problem, &own.held_out, &found.parameters, &options.reading);
        Ok(found.iteration.termination.converged().then(judged))
    };
    let by_stage = |named: &NamedReading| -> Result<[Left; 4], ReplicaError> {
        let (reading, single) = (&named.reading, own.identification.as_slice());
        Ok([
            left(&own.known, single, reading, StiffnessStage::Nominal)?,
            left(&own.declared, single, reading, StiffnessStage::Nominal)?,
            left(&own.declared, single, reading, StiffnessStage::Positions)?,
            left(&own.declared, &twice, reading, StiffnessStage::LoadDifferences)?,
        ])
    };
    let rival = |rival: AlternativeModel| -> Result<Left, ReplicaError> {
        let assumed = rival.assumed(own.known.clone());
        let seen = |poses: &[MeasuredPose]| -> Vec<MeasuredPose> {
            poses.iter().map(|pose| pose.under(rival.loads(), &assumed)).collect()
        };
        let options = Options::new(Form::Corrected, StiffnessStage::Nominal);
        let found = fitted(&assumed, &seen(&own.identification), &options)?;
        let judged = || judged(&assumed, &seen(&own.held_out), &found.parameters, &options.reading);
        Ok(found.iteration.termination.converged().then(judged))
    };
    let fit = |poses: &[MeasuredPose], strategy| -> Result<ErrorSummary, ReplicaError> {
        let (data, mut problem) = (dataset(poses, &own.held_out)?, own.declared.clone());
        problem.data.position_sigma = Some(study.truth.noise_sigma);
        let found = identify(&problem, &data, &FitOptions::default().with_strategy(strategy))?;
        Ok(found.fitted.held_out)
    };
    let rigid =
        left(&own.declared, &own.identification, &Reading::default(), StiffnessStage::Rigid)?;
    Ok(Replica {
        case: *case,
        scale: own.scale,
        before: judged(
            &own.declared,
            &own.held_out,
            &Parameters::rigid(&own.declared),
            &Reading::default(),
        ),
        rigid,
        by_reading: readings.iter().map(by_stage).collect::<Result<_, _>>()?,
        by_rival: AlternativeModel::EACH.into_iter().map(rival).collect::<Result<_, _>>()?,
        geometry_only: fit(&own.identification, Strategy::GeometryOnly)?,
        joint: fit(&own.identification, Strategy::Joint)?,
        joint_twice: fit(&twice, Strategy::Joint)?,
    })
}
