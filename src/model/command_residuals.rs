//! Residuals of rows as a function of the joint commands.

use std::ops::Range;

use nalgebra::DVector;

use super::{Model, Pose, PoseResiduals};
use crate::least_squares::{Block, LeastSquares};
use crate::problem::Problem;

/// Residuals of rows as a function of corrections to the commanded configurations.
///
/// A mimic joint moves by ratio × the correction of its leader.
pub struct CommandResiduals<'a> {
    /// Residuals as a function of the corrections to all coordinates: the commands, then those of
    /// the mimic joints.
    joints: PoseResiduals<'a>,
    commands: usize,
    /// For each mimic joint, the index of its leader's command and the ratio of its motion to the
    /// leader's.
    followers: Vec<(usize, f64)>,
}

impl<'a> CommandResiduals<'a> {
    /// Creates the residuals of `arm` with `commands` commands. Its parameters are those of
    /// [`Model::with_free_commands`], followed by those of [`Model::with_mimic_joints`].
    pub fn new(problem: &Problem, arm: &'a Model, commands: usize, poses: Vec<Pose<'a>>) -> Self {
        let moving = arm.moving_joints();
        let follower = |joint: &usize| {
            let mimic = problem.joints[*joint].mimic?;
            Some((moving.iter().position(|&joint| joint == mimic.joint)?, mimic.ratio))
        };
        let followers = moving.iter().skip(commands).filter_map(follower).collect();
        let unknowns = (0..moving.len()).collect();
        let joints = PoseResiduals::new(arm, poses, unknowns, DVector::zeros(moving.len()));
        Self { joints, commands, followers }
    }

    /// Returns the corrections to all coordinates for corrections `x` to the commands \[rad\] or
    /// \[m\]; those of mimic joints follow their leaders.
    fn all_corrections(&self, x: &DVector<f64>) -> DVector<f64> {
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
        self.joints.residuals(&self.all_corrections(x), items, out);
    }

    fn linearise(&self, x: &DVector<f64>, items: Range<usize>, block: &mut Block) {
        let count = self.commands + self.followers.len();
        let mut full = Block::zeros(block.rows(), count);
        self.joints.linearise(&self.all_corrections(x), items, &mut full);
        for column in 0..self.commands {
            block.column_mut(column).copy_from_slice(full.column(column));
        }
        for (&(leader, ratio), column) in self.followers.iter().zip(self.commands..) {
            for (out, derivative) in block.column_mut(leader).iter_mut().zip(full.column(column)) {
                *out += ratio * derivative;
            }
        }
        block.column_mut(self.commands).copy_from_slice(full.column(count));
    }
}
