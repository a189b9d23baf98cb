//! Specimens of the arm of \[Chen2021\], measured on the virtual test rig.

use nalgebra::Vector3;

use super::alternative::stiffen;
use super::fit::{MeasuredPose, ReplicaError, identify_as_published, position_errors};
use super::study::{Case, MisprintStudy};
use crate::paper::{Form, Options, StiffnessStage};
use crate::problem::{PoseConditions, Problem};
use crate::rig::{Draw, NoEquilibrium, Rig, Row, draw};

/// Relative difference of the error that the rigid fit leaves from the wanted one, below which the
/// scale of the flexibility is found.
const SCALE_TOLERANCE: f64 = 1e-4;
/// Maximum number of flexibility scales that are tried until a rigid fit to a specimen leaves the
/// wanted error.
const MAX_SCALE_TRIES: usize = 40;

/// True arm with its simulated measurements.
#[derive(Debug, Clone)]
pub struct SimulatedArm {
    /// Declared arm with the mean flexibility of the specimens.
    pub declared: Problem,
    /// Declared arm with the true stiffness of this specimen.
    pub true_stiffness: Problem,
    /// Factor on the flexibilities that the problem declares; links have `links_over_joints` times
    /// this factor.
    pub scale: f64,
    /// Poses at which the procedures are compared.
    pub held_out: Vec<MeasuredPose>,
    /// Poses for identification, with the loads that the case states or draws.
    pub identification: Vec<MeasuredPose>,
    /// The identification poses, measured a second time under the second load.
    pub second_load: Vec<MeasuredPose>,
}

impl SimulatedArm {
    /// Draws the arm of a seed and scales its flexibility until the rigid fit leaves the error that
    /// the study states. Returns an error if no scale is found.
    pub fn find(study: &MisprintStudy, case: &Case, seed: u64) -> Result<Self, ReplicaError> {
        let mut scale = 1.0;
        for _ in 0..MAX_SCALE_TRIES {
            let Ok(specimen) = Self::at(study, case, scale, seed) else {
                // The arm is too flexible for an equilibrium.
                scale *= 0.5;
                continue;
            };
            let options = Options::new(Form::Corrected, StiffnessStage::Rigid);
            let (arm, poses) = (&specimen.declared, &specimen.identification);
            let parameters = identify_as_published(arm, poses, &options)?.parameters;
            let errors = position_errors(arm, &specimen.held_out, &parameters, &options.reading);
            let error = errors.mean.norm;
            if (error / study.rigid_leaves - 1.0).abs() < SCALE_TOLERANCE {
                return Ok(specimen);
            }
            // The error is nearly proportional to the flexibility.
            scale *= study.rigid_leaves / error;
        }
        Err(ReplicaError::Scale { leaves: study.rigid_leaves })
    }

    /// Simulates the specimen with a given flexibility scale.
    fn at(
        study: &MisprintStudy,
        case: &Case,
        scale: f64,
        seed: u64,
    ) -> Result<Self, NoEquilibrium> {
        let mut declared = study.problem.clone();
        stiffen(&mut declared, scale.recip(), (scale * case.links_over_joints).recip());
        let (held_out, identification) = (study.held_out, study.identification);
        // Held-out poses come first, so that they are the same for every number of others; the last
        // rows provide the noise under the second load.
        let Draw { arm, mut rows, .. } =
            draw(&declared, &study.truth, held_out + 2 * identification, seed);
        if let Some(load) = case.load {
            for row in &mut rows {
                row.conditions = load.put_on(&row.conditions);
            }
        }
        let rig =
            Rig::new(arm.clone(), study.truth.effects.clone()).with_segments(study.truth.segments);
        let pose = |conditions: &PoseConditions,
                    noise: &Vector3<f64>|
         -> Result<MeasuredPose, NoEquilibrium> {
            Ok(MeasuredPose {
                conditions: conditions.clone(),
                position: rig.position(conditions)? + noise,
            })
        };
        let measured = |rows: &[Row]| -> Result<Vec<MeasuredPose>, NoEquilibrium> {
            rows.iter().map(|row| pose(&row.conditions, &row.position)).collect()
        };
        let (held_out_rows, others) = rows.split_at(held_out);
        let (first, second) = others.split_at(identification);
        let second_load = first
            .iter()
            .zip(second)
            .map(|(row, noise)| pose(&study.second_load.put_on(&row.conditions), &noise.position));
        let second_load = second_load.collect::<Result<Vec<MeasuredPose>, NoEquilibrium>>()?;
        let (held_out, identification) = (measured(held_out_rows)?, measured(first)?);
        Ok(Self {
            true_stiffness: with_geometry(arm, &declared),
            declared,
            scale,
            held_out,
            identification,
            second_load,
        })
    }
}

/// Returns an arm with the geometry, tool and base of `source`.
fn with_geometry(mut arm: Problem, source: &Problem) -> Problem {
    for (joint, other) in arm.joints.iter_mut().zip(&source.joints) {
        (joint.alpha, joint.a, joint.theta) = (other.alpha, other.a, other.theta);
        (joint.d, joint.beta) = (other.d, other.beta);
    }
    (arm.tool, arm.base) = (source.tool.clone(), source.base.clone());
    arm
}
