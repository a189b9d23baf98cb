//! Residuals of poses as functions of the joint commands.

use std::ops::Range;

use nalgebra::DVector;

use super::{Model, Pose, PoseResiduals};
use crate::least_squares::{Block, LeastSquares};
use crate::problem::Problem;

/// Residuals of poses over corrections to the commands of an arm, from the configurations of the
/// poses.
///
/// A joint that follows another moves by ratio × the correction of its leader.
pub struct CommandResiduals<'a> {
    /// Over the commands, then over the coordinates of followers.
    joints: PoseResiduals<'a>,
    commands: usize,
    /// Column of its leader and ratio of every follower.
    followers: Vec<(usize, f64)>,
}

impl<'a> CommandResiduals<'a> {
    /// Of `arm` with `commands` commands, whose parameters are those of [`Model::with_free_commands`] and
    /// then those of [`Model::with_mimic_joints`].
    pub fn new(problem: &Problem, arm: &'a Model, commands: usize, poses: Vec<Pose<'a>>) -> Self {
        let moving = arm.moving_joints();
        let follower = |joint: &usize| {
            let mimic = problem.joints[*joint].mimic?;
            Some((moving.iter().position(|&own| own == mimic.joint)?, mimic.ratio))
        };
        let followers = moving.iter().skip(commands).filter_map(follower).collect();
        let unknowns = (0..moving.len()).collect();
        let joints = PoseResiduals::new(arm, poses, unknowns, DVector::zeros(moving.len()));
        Self { joints, commands, followers }
    }

    /// Corrections to all coordinates, of followers as well.
    fn all(&self, x: &DVector<f64>) -> DVector<f64> {
        let followers = self.followers.iter().map(|&(leader, ratio)| ratio * x[leader]);
        DVector::from_iterator(
            self.commands + self.followers.len(),
            x.iter().copied().chain(followers),
        )
    }
}

impl LeastSquares for CommandResiduals<'_> {
    fn parameters(&self) -> usize {
        self.commands
    }

    fn items(&self) -> usize {
        self.joints.items()
    }

    fn rows_per_item(&self) -> usize {
        self.joints.rows_per_item()
    }

    fn residuals(&self, x: &DVector<f64>, items: Range<usize>, out: &mut [f64]) {
        self.joints.residuals(&self.all(x), items, out);
    }

    fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block) {
        let count = self.commands + self.followers.len();
        let mut all = Block::zeros(block.rows(), count);
        self.joints.linearise(&self.all(x), items, &mut all);
        for column in 0..self.commands {
            block.column_mut(column).copy_from_slice(all.column(column));
        }
        for (&(leader, ratio), column) in self.followers.iter().zip(self.commands..) {
            for (out, own) in block.column_mut(leader).iter_mut().zip(all.column(column)) {
                *out += ratio * own;
            }
        }
        block.column_mut(self.commands).copy_from_slice(all.column(count));
    }
}
