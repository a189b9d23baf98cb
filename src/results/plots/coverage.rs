//! Coverage of the workspace by fitted poses.

use nalgebra::Vector3;

use super::arm::{Arm, Poses};
use crate::model::Pose;
use crate::numeric::range;
use crate::problem::{JointKind, Problem};

/// Number of configurations at which coverage is tested.
const TESTED_CONFIGURATIONS: u32 = 800;
/// Largest distance to a fitted pose at which a position counts as covered, as a fraction of the
/// workspace diagonal.
const COVERED_DISTANCE: f64 = 0.1;
/// Bases of the van der Corput sequences, one for each joint; an eleventh joint takes the first
/// base again.
const PRIMES: [u32; 10] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29];

/// Coverage of the workspace by fitted poses.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Coverage {
    /// Reachable positions without a fitted pose within the distance `near`, measuring frame of the
    /// first fitted row's session \[m\].
    pub uncovered: Vec<Vector3<f64>>,
    /// Number of tested positions, covered or not.
    pub tried: usize,
    /// Largest distance to a fitted pose at which a position counts as covered \[m\].
    pub near: f64,
}

/// Returns the radical inverse of k: its digits in `base`, mirrored at the radix point. For k = 1,
/// 2, … the values fill 0…1 uniformly (van der Corput sequence).
fn radical_inverse(mut k: u32, base: u32) -> f64 {
    let (mut sum, mut part) = (0.0, 1.0);
    while k > 0 {
        part /= f64::from(base);
        sum += part * f64::from(k % base);
        k /= base;
    }
    sum
}

/// Computes the coverage by positions at quasi-random configurations within the joint limits. A
/// joint without limits takes values within its measured range.
pub fn of(problem: &Problem, poses: &Poses, arm: &Arm) -> Coverage {
    let all_poses = poses.all(1.0);
    let fitted = poses.split.identification.iter().filter_map(|&row| all_poses.get(row));
    let fitted: Vec<Pose> = fitted.filter(|pose| pose.observation.is_of_arm()).copied().collect();
    let Some(first) = fitted.first() else { return Coverage::default() };
    let ends = |(index, joint): (usize, &crate::problem::Joint)| {
        let measured = range(fitted.iter().map(|pose| pose.setup.configuration[index]));
        match joint.command_kind() {
            JointKind::Fixed => (0.0, 0.0),
            _ if joint.limits.0.is_finite() && joint.limits.1.is_finite() => joint.limits,
            _ => measured,
        }
    };
    let ends: Vec<(f64, f64)> = problem.joints.iter().enumerate().map(ends).collect();
    let configuration = |k: u32| -> Vec<f64> {
        let value = |((low, high), base): (&(f64, f64), &u32)| {
            low + (high - low) * radical_inverse(k, *base)
        };
        ends.iter().zip(PRIMES.iter().cycle()).map(value).collect()
    };
    let configurations: Vec<Vec<f64>> = (1..=TESTED_CONFIGURATIONS).map(configuration).collect();
    let tried: Vec<Pose> = configurations
        .iter()
        .map(|configuration| {
            let mut pose = *first;
            pose.setup.configuration = configuration;
            pose
        })
        .collect();
    let positions = arm.model.geometric_positions(&tried, arm.x.as_slice());
    let near = COVERED_DISTANCE
        * (0..3)
            .map(|axis| range(positions.iter().map(|at| at[axis])))
            .map(|(a, b)| (b - a).powi(2))
            .sum::<f64>()
            .sqrt();
    // Sessions may have different measuring frames; all positions are moved into the first one.
    let bases = arm.model.base_frames(arm.x.as_slice());
    let in_first_frame = |(pose, at): (&Pose, Vector3<f64>)| {
        let base = &bases[pose.base];
        bases[first.base].point(&base.resolve(&(at - base.origin)))
    };
    let fitted: Vec<Vector3<f64>> =
        fitted.iter().zip(Poses::positions(arm, &fitted)).map(in_first_frame).collect();
    let is_covered =
        |at: &Vector3<f64>| fitted.iter().any(|pose| (pose - at).norm_squared() <= near * near);
    let uncovered: Vec<Vector3<f64>> =
        positions.iter().filter(|at| !is_covered(at)).copied().collect();
    Coverage { uncovered, tried: positions.len(), near }
}
