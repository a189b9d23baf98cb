//! Data of the figure of an effect: the partial residual of each pose over the regressor of the
//! effect, and the fitted law.
//!
//! The partial residual is the residual of the fit plus the fitted displacement by the effect. For
//! an effect on a joint it is converted to the error of the joint coordinate by the lever of each
//! pose. For other effects it is the component along the displacement by the effect.

use nalgebra::Vector3;

use super::arm::{Arm, MIN_LEVER, Poses};
use super::prelude::*;
use crate::measurement::Split;
use crate::model::parameter::{EffectParameter, JointField, ParameterSite, Regressor};
use crate::problem::{Effect, JointKind, Mount, PoseView, Problem};
use crate::quantity::Unit;
use crate::residual_tests::Covariate;
use crate::select::{PartialResidual, Unexplained};

/// Number of steps of a curve.
const CURVE_STEPS: u32 = 160;
/// Number of degrees in a radian.
const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// Quantity along an axis, with its unit and the factor from SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// Label with the unit, for example `temperature [°C]`.
    pub label: String,
    /// Factor from SI to the unit.
    pub factor: f64,
}

/// Partial residual of one pose, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Value of the regressor.
    pub x: f64,
    /// Partial residual of one pose at one value of the regressor, SI.
    pub y: f64,
    /// True for a held-out pose.
    pub held_out: bool,
    /// Row of the pose, counted from 0, if known.
    pub row: Option<usize>,
}

/// Partial residuals over the regressor of an effect, with the fitted law.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// Description of the effect.
    pub title: String,
    /// Quantity on the horizontal axis.
    pub across: Quantity,
    /// Quantity on the vertical axis.
    pub up: Quantity,
    /// Poses that inform on the effect, in the order of the rows.
    pub points: Vec<Point>,
    /// Points of the fitted law.
    pub curve: Vec<(f64, f64)>,
    /// Explanation of a dot in the caption.
    pub(super) reading: &'static str,
}

const COORDINATE: &str = "Each dot is the error of this coordinate from one pose alone, with all other parameters as fitted. \
                          Poses with little sensitivity to the coordinate are omitted.";
const ALONG: &str = "Each dot is the residual of one pose along the displacement by the effect, with all other parameters \
                     as fitted.";
const SIZE: &str = "Each dot is the size of the effect from one pose alone, with all other parameters as fitted. Poses with \
                    little sensitivity to it are omitted.";

impl Quantity {
    fn new(label: impl Into<String>, factor: f64) -> Self {
        Self { label: label.into(), factor }
    }

    fn command(problem: &Problem, joint: usize) -> Self {
        let (unit, factor) = if slides(problem, joint) { ("mm", 1e3) } else { ("°", DEGREES) };
        Self::new(format!("command of joint {joint}, q{joint} [{unit}]"), factor)
    }

    fn temperature() -> Self {
        Self::new("temperature [°C]", 1.0)
    }

    fn lagging(time_constant: f64) -> Self {
        Self::new(format!("temperature that lags by {time_constant} s [°C]"), 1.0)
    }

    /// Returns the axis of elapsed times up to `longest` \[s\].
    fn elapsed(longest: f64) -> Self {
        let (unit, factor) = if longest > 7200.0 { ("h", 1.0 / 3600.0) } else { ("s", 1.0) };
        Self::new(format!("time since the first pose [{unit}]"), factor)
    }

    /// Returns the axis of the error of a coordinate.
    fn error(of: &str, unit: Unit) -> Self {
        match unit {
            Unit::Length => Self::new(format!("error of {of} [mm]"), 1e3),
            // Angles have the unit of the tables.
            _ => Self::new(format!("error of {of} [°]"), DEGREES),
        }
    }

    fn small(what: &str, unit: &str, largest: f64) -> Self {
        let (prefix, factor) = if largest < 1e-3 { ('µ', 1e6) } else { ('m', 1e3) };
        Self::new(format!("{what} [{prefix}{unit}]"), factor)
    }
}

