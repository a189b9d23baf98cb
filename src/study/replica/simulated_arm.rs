//! Specimens of the arm, measured on the virtual test rig.

use nalgebra::Vector3;

use super::alternative::stiffen;
use super::fit::{ReplicaError, fitted, judged};
use super::measured_pose::MeasuredPose;
use super::study::{Case, MisprintStudy};
use crate::paper::{Form, Options, StiffnessStage};
use crate::problem::{PoseConditions, Problem};
use crate::rig::{Draw, NoRest, Rig, Row, draw};

/// The rigid fit leaves what it should to this part.
const SCALED: f64 = 1e-4;
/// Trials of a scale after which a specimen is given up.
const TRIALS: usize = 40;

/// One arm and its measurements.
#[derive(Debug, Clone)]
pub struct SimulatedArm {
    /// The arm as declared, as elastic as specimens are on average.
    pub declared: Problem,
    /// The same with the true stiffness of this one.
    pub known: Problem,
    /// By what the declared flexibilities were multiplied, those of links by `links_over_joints`
    /// more.
    pub scale: f64,
    /// Poses that judge.
    pub held_out: Vec<MeasuredPose>,
    /// Poses to identify with.
    pub identification: Vec<MeasuredPose>,
    /// The same under the second load.
    pub again: Vec<MeasuredPose>,
}

impl SimulatedArm {
    /// Arm of a seed, its flexibility scaled until the rigid fit leaves what the study says.
    pub fn find(study: &MisprintStudy, case: &Case, seed: u64) -> Result<Self, ReplicaError> {
        let mut scale = 1.0;
        for _ in 0..TRIALS {
            let Ok(specimen) = Self::at(study, case, scale, seed) else {
                // Too soft to stand.
                scale *= 0.5;
                continue;
            };
            let options = Options::new(Form::Corrected, StiffnessStage::Rigid);
            let found = fitted(&specimen.declared, &specimen.identification, &options)?;
            let left =
                judged(&specimen.declared, &specimen.held_out, &found.parameters, &options.reading)
                    .mean
                    .norm;
            if (left / study.rigid_leaves - 1.0).abs() < SCALED {
                return Ok(specimen);
            }
            // What it leaves is nearly proportional to the flexibility.
            scale *= study.rigid_leaves / left;
        }
        Err(ReplicaError::Scale { leaves: study.rigid_leaves })
    }

    fn at(study: &MisprintStudy, case: &Case, scale: f64, seed: u64) -> Result<Self, NoRest> {
        let mut declared = study.problem.clone();
        stiffen(&mut declared, scale.recip(), (scale * case.links_over_joints).recip());
        let (held_out, identification) = (study.held_out, study.identification);
        // Held-out poses first, so that they are the same for every number of the others; the noise
        // of the second load last.
        let Draw { arm, mut rows, .. } =
            draw(&declared, &study.truth, held_out + 2 * identification, seed);
        if let Some(load) = case.load {
            for row in &mut rows {
                row.conditions = load.put_on(&row.conditions);
            }
        }
        let rig =
            Rig::new(arm.clone(), study.truth.effects.clone()).with_segments(study.truth.segments);
        let pose =
            |conditions: &PoseConditions, noise: &Vector3<f64>| -> Result<MeasuredPose, NoRest> {
                Ok(MeasuredPose {
                    conditions: conditions.clone(),
                    position: rig.position(conditions)? + noise,
                })
            };
        let taken = |rows: &[Row]| -> Result<Vec<MeasuredPose>, NoRest> {
            rows.iter().map(|row| pose(&row.conditions, &row.position)).collect()
        };
        let (judging, others) = rows.split_at(held_out);
        let (first, second) = others.split_at(identification);
        let again = first
            .iter()
            .zip(second)
            .map(|(row, noise)| pose(&study.second_load.put_on(&row.conditions), &noise.position));
        let again = again.collect::<Result<Vec<MeasuredPose>, NoRest>>()?;
        let (held_out, identification) = (taken(judging)?, taken(first)?);
        Ok(Self {
            known: with_geometry(arm, &declared),
            declared,
            scale,
            held_out,
            identification,
            again,
        })
    }
}

/// An arm with the geometry, tool and base of another.
fn with_geometry(mut arm: Problem, of: &Problem) -> Problem {
    for (own, other) in arm.joints.iter_mut().zip(&of.joints) {
        (own.alpha, own.a, own.theta) = (other.alpha, other.a, other.theta);
        (own.d, own.beta) = (other.d, other.beta);
    }
    (arm.tool, arm.base) = (of.tool.clone(), of.base.clone());
    arm
}
