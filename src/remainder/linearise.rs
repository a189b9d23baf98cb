//! Linearises the model at measured rows, to give the residuals and derivatives that a remainder is
//! fitted to.

use std::collections::HashMap;

use nalgebra::{DMatrix, DVector};

use super::prior::ParameterPrior;
use super::rows::{AXES, InputSource, Inputs, Layout, Rows, Site, SiteKind};
use crate::fit::Placement;
use crate::least_squares::jacobian_and_residual;
use crate::measurement::{Measurements, StartTimes};
use crate::model::parameter::{JointField, ParameterSite};
use crate::model::{Model, Pose, PoseResiduals};
use crate::problem::{Joint, JointKind, Problem};

/// Smallest lever of a joint's coordinate or compliance, as a fraction of the largest over the
/// joints, at which the remainder models its error. The lever is a root mean square derivative of
/// the position.
const MIN_LEVER: f64 = 1e-3;
/// Largest ratio of standard deviation to mean at which a temperature, payload or hoist force
/// counts as constant, so that errors do not depend on it.
const MIN_SPREAD: f64 = 1e-6;
/// 1 σ of the motion of the position \[m\] that the prior assumed for a parameter without a
/// declared one allows. It exceeds any plausible error, so that the data decide.
const WIDE_MOTION_SIGMA: f64 = 0.3;
/// Largest prior 1 σ assumed for a parameter without a declared prior, in the SI unit of the
/// parameter.
const MAX_SPREAD: f64 = 1e3;

/// Model of a problem, to be linearised about a full parameter vector.
pub(super) struct Linearisation<'a> {
    pub problem: &'a Problem,
    pub model: &'a Model,
    /// Full parameter vector.
    pub x: &'a DVector<f64>,
    /// Indices of the parameters that have a column in the Jacobian.
    pub unknowns: Vec<usize>,
    /// 1 σ of the noise of rows for which the table gives none \[m\]; the unit of
    /// [`Rows::relative_sigma`].
    pub sigma: f64,
}