/// Returns true if a joint (numbered from 1) is prismatic.
fn slides(problem: &Problem, joint: usize) -> bool {
    problem.joints[joint - 1].kind == JointKind::Prismatic
}

/// Fit of a model that declares the effects, evaluated in every row.
#[derive(Clone, Copy)]
pub struct EffectFit<'a> {
    /// Arm of the fit.
    pub arm: &'a Arm,
    /// Residual of each row \[m\].
    pub residuals: &'a [Vector3<f64>],
    /// Lever of each joint coordinate in each row \[m/rad\] or \[m/m\].
    pub levers: &'a [Vec<Vector3<f64>>],
}

/// Returns the site of every joint coordinate.
pub fn coordinates(problem: &Problem) -> Vec<ParameterSite> {
    let field =
        |joint: usize| if slides(problem, joint) { JointField::D } else { JointField::Theta };
    (1..=problem.joints.len())
        .map(|joint| ParameterSite::Joint { joint: joint - 1, field: field(joint) })
        .collect()
}

/// Partial residuals of an effect before the selection of poses.
struct View<'a> {
    across: Quantity,
    /// Vertical axis for the largest value \[SI\].
    up: Box<dyn Fn(f64) -> Quantity + 'a>,
    /// Value of the regressor in each row.
    x: Vec<f64>,
    /// Displacement by one unit of the ordinate in each row \[m\].
    levers: Vec<Vector3<f64>>,
    /// Fitted law: the ordinate at a value of the regressor.
    law: Box<dyn Fn(f64) -> f64 + 'a>,
    reading: &'static str,
}

/// Poses with the displacement by an effect.
struct Rows<'a> {
    poses: Vec<PoseView<'a>>,
    /// Displacement by the effect in each row \[m\].
    displacements: Vec<Vector3<f64>>,
    parameters: &'a [EffectParameter],
    values: &'a [f64],
}

/// Computes the figure data of an effect from the fit of `problem`, which declares it.
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
    let partial = poses.errors(&without, &poses.rows());
    let all_poses = poses.all(1.0);
    let values: Vec<f64> = indices.iter().map(|&k| arm.x[k]).collect();
    let displacements = partial.iter().zip(residuals).map(|(partial, residual)| partial - residual);
    let rows = Rows {
        poses: all_poses.iter().map(|pose| pose.setup).collect(),
        displacements: displacements.collect(),
        parameters: &parameters,
        values: &values,
    };
    let view = at_joint(effect, problem, &rows, levers, poses)
        .unwrap_or_else(|| beyond_joints(effect, problem, &rows));
    let longest = view.levers.iter().map(Vector3::norm).fold(0.0, f64::max);
    let point = |k: usize| Point {
        x: view.x[k],
        y: along(&view.levers[k], &partial[k]),
        held_out: poses.split.held_out.binary_search(&k).is_ok(),
        row: Some(k),
    };
    let informative = (0..partial.len()).filter(|&k| view.levers[k].norm() > MIN_LEVER * longest);
    let points: Vec<Point> = informative.map(point).collect();
    let (low, high) = range(points.iter().map(|point| point.x));
    let at = |step: u32| low + (high - low) * f64::from(step) / f64::from(CURVE_STEPS);
    let curve: Vec<(f64, f64)> =
        (0..=CURVE_STEPS).filter(|_| low <= high).map(at).map(|x| (x, (view.law)(x))).collect();
    let up = (view.up)(largest(&points, &curve));
    let title = effect.describe_in(poses.measurements.time_measured);
    Some(Cause { title, across: view.across, up, points, curve, reading: view.reading })
}

/// Returns the least-squares change of a coordinate for a displacement.
fn along(lever: &Vector3<f64>, displacement: &Vector3<f64>) -> f64 {
    lever.dot(displacement) / lever.norm_squared()
}

/// Returns the largest absolute ordinate of points and curve.
fn largest(points: &[Point], curve: &[(f64, f64)]) -> f64 {
    let heights = points.iter().map(|point| point.y).chain(curve.iter().map(|at| at.1));
    heights.filter(|height| height.is_finite()).map(f64::abs).fold(0.0, f64::max)
}

