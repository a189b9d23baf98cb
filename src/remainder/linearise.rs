//! Rows of measurements from a model and its full parameter vector.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector};

use super::prior::ParameterPrior;
use super::rows::{AXES, Inputs, Layout, Rows};
use crate::fit::Placement;
use crate::least_squares::jacobian_and_residual;
use crate::measurement::Measurements;
use crate::model::{Model, Pose, PoseResiduals};
use crate::problem::{Joint, JointKind, Problem};

/// A joint whose lever is below this share of the largest is no site.
const MIN_LEVER: f64 = 1e-3;
/// 1 σ of the target's motion by a parameter without a prior \[m\]: far beyond any plausible error.
const WIDE_MOTION: f64 = 0.3;
/// Largest 1 σ of a parameter without a prior, in its unit.
const MAX_SPREAD: f64 = 1e3;

/// Model of a problem linearised about a full parameter vector.
pub(super) struct Linearisation<'a> {
    pub problem: &'a Problem,
    pub model: &'a Model,
    /// Full parameter vector.
    pub x: &'a DVector<f64>,
    /// Parameters that have a column in the Jacobian.
    pub unknowns: Vec<usize>,
    /// 1 σ of rows for which the table has none \[m\]: the unit of [`Rows::relative_sigma`].
    pub sigma: f64,
}

impl Linearisation<'_> {
    /// Rows of `poses`; NaN where the arm has no equilibrium.
    pub fn rows(&self, layout: &Layout, poses: Vec<Pose>) -> Rows {
        let relative_sigma = poses.iter().map(|pose| pose.sigma / self.sigma).collect();
        let poses: Vec<Pose> = poses.into_iter().map(|pose| Pose { sigma: 1.0, ..pose }).collect();
        let slopes = self.model.command_jacobian(self.problem, poses.clone(), self.x);
        let inputs = DMatrix::from_fn(layout.inputs.joints.len(), poses.len(), |input, row| {
            let (offset, unit) = layout.inputs.standard[input];
            (poses[row].setup.configuration[layout.inputs.joints[input]] - offset) / unit
        });
        let sites =
            DMatrix::from_fn(layout.joints.len(), AXES * poses.len(), |site, coordinate| {
                let slope = slopes[coordinate / AXES][(coordinate % AXES, layout.joints[site])];
                slope / layout.levers[site]
            });
        let configuration = configurations(&poses);
        let residuals =
            PoseResiduals::new(self.model, poses, self.unknowns.clone(), self.x.clone());
        let (slopes, residual) = jacobian_and_residual(&residuals, &residuals.reduced(self.x));
        Rows { residual, jacobian: -slopes, sites, inputs, configuration, relative_sigma }
    }
}

/// Number of the configuration of each pose: equal where session and all commands are.
fn configurations(poses: &[Pose]) -> Vec<usize> {
    let mut known = HashMap::new();
    let key = |pose: &Pose| -> Vec<u64> {
        let commands = pose.setup.configuration.iter().map(|value| value.to_bits());
        commands.chain([pose.base as u64]).collect()
    };
    poses
        .iter()
        .map(|pose| {
            let next = known.len();
            *known.entry(key(pose)).or_insert(next)
        })
        .collect()
}

/// Joints that take a command.
fn commanded(problem: &Problem) -> Vec<usize> {
    let joints = problem.joints.iter().map(Joint::command_kind).enumerate();
    joints.filter(|(_, kind)| *kind != JointKind::Fixed).map(|(joint, _)| joint).collect()
}

/// Sites and inputs of the arm in these poses.
pub(super) fn layout(problem: &Problem, model: &Model, x: &DVector<f64>, poses: &[Pose]) -> Layout {
    let joints = commanded(problem);
    let slopes = model.command_jacobian(problem, poses.to_vec(), x);
    let lever = |joint: usize| {
        let squares: f64 = slopes.iter().map(|slope| slope.column(joint).norm_squared()).sum();
        (squares / poses.len().max(1) as f64).sqrt()
    };
    let levers: Vec<f64> = joints.iter().map(|&joint| lever(joint)).collect();
    let largest = levers.iter().copied().fold(0.0, f64::max);
    let mut layout = Layout {
        joints: Vec::new(),
        levers: Vec::new(),
        inputs: Inputs {
            joints: joints.clone(),
            angles: Vec::new(),
            site_of: Vec::new(),
            standard: Vec::new(),
            ranges: Vec::new(),
        },
    };
    for (&joint, lever) in joints.iter().zip(levers) {
        let values = || poses.iter().map(|pose| pose.setup.configuration[joint]);
        let is_angle = problem.joints[joint].kind == JointKind::Revolute;
        let mean = values().sum::<f64>() / poses.len().max(1) as f64;
        let square = values().map(|value| (value - mean).powi(2)).sum::<f64>();
        let spread = (square / poses.len().max(1) as f64).sqrt();
        let inputs = &mut layout.inputs;
        inputs.angles.push(is_angle);
        inputs.standard.push(if is_angle || spread == 0.0 { (0.0, 1.0) } else { (mean, spread) });
        inputs.ranges.push((
            values().fold(f64::INFINITY, f64::min),
            values().fold(f64::NEG_INFINITY, f64::max),
        ));
        let is_site = lever > MIN_LEVER * largest && lever > 0.0;
        inputs.site_of.push(is_site.then_some(layout.joints.len()));
        if is_site {
            layout.joints.push(joint);
            layout.levers.push(lever);
        }
    }
    layout
}

/// Prior of the parameters `unknowns` about the full parameter vector `x`.
///
/// A parameter without a declared prior moves the target by up to 0.3 m (1 σ, root mean square over
/// `rows`).
pub(super) fn prior(
    model: &Model,
    x: &DVector<f64>,
    unknowns: &[usize],
    rows: &Rows,
) -> ParameterPrior {
    let declared = |j: usize| model.parameters[unknowns[j]].sigma;
    let wide = |j: usize| {
        let motion = (rows.jacobian.column(j).norm_squared() / rows.len().max(1) as f64).sqrt();
        (WIDE_MOTION / motion).min(MAX_SPREAD)
    };
    let mean = |j: usize, _| if declared(j).is_some() { -x[unknowns[j]] } else { 0.0 };
    ParameterPrior {
        mean: DVector::from_fn(unknowns.len(), mean),
        spread: DVector::from_fn(unknowns.len(), |j, _| declared(j).unwrap_or_else(|| wide(j))),
    }
}

/// Rows of a table as poses; `sigma` \[m\] is that of rows for which the table has none, and time counts
/// from `first_time` \[s\].
pub(super) fn timed_poses<'a>(
    table: &'a Measurements,
    rows: &[usize],
    (sigma, first_time): (f64, f64),
) -> Vec<Pose<'a>> {
    let mut poses = Placement::of(table).poses(table, rows, sigma);
    for pose in &mut poses {
        pose.setup.elapsed = pose.setup.time - first_time;
    }
    poses
}