impl Linearisation<'_> {
    /// Returns the linearised rows of `poses`; their residuals are NaN for poses without
    /// equilibrium.
    pub fn rows(&self, layout: &Layout, poses: Vec<Pose>) -> Rows {
        let relative_sigma = poses.iter().map(|pose| pose.sigma / self.sigma).collect();
        let poses: Vec<Pose> = poses.into_iter().map(|pose| Pose { sigma: 1.0, ..pose }).collect();
        let sites = self.site_columns(&layout.sites, &poses);
        let inputs = DMatrix::from_fn(layout.inputs.sources.len(), poses.len(), |input, row| {
            let (offset, unit) = layout.inputs.standard[input];
            // A condition that is not stated counts as its mean.
            let value = layout.inputs.sources[input].value(&poses[row].setup);
            (value.unwrap_or(offset) - offset) / unit
        });
        let configuration = configurations(&poses);
        let (jacobian, residual) = derivatives(self.model, poses, self.unknowns.clone(), self.x);
        Rows { residual, jacobian, sites, inputs, configuration, relative_sigma }
    }

    /// Returns the derivatives of the positions of `poses` with respect to the unknowns, shape = (3
    /// poses, unknowns). They are NaN for poses without equilibrium.
    pub fn jacobian(&self, poses: Vec<Pose>) -> DMatrix<f64> {
        derivatives(self.model, poses, self.unknowns.clone(), self.x).0
    }

    /// Returns derivatives and residuals of `poses`, divided by the σ of each pose.
    pub fn whitened(&self, poses: Vec<Pose>) -> (DMatrix<f64>, DVector<f64>) {
        let sigmas: Vec<f64> = poses.iter().map(|pose| pose.sigma).collect();
        let (mut slopes, mut residual) =
            derivatives(self.model, poses, self.unknowns.clone(), self.x);
        for (k, mut row) in slopes.row_iter_mut().enumerate() {
            row /= sigmas[k / AXES];
            residual[k] /= sigmas[k / AXES];
        }
        (slopes, residual)
    }

    /// Returns the derivatives of the positions of `poses` with respect to each site's joint
    /// coordinate or compliance, divided by the site's lever, shape = (sites, 3 poses).
    fn site_columns(&self, sites: &[Site], poses: &[Pose]) -> DMatrix<f64> {
        let mut out = DMatrix::zeros(sites.len(), AXES * poses.len());
        let of_kind = |kind| -> Vec<(usize, usize)> {
            let sites = sites.iter().enumerate().filter(|(_, site)| site.kind == kind);
            sites.map(|(k, site)| (k, site.joint)).collect()
        };
        let coordinates = of_kind(SiteKind::Coordinate);
        if !coordinates.is_empty() {
            let slopes = self.model.command_jacobian(self.problem, poses.to_vec(), self.x);
            for (place, slope) in slopes.iter().enumerate() {
                for &(site, joint) in &coordinates {
                    for axis in 0..AXES {
                        out[(site, AXES * place + axis)] = slope[(axis, joint)] / sites[site].lever;
                    }
                }
            }
        }
        let compliances = of_kind(SiteKind::Compliance);
        let joints: Vec<usize> = compliances.iter().map(|(_, joint)| *joint).collect();
        let slopes = self.compliance_jacobian(&joints, poses);
        for (column, (site, _)) in compliances.into_iter().enumerate() {
            out.set_row(site, &(slopes.column(column).transpose() / sites[site].lever));
        }
        out
    }

    /// Returns the derivatives of positions with respect to compliances added to `joints`, at 0,
    /// shape = (3 poses, joints) \[N·m²/rad\].
    fn compliance_jacobian(&self, joints: &[usize], poses: &[Pose]) -> DMatrix<f64> {
        if joints.is_empty() {
            return DMatrix::zeros(AXES * poses.len(), 0);
        }
        let field = JointField::Compliance;
        let site = |&joint: &usize| (ParameterSite::Joint { joint, field }, 0.0);
        let probed = self.model.with_probes(&joints.iter().map(site).collect::<Vec<_>>());
        let first = self.x.len();
        let x = self.x.clone().resize_vertically(first + joints.len(), 0.0);
        let unknowns = (first..first + joints.len()).collect();
        derivatives(&probed, poses.to_vec(), unknowns, &x).0
    }

    /// Determines the joint coordinates and compliances at which errors move the arm in these
    /// poses, and the inputs on which the errors may depend.
    pub fn layout(&self, poses: &[Pose]) -> Layout {
        let joints = commanded(self.problem);
        let sites = |kind| joints.iter().map(move |&joint| Site { joint, kind, lever: 1.0 });
        let coordinates = self.with_levers(sites(SiteKind::Coordinate).collect(), poses);
        let revolute = |site: &Site| self.problem.joints[site.joint].kind == JointKind::Revolute;
        let compliances = sites(SiteKind::Compliance).filter(revolute).collect();
        let mut compliances = self.with_levers(compliances, poses);
        let largest = compliances.iter().map(|site| site.lever).fold(0.0, f64::max);
        for site in &mut compliances {
            site.lever = largest;
        }
        let sites = [coordinates, compliances].concat();
        let count = poses.len().max(1) as f64;
        let commands = joints.iter().map(|&joint| InputSource::Command(joint));
        let mut inputs = Inputs {
            sites: Vec::new(),
            sources: Vec::new(),
            angles: Vec::new(),
            standard: Vec::new(),
            ranges: Vec::new(),
        };
        for source in commands.chain(InputSource::CONDITIONS) {
            let values: Option<Vec<f64>> =
                poses.iter().map(|pose| source.value(&pose.setup)).collect();
            let Some(values) = values else { continue };
            let mean = values.iter().sum::<f64>() / count;
            let squares = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>();
            let spread = (squares / count).sqrt();
            let is_angle = match source {
                InputSource::Command(joint) => {
                    self.problem.joints[joint].kind == JointKind::Revolute
                }
                _ if spread <= MIN_SPREAD * mean.abs() => continue,
                _ => false,
            };
            let is_plain = is_angle || spread == 0.0;
            inputs.sources.push(source);
            inputs.angles.push(is_angle);
            inputs.standard.push(if is_plain { (0.0, 1.0) } else { (mean, spread) });
            inputs.ranges.push((
                values.iter().copied().fold(f64::INFINITY, f64::min),
                values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            ));
        }
        inputs.sites = Inputs::functions(&sites, &inputs.sources);
        Layout { sites, inputs }
    }

    /// Sets the lever of each site, the root mean square derivative of the position over `poses`.
    /// Sites with a lever below [`MIN_LEVER`] times the largest are left out.
    fn with_levers(&self, sites: Vec<Site>, poses: &[Pose]) -> Vec<Site> {
        let columns = self.site_columns(&sites, poses);
        let count = poses.len().max(1) as f64;
        let levers: Vec<f64> =
            columns.row_iter().map(|row| (row.norm_squared() / count).sqrt()).collect();
        let largest = levers.iter().copied().fold(0.0, f64::max);
        let sites = sites.into_iter().zip(levers);
        let moving = sites.filter(|(_, lever)| *lever > MIN_LEVER * largest && *lever > 0.0);
        moving.map(|(site, lever)| Site { lever, ..site }).collect()
    }
}