/// Returns the view of an effect on a joint coordinate; `None` for other effects.
fn at_joint<'a>(
    effect: &Effect,
    problem: &'a Problem,
    rows: &'a Rows,
    levers: &[Vec<Vector3<f64>>],
    poses: &Poses,
) -> Option<View<'a>> {
    let first = rows.values.first().copied().unwrap_or_default();
    let each =
        |value: &dyn Fn(&PoseView) -> f64| -> Vec<f64> { rows.poses.iter().map(value).collect() };
    let command = |joint: usize| each(&|pose| pose.configuration[joint - 1]);
    let lever = |joint: usize| &levers[joint - 1];
    let moment = |joint: usize| Quantity::new(format!("moment about joint {joint} [N·m]"), 1.0);
    // Δθ = c M or c₃ M³: the moment follows from the displacement and the law.
    let moments = |joint: usize, of: fn(f64) -> f64| -> Vec<f64> {
        lever(joint)
            .iter()
            .zip(&rows.displacements)
            .map(|(lever, displacement)| of(along(lever, displacement) / first))
            .collect()
    };
    let proportional: Law = Box::new(move |x| first * x);
    let of_command: Law = Box::new(|q: f64| {
        let configuration = vec![q; rows.poses[0].configuration.len()];
        rows.law_value(&PoseView::from_configuration(&configuration))
    });
    let (joint, across, x, law): (_, _, _, Law) = match *effect {
        Effect::JointHarmonic { joint, .. }
        | Effect::JointWave { joint, .. }
        | Effect::GearRatio { joint } => {
            (joint, Quantity::command(problem, joint), command(joint), of_command)
        }
        Effect::JointCoupling { joint, from } => {
            (joint, Quantity::command(problem, from), command(from), of_command)
        }
        Effect::JointThermalDrift { joint } => {
            let law = Box::new(|t| {
                rows.law_value(&PoseView {
                    temperature: Some(&t),
                    ..PoseView::from_configuration(&[])
                })
            });
            (joint, Quantity::temperature(), rows.temperatures(), law)
        }
        Effect::Covariate { joint: Mount::Joint(joint), ref of } => {
            let which = problem.data.covariates.iter().position(|declared| declared.name == *of)?;
            let values = each(&|pose| pose.covariates.get(which).copied().unwrap_or_default());
            (joint, Quantity::new(of, 1.0), values, proportional)
        }
        Effect::Backlash { joint } if poses.measurements.approach.is_some() => {
            let label = format!("approach side of joint {joint} [−1 … +1]");
            let sides = each(&|pose| pose.approach.map_or(0.0, |sides| sides[joint - 1]));
            let across = Quantity::new(label, 1.0);
            (joint, across, sides, Box::new(move |side| 0.5 * first * side))
        }
        Effect::PayloadBacklash { joint } => {
            let label = format!("half the payload × approach side of joint {joint} [kg]");
            let across = Quantity::new(label, 1.0);
            let regressor =
                Regressor::LoadedSide { joint: joint - 1, declared: problem.tool.payload_mass };
            (joint, across, each(&|pose| regressor.value(pose)), proportional)
        }
        Effect::JointHysteresis { joint, distance } => {
            let label = format!("friction state of joint {joint} [−1 … +1]");
            let across = Quantity::new(label, 1.0);
            let regressor = Regressor::Dragged { joint: joint - 1, distance };
            (joint, across, each(&|pose| regressor.value(pose)), proportional)
        }
        Effect::JointThermalDriftLag { joint, time_constant } => {
            let reference = problem.data.reference_temperature.unwrap_or_default();
            let lagged = rows.lagged_temperatures(reference, time_constant);
            (
                joint,
                Quantity::lagging(time_constant),
                lagged,
                Box::new(move |lagged| first * (lagged - reference)),
            )
        }
        Effect::JointCompliance { joint } => {
            (joint, moment(joint), moments(joint, |moment| moment), proportional)
        }
        Effect::JointNonlinearStiffness { joint } => (
            joint,
            moment(joint),
            moments(joint, f64::cbrt),
            Box::new(move |moment| first * moment.powi(3)),
        ),
        _ => return None,
    };
    let unit = if slides(problem, joint) { Unit::Length } else { Unit::Angle };
    let up = Box::new(move |_| Quantity::error(&format!("joint {joint}"), unit));
    Some(View { across, up, x, levers: lever(joint).clone(), law, reading: COORDINATE })
}

