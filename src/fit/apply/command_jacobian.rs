//! Derivatives of predicted positions with respect to the joint commands, for planners and
//! controllers.

use nalgebra::{DMatrix, DVector};

use crate::fit::{Identification, IdentifyError, Placement};
use crate::measurement::Measurements;
use crate::model::Model;
use crate::problem::Problem;

/// Returns the derivatives of the predicted positions of `rows` with respect to the joint commands:
/// one matrix per row, shape = (3, joints), measuring frame \[m/rad\], for prismatic joints
/// \[m/m\].
///
/// Columns of fixed joints are 0; matrices of rows without an equilibrium are NaN. The arm is the
/// `identified` one, with its sessions and targets, or the nominal one if that is `None`. `problem`
/// is the one that was identified. The positions in `rows` are not used.
///
/// # Errors
/// Returns an error if a parameter of the problem, or of a session or target of `rows`, was not
/// identified, if the problem lacks an identified parameter, or if the number of joints differs.
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
    let all_rows: Vec<usize> = (0..rows.len()).collect();
    let mut poses = placement.poses(rows, &all_rows, 1.0);
    let mut x = DVector::zeros(model.parameters.len());
    if let Some(identified) = identified {
        x = identified.vector(&model)?;
        placement.count_time_from(&identified.start_times, &mut poses);
    }
    Ok(model.command_jacobian(problem, poses, &x))
}
