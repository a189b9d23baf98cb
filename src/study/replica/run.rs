//! Identification of every specimen by every procedure, and the displacement of the end point that
//! each misprint causes.

use nalgebra::DVector;

use super::alternative::AlternativeModel;
use super::fit::{MeasuredPose, ReplicaError, dataset, identify_as_published, position_errors};
use super::reading::{NamedReading, readings};
use super::results::{HeldOutError, Replica, ReplicaResults};
use super::simulated_arm::SimulatedArm;
use super::study::{Case, MisprintStudy};
use crate::fit::{ErrorSummary, Options as FitOptions, Strategy, identify};
use crate::numeric::parallel;
use crate::paper::{EndPoint, Form, Misprint, Options, Parameters, Reading, StiffnessStage};
use crate::problem::Problem;
use crate::random::stream;
use crate::rig::{Draw, draw};

/// Draws every specimen and identifies it by every procedure; calls `done` after each specimen,
/// from several threads.
///
/// # Errors
/// Returns an error if a specimen cannot be scaled or a procedure cannot be set up.
pub fn replicate(
    study: &MisprintStudy,
    done: impl Fn() + Sync,
) -> Result<ReplicaResults, ReplicaError> {
    let readings = readings();
    let of_case = |case| (0..study.specimens).map(move |index| (case, index));
    let specimens: Vec<(&Case, usize)> = study.cases.iter().flat_map(of_case).collect();
    let evaluate = |&(case, index): &(&Case, usize)| {
        let replica = replica(study, &readings, case, index);
        done();
        replica
    };
    let replicas: Result<Vec<Replica>, ReplicaError> =
        parallel::map_items(&specimens, evaluate).into_iter().collect();
    let replicas = replicas?;
    Ok(ReplicaResults { sizes: sizes(study), readings, replicas })
}

/// Draws one specimen and returns its errors by every procedure.
fn replica(
    study: &MisprintStudy,
    readings: &[NamedReading],
    case: &Case,
    index: usize,
) -> Result<Replica, ReplicaError> {
    use rand::Rng as _;
    let seed = stream(study.seed, index as u64).next_u64();
    let arm = SimulatedArm::find(study, case, seed)?;
    let both_loads = [arm.identification.as_slice(), arm.second_load.as_slice()].concat();
    let error = |problem: &Problem,
                 poses: &[MeasuredPose],
                 reading: &Reading,
                 stage|
     -> Result<HeldOutError, ReplicaError> {
        let options = Options::new(*reading, stage);
        let identified = identify_as_published(problem, poses, &options)?;
        let errors =
            || position_errors(problem, &arm.held_out, &identified.parameters, &options.reading);
        Ok(identified.iteration.termination.converged().then(errors))
    };
    let by_stage = |named: &NamedReading| -> Result<[HeldOutError; 4], ReplicaError> {
        let (reading, single) = (&named.reading, arm.identification.as_slice());
        Ok([
            error(&arm.true_stiffness, single, reading, StiffnessStage::Nominal)?,
            error(&arm.declared, single, reading, StiffnessStage::Nominal)?,
            error(&arm.declared, single, reading, StiffnessStage::Positions)?,
            error(&arm.declared, &both_loads, reading, StiffnessStage::LoadDifferences)?,
        ])
    };
    let alternative = |model: AlternativeModel| -> Result<HeldOutError, ReplicaError> {
        let assumed = model.assumed(arm.true_stiffness.clone());
        let under_assumed_loads = |poses: &[MeasuredPose]| -> Vec<MeasuredPose> {
            poses.iter().map(|pose| pose.with_scaled_loads(model.loads(), &assumed)).collect()
        };
        let options = Options::new(Form::Corrected, StiffnessStage::Nominal);
        let poses = under_assumed_loads(&arm.identification);
        let identified = identify_as_published(&assumed, &poses, &options)?;
        let errors = || {
            let held_out = under_assumed_loads(&arm.held_out);
            position_errors(&assumed, &held_out, &identified.parameters, &options.reading)
        };
        Ok(identified.iteration.termination.converged().then(errors))
    };
    let fit = |poses: &[MeasuredPose], strategy| -> Result<ErrorSummary, ReplicaError> {
        let (data, mut problem) = (dataset(poses, &arm.held_out)?, arm.declared.clone());
        problem.data.position_sigma = Some(study.truth.noise_sigma);
        let options = FitOptions::default().with_strategy(strategy);
        Ok(identify(&problem, &data, &options)?.fitted.held_out)
    };
    let rigid =
        error(&arm.declared, &arm.identification, &Reading::default(), StiffnessStage::Rigid)?;
    Ok(Replica {
        case: *case,
        scale: arm.scale,
        before: position_errors(
            &arm.declared,
            &arm.held_out,
            &Parameters::rigid(&arm.declared),
            &Reading::default(),
        ),
        rigid,
        by_reading: readings.iter().map(by_stage).collect::<Result<_, _>>()?,
        by_alternative: AlternativeModel::EACH
            .into_iter()
            .map(alternative)
            .collect::<Result<_, _>>()?,
        geometry_only: fit(&arm.identification, Strategy::GeometryOnly)?,
        joint: fit(&arm.identification, Strategy::Joint)?,
        joint_twice: fit(&both_loads, Strategy::Joint)?,
    })
}

/// Returns the largest displacement \[m\] by each misprint, in the order of [`Misprint::EACH`]: the
/// change of the deflection `D_f`, or of the geometric error `D_g` = `J_g` e, whichever is larger.
///
/// The maximum is over the poses of one drawn arm with its declared elasticity and the geometric
/// errors e. For `BetaLeftOut` it is the displacement by the errors β in e.
pub fn sizes(study: &MisprintStudy) -> Vec<f64> {
    let (problem, poses) = (&study.problem, study.held_out + study.identification);
    let Draw { arm, rows, .. } = draw(problem, &study.truth, poses, study.seed);
    let nominal = Parameters::nominal(problem);
    let true_geometry =
        Parameters { geometry: Parameters::nominal(&arm).geometry, ..nominal.clone() };
    let pairs = nominal.geometry.iter().zip(&true_geometry.geometry);
    let e: Vec<f64> = pairs
        .flat_map(|(from, to)| {
            let (mut from, mut to) = (*from, *to);
            let changes =
                from.fields_mut().into_iter().zip(to.fields_mut()).map(|(from, to)| *to - *from);
            changes.collect::<Vec<f64>>()
        })
        .collect();
    let beta = e.iter().enumerate().map(|(index, e)| if index % 5 == 4 { *e } else { 0.0 });
    let (beta, e) = (DVector::from_iterator(e.len(), beta), DVector::from_vec(e.clone()));
    let size = |misprint: Misprint| {
        let of_row = |row: &crate::rig::Row| {
            let view = row.conditions.view();
            let end_point = |parameters: &Parameters, reading: Reading| {
                EndPoint::new(problem, parameters, &view, &reading)
            };
            let (corrected, printed) = (Reading::default(), Reading::from(misprint));
            if misprint == Misprint::BetaLeftOut {
                return (end_point(&nominal, corrected).jacobian() * &beta).norm();
            }
            let elastic = end_point(&true_geometry, printed).deflection(&true_geometry)
                - end_point(&true_geometry, corrected).deflection(&true_geometry);
            let geometric = end_point(&nominal, printed).jacobian() * &e
                - end_point(&nominal, corrected).jacobian() * &e;
            elastic.norm().max(geometric.norm())
        };
        rows.iter().map(of_row).fold(0.0, f64::max)
    };
    Misprint::EACH.into_iter().map(size).collect()
}