type Law<'a> = Box<dyn Fn(f64) -> f64 + 'a>;

impl Rows<'_> {
    /// Returns the value of the law at a pose, Σ value · regressor.
    fn law_value(&self, pose: &PoseView) -> f64 {
        self.parameters
            .iter()
            .zip(self.values)
            .map(|(parameter, value)| value * parameter.regressor.value(pose))
            .sum()
    }

    /// Returns the lagged temperature of each row [°C].
    fn lagged_temperatures(&self, reference: f64, time_constant: f64) -> Vec<f64> {
        let regressor = Regressor::Lagging { reference, time_constant };
        self.poses.iter().map(|pose| regressor.value(pose) + reference).collect()
    }

    fn temperatures(&self) -> Vec<f64> {
        self.poses.iter().map(|pose| pose.temperature.copied().unwrap_or_default()).collect()
    }

    /// Returns the displacement of each row divided by the size of the effect; zero if the size is
    /// zero.
    fn per_size(&self, sizes: impl Iterator<Item = f64>) -> Vec<Vector3<f64>> {
        let lever = |(displacement, size): (&Vector3<f64>, f64)| {
            if size == 0.0 { Vector3::zeros() } else { displacement / size }
        };
        self.displacements.iter().zip(sizes).map(lever).collect()
    }
}

/// Returns the view of an effect that is no error of a joint coordinate.
fn beyond_joints<'a>(effect: &Effect, problem: &Problem, rows: &'a Rows) -> View<'a> {
    let sum: f64 = rows.values.iter().sum();
    let norm = rows.values.iter().map(|value| value * value).sum::<f64>().sqrt();
    let elapsed: Vec<f64> = rows.poses.iter().map(|pose| pose.elapsed).collect();
    let last = elapsed.iter().copied().fold(0.0, f64::max);
    let longest = rows
        .displacements
        .iter()
        .fold(Vector3::zeros(), |a: Vector3<f64>, b| if b.norm() > a.norm() { *b } else { a });
    let measured = |_| Quantity::new("displacement, measured [mm]", 1e3);
    // An effect on the measuring frame displaces every pose in one direction.
    let of_time = |law: Law<'a>| View {
        across: Quantity::elapsed(last),
        up: Box::new(measured),
        x: elapsed.clone(),
        levers: vec![longest.try_normalize(0.0).unwrap_or_default(); rows.displacements.len()],
        law,
        reading: ALONG,
    };
    match effect {
        Effect::LinkThermalBending { link }
        | Effect::LinkThermalExpansion { link }
        | Effect::LinkThermalBendingLag { link, .. }
        | Effect::LinkThermalExpansionLag { link, .. } => {
            let reference = problem.data.reference_temperature.unwrap_or_default();
            let (across, temperatures) = match effect {
                Effect::LinkThermalBendingLag { time_constant, .. }
                | Effect::LinkThermalExpansionLag { time_constant, .. } => (
                    Quantity::lagging(*time_constant),
                    rows.lagged_temperatures(reference, *time_constant),
                ),
                _ => (Quantity::temperature(), rows.temperatures()),
            };
            let bends = matches!(
                effect,
                Effect::LinkThermalBending { .. } | Effect::LinkThermalBendingLag { .. }
            );
            let link = link.clone();
            // An expansion has one signed coefficient; the two of a bending have one norm.
            let size = if bends { norm } else { sum };
            View {
                across,
                up: if bends {
                    Box::new(move |largest| {
                        Quantity::small(&format!("curvature of link {link}"), "rad/m", largest)
                    })
                } else {
                    Box::new(move |_| Quantity::new(format!("strain of link {link} [10⁻⁶]"), 1e6))
                },
                levers: rows.per_size(temperatures.iter().map(|t| size * (t - reference))),
                x: temperatures,
                law: Box::new(move |t| size * (t - reference)),
                reading: SIZE,
            }
        }
        Effect::PayloadMass => View {
            across: Quantity::new("payload [kg]", 1.0),
            up: Box::new(|_| Quantity::new("missing mass [kg]", 1.0)),
            x: rows.poses.iter().map(|pose| pose.payload.copied().unwrap_or_default()).collect(),
            levers: rows.per_size(std::iter::repeat(sum)),
            law: Box::new(move |_| sum),
            reading: SIZE,
        },
        Effect::TrackerDrift => {
            let speed = if last > 0.0 { longest.norm() / last } else { 0.0 };
            of_time(Box::new(move |t| speed * t))
        }
        Effect::TrackerSettling { time_constant } => {
            let (time_constant, size) = (*time_constant, norm);
            of_time(Box::new(move |t| size * (1.0 - (-t / time_constant).exp())))
        }
        Effect::StationShift { at_time } => {
            let first = rows.poses.first().map_or(0.0, |pose| pose.time - pose.elapsed);
            let (at, step) = (at_time - first, longest.norm());
            of_time(Box::new(move |t| if t >= at { step } else { 0.0 }))
        }
        _ => View {
            across: Quantity::new("displacement predicted by the law [mm]", 1e3),
            up: Box::new(measured),
            x: rows.displacements.iter().map(Vector3::norm).collect(),
            levers: rows
                .displacements
                .iter()
                .map(|displacement| displacement.try_normalize(0.0).unwrap_or_default())
                .collect(),
            law: Box::new(|displacement| displacement),
            reading: ALONG,
        },
    }
}

