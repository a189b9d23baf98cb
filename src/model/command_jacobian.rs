//! How predicted positions move with the joint commands.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::driven::Place;
use super::{Model, Pose, PoseResiduals};
use crate::least_squares::{Block, CHUNK_ITEMS, LeastSquares as _};
use crate::problem::Problem;

impl Model {
    /// ∂p/∂q of predicted positions at the full parameter vector `x`, for each pose of shape = (3,
    /// joints), measuring frame \[m/rad\], of joints that slide \[m/m\]; 0 at fixed joints, NaN
    /// where a pose has no equilibrium.
    ///
    /// A command moves its own joint, what is driven by it in other joints, and what the instrument
    /// adds by it: ∂p/∂q = ∂p/∂θ (1 + ∂Δθ/∂q) + ∂s/∂q. The side from which a joint comes stays.
    pub fn command_jacobian(
        &self,
        problem: &Problem,
        poses: Vec<Pose>,
        x: &DVector<f64>,
    ) -> Vec<DMatrix<f64>> {
        let arm = self.with_free_commands(problem, x);
        let joints = arm.joints();
        let own = arm.moving_joints().len();
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
            let one = |(k, pose): (usize, &Pose)| {
                let rows = 3 * k..3 * k + 3;
                let mut turned = DMatrix::zeros(3, joints);
                for (column, &joint) in moving.iter().enumerate() {
                    // The block holds derivatives of measured − predicted.
                    turned.column_mut(joint).copy_from_slice(&block.column(column)[rows.clone()]);
                    turned.column_mut(joint).neg_mut();
                }
                // No equilibrium: the residual itself is no number, and its derivatives are not
                // written.
                if block.column(moving.len())[rows].iter().any(|value| value.is_nan()) {
                    return DMatrix::from_element(3, joints, f64::NAN);
                }
                let mut jacobian = turned.clone();
                for driven in &arm.driven {
                    // No command drives the strain of a beam.
                    let Place::Joint(follows) = driven.place else { continue };
                    for &joint in &moving {
                        let slope = driven.value * driven.regressor.slope(&pose.setup, joint);
                        jacobian.column_mut(joint).axpy(slope, &turned.column(follows), 1.0);
                    }
                }
                for &joint in &moving {
                    let mut own = jacobian.column_mut(joint);
                    own += arm.instrument.command_slope(&pose.setup, joint);
                }
                // Who follows another takes no command.
                moving.iter().skip(own).for_each(|&joint| jacobian.column_mut(joint).fill(0.0));
                jacobian
            };
            residuals.poses()[items].iter().enumerate().map(one).collect::<Vec<_>>()
        };
        (0..count).into_par_iter().step_by(CHUNK_ITEMS).flat_map_iter(chunk).collect()
    }
}
