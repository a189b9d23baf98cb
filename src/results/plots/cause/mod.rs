//! Data of the figure of an effect: the partial residual of each pose over the regressor of the
//! effect, and the fitted law.
//!
//! The partial residual is the residual of the fit plus the fitted displacement by the effect. For
//! an effect on a joint it is converted to the error of the joint coordinate by the lever of each
//! pose. For other effects it is the component along the displacement by the effect.

use nalgebra::Vector3;

use super::arm::{Arm, MIN_LEVER, Poses};
use super::prelude::*;
use crate::laws::Quantity as Known;
use crate::measurement::Split;
use crate::model::parameter::{
    ArmField, BeamField, EffectParameter, JointField, ParameterSite, Regressor, value_regressor,
};
use crate::problem::{Effect, JointKind, PoseView, Problem};
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
    /// Regressor and value of each term.
    terms: Vec<(Regressor, f64)>,
    /// Site of each term.
    sites: Vec<ParameterSite>,
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
    let term = |&k: &usize| {
        let regressor = value_regressor(&arm.model.parameters, arm.x.as_slice(), k)?;
        Some(((regressor, arm.x[k]), arm.model.parameters[k].site))
    };
    let (terms, sites) = indices.iter().filter_map(term).unzip();
    let displacements = partial.iter().zip(residuals).map(|(partial, residual)| partial - residual);
    let rows = Rows {
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
        y: along(&view.levers[k], &partial[k]),
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

/// Returns the view of an effect that changes the coordinate of a joint; `None` for other effects.
fn at_joint<'a>(
    problem: &'a Problem,
    rows: &'a Rows,
    levers: &[Vec<Vector3<f64>>],
    poses: &Poses,
) -> Option<View<'a>> {
    let ParameterSite::Joint { joint, field } = rows.site()? else { return None };
    let (number, levers) = (joint + 1, levers.get(joint)?);
    let first = rows.terms.first()?.1;
    let unit = if slides(problem, number) { Unit::Length } else { Unit::Angle };
    // Δθ = c M, c₃ M³: the moment follows from the law itself.
    let moments = |of: fn(f64) -> f64| -> (Quantity, Vec<f64>) {
        let moment = |(lever, own): (&Vector3<f64>, &Vector3<f64>)| of(along(lever, own) / first);
        let across = Quantity::new(format!("moment about joint {number} [N·m]"), 1.0);
        (across, levers.iter().zip(&rows.displacements).map(moment).collect())
    };
    let (across, x, law): (_, _, Law) = match field {
        JointField::Theta | JointField::D if rows.is_driven() => {
            match (rows.quantities().as_slice(), rows.terms.as_slice()) {
                (&[quantity], _) if rows.over_quantity(quantity, problem).is_some() => {
                    rows.over_quantity(quantity, problem)?
                }
                (_, [(regressor, value)]) => {
                    let across = Quantity::new(Rows::label(regressor), 1.0);
                    let each = rows.poses.iter().map(|pose| regressor.value(pose)).collect();
                    (across, each, Box::new(move |x| value * x))
                }
                _ => {
                    let across = Quantity::error(&format!("joint {number} by the law"), unit);
                    let each = rows.poses.iter().map(|pose| rows.driven(pose)).collect();
                    (across, each, Box::new(|x| x))
                }
            }
        }
        JointField::Play | JointField::SlidingPlay if poses.measurements.approach.is_some() => {
            let label = format!("side from which joint {number} came [−1 … +1]");
            let side = |pose: &PoseView| pose.approach.map_or(0.0, |all| all[joint]);
            let sides = rows.poses.iter().map(side).collect();
            (Quantity::new(label, 1.0), sides, Box::new(move |side| 0.5 * first * side))
        }
        JointField::Compliance => {
            let (across, x) = moments(|moment| moment);
            (across, x, Box::new(move |moment| first * moment))
        }
        JointField::Cubic => {
            let (across, x) = moments(f64::cbrt);
            (across, x, Box::new(move |moment| first * moment.powi(3)))
        }
        _ => return None,
    };
    let up = Box::new(move |_| Quantity::error(&format!("joint {number}"), unit));
    Some(View { across, up, x, levers: levers.clone(), law, reading: COORDINATE })
}