/// Returns the empirical correction of unexplained structure, less its mean; `None` if it does not
/// depend on a single covariate or the order of the rows.
pub fn unexplained(structure: &Unexplained, problem: &Problem, split: &Split) -> Option<Cause> {
    let of = structure.correction.as_ref()?.curve.as_ref()?;
    let mut curve: Vec<(f64, f64)> =
        of.points.iter().map(|point| (point.covariate, point.correction)).collect();
    curve.sort_by(|a, b| a.0.total_cmp(&b.0));
    let trapezoid = |pair: &[(f64, f64)]| (pair[1].0 - pair[0].0) * 0.5 * (pair[0].1 + pair[1].1);
    let width = curve.last()?.0 - curve.first()?.0;
    let area: f64 = curve.windows(2).map(trapezoid).sum();
    let mean = if width > 0.0 { area / width } else { 0.0 };
    for (_, y) in &mut curve {
        *y -= mean;
    }
    let across = match of.covariate {
        Covariate::Temperature => Quantity::temperature(),
        Covariate::Time => Quantity::elapsed(range(curve.iter().map(|at| at.0)).1),
        Covariate::Payload => Quantity::new("payload [kg]", 1.0),
        Covariate::Hoist => Quantity::new("hoist force [N]", 1.0),
        Covariate::Command(joint) => Quantity::command(problem, joint + 1),
        Covariate::Own(ref name) => Quantity::new(&**name, 1.0),
        _ => return None,
    };
    let longest = of.points.iter().map(|point| point.lever).fold(0.0, f64::max);
    let informative =
        of.points.iter().enumerate().filter(|(_, point)| point.lever > MIN_LEVER * longest);
    let point = |(k, point): (usize, &PartialResidual)| Point {
        x: point.covariate,
        y: point.value - mean,
        held_out: false,
        row: split.identification.get(k).copied(),
    };
    let points: Vec<Point> = informative.map(point).collect();
    let site = structure.site?;
    let up = Quantity::error(&site.to_string(), of.unit);
    let title = format!("{site}: structure without a known cause");
    Some(Cause { title, across, up, points, curve, reading: COORDINATE })
}
