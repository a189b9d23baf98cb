//! Jacobian of predicted positions with respect to the joint commands.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::command_term::TermSite;
use super::{Model, Pose, PoseResiduals};
use crate::least_squares::{Block, CHUNK_ITEMS, LeastSquares as _};
use crate::problem::Problem;

impl Model {
    /// Returns ∂p/∂q of predicted positions at the full parameter vector `x`, shape = (3, joints)
    /// for each pose, measuring frame \[m/rad\], for prismatic joints \[m/m\]. It is 0 at fixed
    /// joints and NaN without equilibrium.
    ///
    /// A command moves its joint, joints with terms that depend on it, and the displacements s of
    /// the instrument: ∂p/∂q = ∂p/∂θ (1 + ∂Δθ/∂q) + ∂s/∂q. Directions of approach are kept
    /// constant.
    pub(crate) fn command_jacobian(
        &self,
        problem: &Problem,
        poses: Vec<Pose>,
        x: &DVector<f64>,
    ) -> Vec<DMatrix<f64>> {
        let arm = self.with_free_commands(problem, x);
        let joints = arm.joints();
        let commanded = arm.moving_joints().len();
        let arm = arm.with_mimic_joints(problem);
        let moving = arm.moving_joints();
        let poses: Vec<Pose> = poses.into_iter().map(|pose| Pose { sigma: 1.0, ..pose }).collect();
        let count = poses.len();
        let unknowns: Vec<usize> = (0..moving.len()).collect();
        let residuals = PoseResiduals::new(&arm, poses, unknowns, DVector::zeros(moving.len()));
        let chunk = |first: usize| {
            let items = first..count.min(first + CHUNK_ITEMS);
            let mut block = Block::zeros(3 * items.len(), moving.len());
            residuals.linearise(&DVector::zeros(moving.len()), items.clone(), &mut block);
            let of_pose = |(k, pose): (usize, &Pose)| {
                let rows = 3 * k..3 * k + 3;
                let mut by_coordinate = DMatrix::zeros(3, joints);
                for (column, &joint) in moving.iter().enumerate() {
                    // The block contains derivatives of measured − predicted.
                    by_coordinate
                        .column_mut(joint)
                        .copy_from_slice(&block.column(column)[rows.clone()]);
                    by_coordinate.column_mut(joint).neg_mut();
                }
                // Without equilibrium, the residual is NaN and no derivatives are written.
                if block.column(moving.len())[rows].iter().any(|value| value.is_nan()) {
                    return DMatrix::from_element(3, joints, f64::NAN);
                }
                let mut jacobian = by_coordinate.clone();
                for term in &arm.fixed_terms {
                    // Strains of beams do not depend on commands.
                    let TermSite::Joint(joint_of_term) = term.site else { continue };
                    for &joint in &moving {
                        let slope = term.value * term.regressor.slope(&pose.setup, joint);
                        jacobian.column_mut(joint).axpy(
                            slope,
                            &by_coordinate.column(joint_of_term),
                            1.0,
                        );
                    }
                }
                for &joint in &moving {
                    let mut column = jacobian.column_mut(joint);
                    column += arm.instrument.command_slope(&pose.setup, joint);
                }
                // Mimic joints take no command.
                moving
                    .iter()
                    .skip(commanded)
                    .for_each(|&joint| jacobian.column_mut(joint).fill(0.0));
                jacobian
            };
            residuals.poses()[items].iter().enumerate().map(of_pose).collect::<Vec<_>>()
        };
        (0..count).into_par_iter().step_by(CHUNK_ITEMS).flat_map_iter(chunk).collect()
    }
}
