//! How the end point moves with the joint commands, for planners and controllers that use the arm
//! as identified.

use nalgebra::{DMatrix, DVector};

use crate::fit::{Identification, IdentifyError, Placement};
use crate::measurement::Measurements;
use crate::model::Model;
use crate::problem::Problem;

/// Derivatives of the predicted positions of `rows` by the commands, for each row of shape = (3,
/// joints), measuring frame \[m/rad\], of joints that slide \[m/m\]; 0 at fixed joints, NaN where
/// the arm has no equilibrium.
///
/// Of the arm as `identified`, with its sessions and targets, or else of the nominal arm. `problem`
/// is the one that was identified. The positions in `rows` do not matter.
///
/// # Errors
/// A parameter of the problem, or of a session or target of `rows`, that was not identified, or one
/// that was and that the problem lacks; configurations of another number of joints.
pub fn jacobian(
    problem: &Problem,
    identified: Option<&Identification>,
    rows: &Measurements,
) -> Result<Vec<DMatrix<f64>>, IdentifyError> {
    let (found, joints) = (rows.joints, problem.joints.len());
    if found != joints {
        return Err(IdentifyError::JointCount { found, joints });
    }
    let placement = Placement::of(rows);
    let declared = Model::new(problem, &placement.bases, &placement.targets)?;
    let model =
        identified.map_or(declared.clone(), |identified| identified.strategy.model(declared));
    let all: Vec<usize> = (0..rows.len()).collect();
    let mut poses = placement.poses(rows, &all, 1.0);
    let mut x = DVector::zeros(model.parameters.len());
    if let Some(identified) = identified {
        x = identified.vector(&model)?;
        for pose in &mut poses {
            pose.setup.elapsed = pose.setup.time - identified.first_time;
        }
    }
    Ok(model.command_jacobian(problem, poses, &x))
}