/// Returns the index of each pose's configuration. It is equal for poses with the same session and
/// the same commands.
fn configurations(poses: &[Pose]) -> Vec<usize> {
    let mut index_of_key = HashMap::new();
    let key = |pose: &Pose| -> Vec<u64> {
        let commands = pose.setup.configuration.iter().map(|value| value.to_bits());
        commands.chain([pose.base as u64]).collect()
    };
    poses
        .iter()
        .map(|pose| {
            let next = index_of_key.len();
            *index_of_key.entry(key(pose)).or_insert(next)
        })
        .collect()
}

/// Returns the indices of the joints that take a command.
fn commanded(problem: &Problem) -> Vec<usize> {
    let joints = problem.joints.iter().map(Joint::command_kind).enumerate();
    joints.filter(|(_, kind)| *kind != JointKind::Fixed).map(|(joint, _)| joint).collect()
}

/// Returns the prior of the parameters `unknowns`, as deviations from the full parameter vector
/// `x`.
///
/// A parameter without a declared prior gets a σ that moves the position by 0.3 m (root mean square
/// over `rows`), or a σ of [`MAX_SPREAD`] if that is smaller.
pub(super) fn prior(
    model: &Model,
    x: &DVector<f64>,
    unknowns: &[usize],
    rows: &Rows,
) -> ParameterPrior {
    let declared = |j: usize| model.parameters[unknowns[j]].sigma;
    let wide = |j: usize| {
        let motion = (rows.jacobian.column(j).norm_squared() / rows.len().max(1) as f64).sqrt();
        (WIDE_MOTION_SIGMA / motion).min(MAX_SPREAD)
    };
    let mean = |j: usize, _| if declared(j).is_some() { -x[unknowns[j]] } else { 0.0 };
    ParameterPrior {
        mean: DVector::from_fn(unknowns.len(), mean),
        spread: DVector::from_fn(unknowns.len(), |j, _| declared(j).unwrap_or_else(|| wide(j))),
        information: None,
    }
}

/// Returns rows of a table as poses. `sigma` \[m\] is used for rows for which the table gives none,
/// and elapsed time counts from the `starts` of sessions.
pub(super) fn timed_poses<'a>(
    table: &'a Measurements,
    rows: &[usize],
    (sigma, starts): (f64, &StartTimes),
) -> Vec<Pose<'a>> {
    let placement = Placement::of(table);
    let mut poses = placement.poses(table, rows, sigma);
    placement.count_time_from(starts, &mut poses);
    poses
}

/// Returns the derivatives of the positions of `poses` with respect to the parameters `unknowns` at
/// the full parameter vector `x`, shape = (3 poses, unknowns), and the residuals.
fn derivatives(
    model: &Model,
    poses: Vec<Pose>,
    unknowns: Vec<usize>,
    x: &DVector<f64>,
) -> (DMatrix<f64>, DVector<f64>) {
    let poses: Vec<Pose> = poses.into_iter().map(|pose| Pose { sigma: 1.0, ..pose }).collect();
    let residuals = PoseResiduals::new(model, poses, unknowns, x.clone());
    let (slopes, residual) = jacobian_and_residual(&residuals, &residuals.unknowns_in(x));
    (-slopes, residual)
}