type Law<'a> = Box<dyn Fn(f64) -> f64 + 'a>;

impl Rows<'_> {
    /// Returns the site of all terms, where it is one.
    fn site(&self) -> Option<ParameterSite> {
        let (first, others) = self.sites.split_first()?;
        others.iter().all(|site| site == first).then_some(*first)
    }

    /// Returns true if every term is multiplied by a formula.
    fn is_driven(&self) -> bool {
        self.terms.iter().all(|(regressor, _)| !regressor.is_constant())
    }

    /// Returns the quantities that the terms follow, each once.
    fn quantities(&self) -> Vec<Known> {
        let mut found = Vec::new();
        for quantity in self.terms.iter().flat_map(|(regressor, _)| regressor.quantities()) {
            if !found.contains(&quantity) {
                found.push(quantity);
            }
        }
        found
    }

    /// Returns Σ value · regressor.
    fn driven(&self, pose: &PoseView) -> f64 {
        self.terms.iter().map(|(regressor, value)| value * regressor.value(pose)).sum()
    }

    /// Returns the axis of a formula with its unit.
    fn label(regressor: &Regressor) -> String {
        match regressor.as_quantity() {
            Some(Known::Friction { joint, .. }) => {
                format!("friction that holds joint {} back [−1 … +1]", joint + 1)
            }
            _ => format!("{} [SI]", regressor.text()),
        }
    }

    /// Returns the axis of one quantity, its values, and Σ value · regressor over it; `None` where no
    /// pose can be made of a value of the quantity alone.
    fn over_quantity<'r>(
        &'r self,
        quantity: Known,
        problem: &Problem,
    ) -> Option<(Quantity, Vec<f64>, Law<'r>)> {
        let each =
            |value: &dyn Fn(&PoseView) -> f64| self.poses.iter().map(value).collect::<Vec<f64>>();
        let reference = problem.data.reference_temperature.unwrap_or_default();
        Some(match quantity {
            Known::Command(joint) => {
                let count = self.poses.first()?.configuration.len();
                let law = move |q: f64| self.driven(&PoseView::from_configuration(&vec![q; count]));
                let across = Quantity::command(problem, joint + 1);
                (across, each(&|pose| pose.configuration[joint]), Box::new(law))
            }
            Known::Warming => {
                let law = move |t: f64| {
                    let pose = PoseView::from_configuration(&[]);
                    self.driven(&PoseView { temperature: Some(&t), ..pose })
                };
                let value = |pose: &PoseView| pose.temperature.copied().unwrap_or_default();
                (Quantity::temperature(), each(&value), Box::new(law))
            }
            // The lagged temperature itself multiplies every term.
            Known::Lagging { time_constant } if self.is_each(quantity) => {
                let sum: f64 = self.terms.iter().map(|term| term.1).sum();
                let regressor = &self.terms.first()?.0;
                let values = each(&|pose| regressor.value(pose) + reference);
                let law = move |lagged: f64| sum * (lagged - reference);
                (Quantity::lagging(time_constant), values, Box::new(law))
            }
            Known::Covariate(index) => {
                let name = &problem.data.covariates.get(index)?.name;
                let law = move |value: f64| {
                    let mut covariates = vec![0.0; index];
                    covariates.push(value);
                    let pose = PoseView::from_configuration(&[]);
                    self.driven(&PoseView { covariates: &covariates, ..pose })
                };
                let value =
                    |pose: &PoseView| pose.covariates.get(index).copied().unwrap_or_default();
                (Quantity::new(name, 1.0), each(&value), Box::new(law))
            }
            Known::Elapsed | Known::Time => {
                let elapsed = each(&|pose| pose.elapsed);
                let last = elapsed.iter().copied().fold(0.0, f64::max);
                let first = self.poses.first().map_or(0.0, |pose| pose.time - pose.elapsed);
                let law = move |elapsed: f64| {
                    let pose = PoseView::from_configuration(&[]);
                    self.driven(&PoseView { elapsed, time: first + elapsed, ..pose })
                };
                (Quantity::elapsed(last), elapsed, Box::new(law))
            }
            _ => return None,
        })
    }

    /// Returns true if every term is multiplied by a quantity itself.
    fn is_each(&self, quantity: Known) -> bool {
        self.terms.iter().all(|(regressor, _)| regressor.as_quantity() == Some(quantity))
    }

    /// Returns the effect's displacement over its size in each row; none where that is 0.
    fn over(&self, sizes: impl Iterator<Item = f64>) -> Vec<Vector3<f64>> {
        let lever = |(own, size): (&Vector3<f64>, f64)| {
            if size == 0.0 { Vector3::zeros() } else { own / size }
        };
        self.displacements.iter().zip(sizes).map(lever).collect()
    }
}

