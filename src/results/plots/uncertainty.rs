//! Error bounds of predictions over the workspace, and the joint errors that a remainder corrects.

use nalgebra::Vector3;
use rand::RngExt as _;

use crate::fit::{Identification, IdentifyError};
use crate::measurement::Dataset;
use crate::problem::Problem;
use crate::random::stream;
use crate::remainder::{BoundTest, Bounds, Fitted, JointError, Outcome, predict_identified};

/// Number of random configurations whose error bounds are drawn.
const DRAWN_CONFIGURATIONS: usize = 1500;
/// Probability with which an error bound holds.
const BOUND_LEVEL: f64 = 0.95;
/// Number of values of the command at which the error of a joint is drawn.
const DRAWN_COMMANDS: usize = 120;
/// Seed of the random configurations.
const SEED: u64 = 0x0062_6f75_6e64;

/// Uncertainty of predictions over the workspace.
#[derive(Debug, Clone, PartialEq)]
pub struct Uncertainty {
    /// Outcome of the search for a remainder.
    pub outcome: Outcome,
    /// Probability with which an error bound holds.
    pub level: f64,
    /// Error bounds at random configurations in the workspace.
    pub bounds: Vec<BoundAt>,
    /// Errors of the joints that a remainder corrects; empty without a remainder.
    pub joints: Vec<JointError>,
    /// Comparison of the bounds with the errors of held-out configurations; `None` if none is held
    /// out.
    pub test: Option<BoundTest>,
}

/// Error bound of a predicted position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoundAt {
    /// Predicted position, frame of the arm's base \[m\].
    pub position: Vector3<f64>,
    /// Upper bound of the error length ‖measured − predicted‖ \[m\].
    pub bound: f64,
    /// Length of the remainder's correction of the position \[m\]; 0 without a remainder.
    pub correction: f64,
    /// True if the pose lies outside the measured range, or too far from measured poses to apply
    /// half of the correction.
    pub is_extrapolated: bool,
}

impl Uncertainty {
    /// Computes error bounds at random configurations. Every joint takes a value between two
    /// neighbours among its measured values in ascending order, independently of the other joints.
    pub(super) fn of(
        (found, problem): (&Identification, &Problem),
        data: &Dataset,
        fitted: &Fitted,
    ) -> Result<Self, IdentifyError> {
        let table = &data.measurements;
        let mut rng = stream(SEED, 0);
        let is_position = |row: &&usize| table.observation(**row).is_of_position();
        let measured: Vec<usize> =
            data.split.identification.iter().filter(is_position).copied().collect();
        let values: Vec<Vec<f64>> = (0..table.joints)
            .map(|joint| {
                let of_joint = measured.iter().map(|&row| table.configuration(row)[joint]);
                let mut of_joint: Vec<f64> = of_joint.collect();
                of_joint.sort_by(f64::total_cmp);
                of_joint
            })
            .collect();
        if measured.is_empty() {
            return Ok(Self {
                outcome: fitted.outcome(),
                level: BOUND_LEVEL,
                bounds: Vec::new(),
                joints: Vec::new(),
                test: None,
            });
        }
        // Sessions may have different measuring frames, so all poses are taken from the first
        // session.
        let first = table.session.of_row[measured[0]];
        let of_session: Vec<usize> =
            measured.iter().copied().filter(|&row| table.session.of_row[row] == first).collect();
        let drawn: Vec<usize> = (0..DRAWN_CONFIGURATIONS)
            .map(|_| of_session[rng.random_range(0..of_session.len())])
            .collect();
        let mut rows = table.select(&drawn);
        let n = rows.joints;
        for configuration in rows.configurations.chunks_mut(n) {
            for (command, of_joint) in configuration.iter_mut().zip(&values) {
                let low = rng.random_range(0..of_joint.len());
                let high = (low + 1).min(of_joint.len() - 1);
                let part: f64 = rng.random();
                *command = of_joint[low] + part * (of_joint[high] - of_joint[low]);
            }
        }
        let correction = fitted.correction();
        let (positions, corrected) = predict_identified(found, problem, correction, &rows)?;
        let bases = found.base_frames(problem, &rows)?;
        let bounds = Bounds::new(correction, corrected, BOUND_LEVEL);
        let at = |(pose, position): (usize, &Vector3<f64>)| {
            let base = &bases[rows.session.of_row[pose]];
            BoundAt {
                position: base.resolve(&(position - base.origin)),
                bound: bounds.bound(pose),
                correction: bounds.poses[pose].shift.norm(),
                is_extrapolated: bounds.poses[pose].is_extrapolated,
            }
        };
        let bounds = positions.iter().enumerate().map(at);
        Ok(Self {
            outcome: fitted.outcome(),
            level: BOUND_LEVEL,
            bounds: bounds.filter(|at| at.bound.is_finite()).collect(),
            joints: correction.joint_errors(DRAWN_COMMANDS),
            test: fitted.held_out_test,
        })
    }
}
