//! Where an arm reaches and no fitted pose is near.

use nalgebra::Vector3;

use super::arm::{Arm, Poses};
use super::frame::range;
use crate::model::Pose;
use crate::problem::{JointKind, Problem};

/// Configurations that are tried.
const TRIED: u32 = 800;
/// What lies within this part of the reach of a fitted pose is covered.
const NEAR: f64 = 0.1;
/// A base for each joint in turn.
const PRIMES: [u32; 10] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29];

/// The workspace and what of it was measured.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Coverage {
    /// Positions that the arm reaches, with no fitted pose near, measuring frame of the first
    /// session \[m\].
    pub uncovered: Vec<Vector3<f64>>,
    /// Positions that were tried.
    pub tried: usize,
    /// How near a fitted pose covers a position \[m\].
    pub near: f64,
}

/// Radical inverse of k: its digits behind the point, so that k = 1, 2, … fill 0…1 evenly (van der
/// Corput).
fn inverse(mut k: u32, base: u32) -> f64 {
    let (mut sum, mut part) = (0.0, 1.0);
    while k > 0 {
        part /= f64::from(base);
        sum += part * f64::from(k % base);
        k /= base;
    }
    sum
}

/// Over configurations within the limits of the joints, or where one has none within its measured
/// range.
pub fn of(problem: &Problem, poses: &Poses, arm: &Arm) -> Coverage {
    let all = poses.all(1.0);
    let of_arm = poses.split.identification.iter().filter_map(|&row| all.get(row));
    let fitted: Vec<Pose> = of_arm.filter(|pose| pose.observation.is_of_arm()).copied().collect();
    let Some(first) = fitted.first() else { return Coverage::default() };
    let ends = |(joint, own): (usize, &crate::problem::Joint)| {
        let measured = range(fitted.iter().map(|pose| pose.setup.configuration[joint]));
        match own.command_kind() {
            JointKind::Fixed => (0.0, 0.0),
            _ if own.limits.0.is_finite() && own.limits.1.is_finite() => own.limits,
            _ => measured,
        }
    };
    let ends: Vec<(f64, f64)> = problem.joints.iter().enumerate().map(ends).collect();
    let configuration = |k: u32| -> Vec<f64> {
        let value =
            |((low, high), base): (&(f64, f64), &u32)| low + (high - low) * inverse(k, *base);
        ends.iter().zip(PRIMES.iter().cycle()).map(value).collect()
    };
    let configurations: Vec<Vec<f64>> = (1..=TRIED).map(configuration).collect();
    let tried: Vec<Pose> = configurations
        .iter()
        .map(|own| {
            let mut pose = *first;
            pose.setup.configuration = own;
            pose
        })
        .collect();
    let positions = arm.model.geometric_positions(&tried, arm.x.as_slice());
    let near = NEAR
        * (0..3)
            .map(|axis| range(positions.iter().map(|at| at[axis])))
            .map(|(a, b)| (b - a).powi(2))
            .sum::<f64>()
            .sqrt();
    // Sessions have measuring frames of their own.
    let bases = arm.model.base_frames(arm.x.as_slice());
    let there = |(pose, at): (&Pose, Vector3<f64>)| {
        let own = &bases[pose.base];
        bases[first.base].point(&own.resolve(&(at - own.origin)))
    };
    let fitted: Vec<Vector3<f64>> =
        fitted.iter().zip(Poses::places(arm, &fitted)).map(there).collect();
    let covered =
        |at: &Vector3<f64>| fitted.iter().any(|own| (own - at).norm_squared() <= near * near);
    let uncovered: Vec<Vector3<f64>> =
        positions.iter().filter(|at| !covered(at)).copied().collect();
    Coverage { uncovered, tried: positions.len(), near }
}