/// Returns the view of an effect that is no error of a joint's coordinate.
fn beyond_joints<'a>(found: &Effect, problem: &Problem, rows: &'a Rows) -> View<'a> {
    at_link(found, problem, rows)
        .or_else(|| of_time(problem, rows))
        .or_else(|| of_payload(rows))
        .unwrap_or_else(|| View {
            across: Quantity::new("displacement by the law [mm]", 1e3),
            up: Box::new(|_| Quantity::new("displacement, measured [mm]", 1e3)),
            x: rows.displacements.iter().map(Vector3::norm).collect(),
            levers: rows
                .displacements
                .iter()
                .map(|own| own.try_normalize(0.0).unwrap_or_default())
                .collect(),
            law: Box::new(|displacement| displacement),
            reading: ALONG,
        })
}

/// Returns the view of a strain of a link that follows one temperature.
fn at_link<'a>(found: &Effect, problem: &Problem, rows: &'a Rows) -> Option<View<'a>> {
    let is_strain = |site: &ParameterSite| matches!(site, ParameterSite::Beam { field, .. } if field.is_strain());
    let &[quantity] = rows.quantities().as_slice() else { return None };
    if !(quantity.is_thermal() && rows.sites.iter().all(is_strain) && rows.is_each(quantity)) {
        return None;
    }
    let (across, values, _) = rows.over_quantity(quantity, problem)?;
    let reference = problem.data.reference_temperature.unwrap_or_default();
    let link = found.link()?;
    let stretches =
        matches!(rows.sites.first(), Some(ParameterSite::Beam { field: BeamField::Stretch, .. }));
    // An expansion has one coefficient with a sign; a bending's two make one size.
    let sizes = || rows.terms.iter().map(|term| term.1);
    let size = if stretches { sizes().sum() } else { sizes().map(|c| c * c).sum::<f64>().sqrt() };
    let up: Box<dyn Fn(f64) -> Quantity> = if stretches {
        Box::new(move |_| Quantity::new(format!("strain of link {link} [10⁻⁶]"), 1e6))
    } else {
        Box::new(move |most| Quantity::small(&format!("curvature of link {link}"), "rad/m", most))
    };
    Some(View {
        across,
        up,
        levers: rows.over(values.iter().map(|value| size * (value - reference))),
        x: values,
        law: Box::new(move |value| size * (value - reference)),
        reading: SIZE,
    })
}

