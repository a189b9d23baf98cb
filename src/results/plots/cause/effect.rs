//! Figure data of an effect from the fit that declares it.

use nalgebra::Vector3;

use super::figure::{Cause, Point, is_prismatic};
use super::terms::EffectRows;
use super::view::{at_joint, beyond_joints, change_along};
use crate::model::parameter::{EffectParameter, JointField, ParameterSite, value_regressor};
use crate::numeric::range;
use crate::problem::{Effect, Problem};
use crate::results::plots::arm::{Arm, MIN_LEVER, Poses};

/// Number of straight segments of the drawn curve of a law.
const CURVE_STEPS: u32 = 160;

/// Fit of a model that declares the effects, with its residual and levers in every row.
#[derive(Clone, Copy)]
pub struct EffectFit<'a> {
    /// Arm of the fit.
    pub arm: &'a Arm,
    /// Residual measured − predicted of each row, measuring frame \[m\].
    pub residuals: &'a [Vector3<f64>],
    /// Levers of the joint coordinates, shape = (joints, rows) \[m/rad\] or \[m/m\].
    pub levers: &'a [Vec<Vector3<f64>>],
}

/// Returns the parameter site of every joint's coordinate: d of a prismatic joint, θ of other
/// joints.
pub fn coordinates(problem: &Problem) -> Vec<ParameterSite> {
    let field =
        |joint: usize| if is_prismatic(problem, joint) { JointField::D } else { JointField::Theta };
    (1..=problem.joints.len())
        .map(|joint| ParameterSite::Joint { joint: joint - 1, field: field(joint) })
        .collect()
}

/// Computes the figure data of an effect from the fit of `problem`, which declares the effect.
/// `None` if a parameter of the effect is not free.
pub fn of(
    effect: &Effect,
    problem: &Problem,
    EffectFit { arm, residuals, levers }: EffectFit,
    poses: &Poses,
) -> Option<Cause> {
    let parameters = effect.parameters(problem);
    let index = |parameter: &EffectParameter| {
        arm.model.parameters.iter().position(|free| free.name == parameter.name)
    };
    let indices: Vec<usize> = parameters.iter().map(index).collect::<Option<_>>()?;
    let mut without = arm.clone();
    for &k in &indices {
        without.x[k] = 0.0;
    }
    let partial = poses.errors(&without, &poses.row_indices());
    let all_poses = poses.all(1.0);
    let free = arm.model.parameters_at(arm.x.as_slice());
    let term = |&k: &usize| {
        let regressor = value_regressor(&free, arm.x.as_slice(), k)?;
        Some(((regressor, arm.x[k]), arm.model.parameters[k].site))
    };
    let (terms, sites) = indices.iter().filter_map(term).unzip();
    let displacements = partial.iter().zip(residuals).map(|(partial, residual)| partial - residual);
    let rows = EffectRows {
        poses: all_poses.iter().map(|pose| pose.setup).collect(),
        displacements: displacements.collect(),
        terms,
        sites,
    };
    let view = at_joint(problem, &rows, levers, poses)
        .unwrap_or_else(|| beyond_joints(effect, problem, &rows));
    let longest = view.levers.iter().map(Vector3::norm).fold(0.0, f64::max);
    let point = |k: usize| Point {
        x: view.x[k],
        // A large displacement is no multiple of the lever; the law holds it exactly.
        y: (view.law)(view.x[k]) + change_along(&view.levers[k], &residuals[k]),
        held_out: poses.split.held_out.binary_search(&k).is_ok(),
        row: Some(k),
    };
    let informative = (0..partial.len()).filter(|&k| view.levers[k].norm() > MIN_LEVER * longest);
    let points: Vec<Point> = informative.map(point).collect();
    let (low, high) = range(points.iter().map(|point| point.x));
    let abscissa = |step: u32| low + (high - low) * f64::from(step) / f64::from(CURVE_STEPS);
    let curve: Vec<(f64, f64)> = (0..=CURVE_STEPS)
        .filter(|_| low <= high)
        .map(abscissa)
        .map(|x| (x, (view.law)(x)))
        .collect();
    let up = (view.up)(largest(&points, &curve));
    let title = effect.describe_in(poses.measurements.time_measured, &problem.slides());
    let (across, reading) = (view.across, view.reading);
    Some(Cause { title, found: None, across, up, points, curve, reading })
}

/// Returns the largest finite absolute ordinate of points and curve.
fn largest(points: &[Point], curve: &[(f64, f64)]) -> f64 {
    let heights = points.iter().map(|point| point.y).chain(curve.iter().map(|at| at.1));
    heights.filter(|height| height.is_finite()).map(f64::abs).fold(0.0, f64::max)
}