/// Returns the view of a displacement of the measuring frame by a function of time: every pose moves
/// in one direction.
fn of_time<'a>(problem: &Problem, rows: &'a Rows) -> Option<View<'a>> {
    let is_shift = |site: &ParameterSite| matches!(site, ParameterSite::Shift { .. });
    let &[quantity @ (Known::Elapsed | Known::Time)] = rows.quantities().as_slice() else {
        return None;
    };
    let (regressor, _) = rows.terms.first()?;
    let is_one = rows.terms.iter().all(|(other, _)| other == regressor);
    if !is_one || !rows.sites.iter().all(is_shift) {
        return None;
    }
    let (across, x, _) = rows.over_quantity(quantity, problem)?;
    let norm = rows.terms.iter().map(|term| term.1 * term.1).sum::<f64>().sqrt();
    let first = rows.poses.first().map_or(0.0, |pose| pose.time - pose.elapsed);
    let longest = |a: Vector3<f64>, b: &Vector3<f64>| if b.norm() > a.norm() { *b } else { a };
    let most = rows.displacements.iter().fold(Vector3::zeros(), longest);
    let law = move |elapsed: f64| {
        let pose = PoseView::from_configuration(&[]);
        norm * regressor.value(&PoseView { elapsed, time: first + elapsed, ..pose })
    };
    Some(View {
        across,
        up: Box::new(|_| Quantity::new("displacement, measured [mm]", 1e3)),
        x,
        levers: vec![most.try_normalize(0.0).unwrap_or_default(); rows.displacements.len()],
        law: Box::new(law),
        reading: ALONG,
    })
}

/// Returns the view of a mass that is added to payloads.
fn of_payload<'a>(rows: &'a Rows) -> Option<View<'a>> {
    if rows.site()? != ParameterSite::Arm(ArmField::Payload) {
        return None;
    }
    let sum: f64 = rows.terms.iter().map(|term| term.1).sum();
    Some(View {
        across: Quantity::new("payload [kg]", 1.0),
        up: Box::new(|_| Quantity::new("missing mass [kg]", 1.0)),
        x: rows.poses.iter().map(|pose| pose.payload.copied().unwrap_or_default()).collect(),
        levers: rows.over(std::iter::repeat(sum)),
        law: Box::new(move |_| sum),
        reading: SIZE,
    })
}

/// Returns the empirical correction of unexplained structure, less its mean; `None` if it does not
/// depend on a single covariate or the order of the rows.
pub fn unexplained(structure: &Unexplained, problem: &Problem, split: &Split) -> Option<Cause> {
    let correction = structure.correction.as_ref()?.curve.as_ref()?;
    let mut curve: Vec<(f64, f64)> =
        correction.points.iter().map(|point| (point.covariate, point.correction)).collect();
    curve.sort_by(|a, b| a.0.total_cmp(&b.0));
    let trapezoid = |pair: &[(f64, f64)]| (pair[1].0 - pair[0].0) * 0.5 * (pair[0].1 + pair[1].1);
    let width = curve.last()?.0 - curve.first()?.0;
    let area: f64 = curve.windows(2).map(trapezoid).sum();
    let mean = if width > 0.0 { area / width } else { 0.0 };
    for (_, y) in &mut curve {
        *y -= mean;
    }
    let across = match correction.covariate {
        Covariate::Temperature => Quantity::temperature(),
        Covariate::Time => Quantity::elapsed(range(curve.iter().map(|at| at.0)).1),
        Covariate::Payload => Quantity::new("payload [kg]", 1.0),
        Covariate::Hoist => Quantity::new("hoist force [N]", 1.0),
        Covariate::Command(joint) => Quantity::command(problem, joint + 1),
        Covariate::Own(ref name) => Quantity::new(&**name, 1.0),
        _ => return None,
    };
    let longest = correction.points.iter().map(|point| point.lever).fold(0.0, f64::max);
    let informative =
        correction.points.iter().enumerate().filter(|(_, point)| point.lever > MIN_LEVER * longest);
    let point = |(k, point): (usize, &PartialResidual)| Point {
        x: point.covariate,
        y: point.value - mean,
        held_out: false,
        row: split.identification.get(k).copied(),
    };
    let points: Vec<Point> = informative.map(point).collect();
    let site = structure.site?;
    let up = Quantity::error(&site.to_string(), correction.unit);
    let title = format!("{site}: structure without a known cause");
    Some(Cause { title, across, up, points, curve, reading: COORDINATE })
}
