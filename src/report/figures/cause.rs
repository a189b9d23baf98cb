//! The residual against what drives an effect: each pose's own measurement of the effect, and the
//! law that was fitted.
//!
//! Shown is the partial residual: what the fit leaves, with the effect's own part put back. At a
//! joint it is turned into the error of the joint's coordinate by the lever of each pose; elsewhere
//! it is the part along the effect's displacement.

use nalgebra::Vector3;

use super::arm::{Arm, LEAST_LEVER, Poses};
use super::pose::{thin, thinned};
use super::prelude::*;
use super::reach::{beyond, reach};
use crate::measurement::Split;
use crate::model::parameter::{EffectParameter, JointField, ParameterSite, Regressor};
use crate::problem::{Effect, JointKind, Mount, PoseView, Problem};
use crate::quantity::Unit;
use crate::residual_tests::Covariate;
use crate::select::{PartialResidual, Unexplained};

/// Steps of a curve.
const STEPS: u32 = 160;
/// Poses that are drawn at most.
const MOST: usize = 500;
const HEIGHT: i32 = 300;
const DEGREES: f64 = 180.0 / std::f64::consts::PI;

/// A quantity along an axis: what it is with its unit, and the factor from SI to that.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// `temperature [°C]`
    pub label: String,
    /// From SI.
    pub factor: f64,
}

/// One pose's own measurement of an effect, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// What drives the effect.
    pub x: f64,
    /// What it does.
    pub y: f64,
    /// Whether the pose was held out.
    pub held_out: bool,
    /// The row of the pose, counted from 0, where it is known.
    pub row: Option<usize>,
}

/// The residual against the cause of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// The effect in words.
    pub title: String,
    /// From left to right.
    pub across: Quantity,
    /// From bottom to top.
    pub up: Quantity,
    /// Poses that say something about it, in the order of the rows.
    pub points: Vec<Point>,
    /// The fitted law.
    pub curve: Vec<(f64, f64)>,
    /// What a point is.
    reading: &'static str,
}

const COORDINATE: &str = "Each dot is the error of this coordinate as one pose alone measures it, all other parameters as fitted. \
                          Poses that hardly feel the coordinate are left out.";
const ALONG: &str = "Each dot is the residual of one pose along the direction in which the effect moves it, all other parameters \
                     as fitted.";
const SIZE: &str = "Each dot is the effect's size as one pose alone measures it, all other parameters as fitted. Poses that \
                    hardly feel it are left out.";

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

    /// Up to `most` \[s\].
    fn elapsed(most: f64) -> Self {
        let (unit, factor) = if most > 7200.0 { ("h", 1.0 / 3600.0) } else { ("s", 1.0) };
        Self::new(format!("time since the first pose [{unit}]"), factor)
    }

    /// An error of a coordinate.
    fn error(of: &str, unit: Unit) -> Self {
        match unit {
            Unit::Length => Self::new(format!("error of {of} [mm]"), 1e3),
            // In the unit of the tables.
            _ => Self::new(format!("error of {of} [°]"), DEGREES),
        }
    }

    fn small(what: &str, unit: &str, most: f64) -> Self {
        let (prefix, factor) = if most < 1e-3 { ('µ', 1e6) } else { ('m', 1e3) };
        Self::new(format!("{what} [{prefix}{unit}]"), factor)
    }
}

fn slides(problem: &Problem, joint: usize) -> bool {
    problem.joints[joint - 1].kind == JointKind::Prismatic
}

/// The fit of a model that declares the effects, in every row.
#[derive(Clone, Copy)]
pub struct Closed<'a> {
    /// The arm as fitted.
    pub arm: &'a Arm,
    /// The residual that is left \[m\].
    pub left: &'a [Vector3<f64>],
    /// What the coordinate of each joint does \[m/rad\] or \[m/m\].
    pub levers: &'a [Vec<Vector3<f64>>],
}

/// The coordinate of every joint.
pub fn coordinates(problem: &Problem) -> Vec<ParameterSite> {
    let field =
        |joint: usize| if slides(problem, joint) { JointField::D } else { JointField::Theta };
    (1..=problem.joints.len())
        .map(|joint| ParameterSite::Joint { joint: joint - 1, field: field(joint) })
        .collect()
}

/// An effect over its cause, before it is known which poses say something.
struct View<'a> {
    across: Quantity,
    /// By the largest value \[SI\] that is shown.
    up: Box<dyn Fn(f64) -> Quantity + 'a>,
    /// The cause in each row.
    x: Vec<f64>,
    /// What one unit of the ordinate does to each row \[m\].
    levers: Vec<Vector3<f64>>,
    /// The ordinate at a value of the cause.
    law: Box<dyn Fn(f64) -> f64 + 'a>,
    reading: &'static str,
}

/// Every row with its conditions and what an effect does to it.
struct Rows<'a> {
    poses: Vec<PoseView<'a>>,
    /// The effect's displacement \[m\].
    own: Vec<Vector3<f64>>,
    parameters: &'a [EffectParameter],
    values: &'a [f64],
}

/// The cause of an effect at the fit of `problem`, which declares it.
pub fn of(
    found: &Effect,
    problem: &Problem,
    Closed { arm, left, levers }: Closed,
    poses: &Poses,
) -> Option<Cause> {
    let parameters = found.parameters(problem);
    let place = |parameter: &EffectParameter| {
        arm.model.parameters.iter().position(|own| own.name == parameter.name)
    };
    let places: Vec<usize> = parameters.iter().map(place).collect::<Option<_>>()?;
    let mut without = arm.clone();
    for &k in &places {
        without.x[k] = 0.0;
    }
    let with = poses.errors(&without, &poses.rows());
    let all = poses.all(1.0);
    let values: Vec<f64> = places.iter().map(|&k| arm.x[k]).collect();
    let rows = Rows {
        poses: all.iter().map(|pose| pose.setup).collect(),
        own: with.iter().zip(left).map(|(with, left)| with - left).collect(),
        parameters: &parameters,
        values: &values,
    };
    let view = at_joint(found, problem, &rows, levers, poses)
        .unwrap_or_else(|| elsewhere(found, problem, &rows));
    let most = view.levers.iter().map(Vector3::norm).fold(0.0, f64::max);
    let point = |k: usize| Point {
        x: view.x[k],
        y: along(&view.levers[k], &with[k]),
        held_out: poses.split.held_out.binary_search(&k).is_ok(),
        row: Some(k),
    };
    let telling = (0..with.len()).filter(|&k| view.levers[k].norm() > LEAST_LEVER * most);
    let points: Vec<Point> = telling.map(point).collect();
    let (low, high) = range(points.iter().map(|point| point.x));
    let at = |step: u32| low + (high - low) * f64::from(step) / f64::from(STEPS);
    let curve: Vec<(f64, f64)> =
        (0..=STEPS).filter(|_| low <= high).map(at).map(|x| (x, (view.law)(x))).collect();
    let up = (view.up)(largest(&points, &curve));
    let title = found.describe_in(poses.measurements.time_measured);
    Some(Cause { title, across: view.across, up, points, curve, reading: view.reading })
}

/// The change of a coordinate that explains a displacement best.
fn along(lever: &Vector3<f64>, displacement: &Vector3<f64>) -> f64 {
    lever.dot(displacement) / lever.norm_squared()
}

fn largest(points: &[Point], curve: &[(f64, f64)]) -> f64 {
    let heights = points.iter().map(|point| point.y).chain(curve.iter().map(|at| at.1));
    heights.filter(|height| height.is_finite()).map(f64::abs).fold(0.0, f64::max)
}

/// An effect that changes the coordinate of a joint.
fn at_joint<'a>(
    found: &Effect,
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
    // Δθ = c M, c₃ M³: the moment follows from the law itself.
    let moments = |joint: usize, of: fn(f64) -> f64| -> Vec<f64> {
        lever(joint)
            .iter()
            .zip(&rows.own)
            .map(|(lever, own)| of(along(lever, own) / first))
            .collect()
    };
    let in_proportion: Law = Box::new(move |x| first * x);
    let of_command: Law = Box::new(|q: f64| {
        let configuration = vec![q; rows.poses[0].configuration.len()];
        rows.driven(&PoseView::from_configuration(&configuration))
    });
    let (joint, across, x, law): (_, _, _, Law) = match *found {
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
                rows.driven(&PoseView {
                    temperature: Some(&t),
                    ..PoseView::from_configuration(&[])
                })
            });
            (joint, Quantity::temperature(), rows.temperatures(), law)
        }
        Effect::Covariate { joint: Mount::Joint(joint), ref of } => {
            let which = problem.data.covariates.iter().position(|own| own.name == *of)?;
            let values = each(&|pose| pose.covariates.get(which).copied().unwrap_or_default());
            (joint, Quantity::new(of, 1.0), values, in_proportion)
        }
        Effect::Backlash { joint } if poses.measurements.approach.is_some() => {
            let across =
                Quantity::new(format!("side from which joint {joint} came [−1 … +1]"), 1.0);
            let sides = each(&|pose| pose.approach.map_or(0.0, |all| all[joint - 1]));
            (joint, across, sides, Box::new(move |side| 0.5 * first * side))
        }
        Effect::PayloadBacklash { joint } => {
            let across = Quantity::new(
                format!("half the payload × side from which joint {joint} came [kg]"),
                1.0,
            );
            let regressor =
                Regressor::LoadedSide { joint: joint - 1, declared: problem.tool.payload_mass };
            (joint, across, each(&|pose| regressor.value(pose)), in_proportion)
        }
        Effect::JointHysteresis { joint, distance } => {
            let across = Quantity::new(
                format!("part of its friction that pulls joint {joint} back [−1 … +1]"),
                1.0,
            );
            let regressor = Regressor::Dragged { joint: joint - 1, distance };
            (joint, across, each(&|pose| regressor.value(pose)), in_proportion)
        }
        Effect::JointThermalDriftLag { joint, time_constant } => {
            let reference = problem.data.reference_temperature.unwrap_or_default();
            let felt = rows.felt(reference, time_constant);
            (
                joint,
                Quantity::lagging(time_constant),
                felt,
                Box::new(move |felt| first * (felt - reference)),
            )
        }
        Effect::JointCompliance { joint } => {
            (joint, moment(joint), moments(joint, |moment| moment), in_proportion)
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
    /// Σ value · regressor.
    fn driven(&self, pose: &PoseView) -> f64 {
        self.parameters
            .iter()
            .zip(self.values)
            .map(|(own, value)| value * own.regressor.value(pose))
            .sum()
    }

    /// Temperatures that lag.
    fn felt(&self, reference: f64, time_constant: f64) -> Vec<f64> {
        let regressor = Regressor::Lagging { reference, time_constant };
        self.poses.iter().map(|pose| regressor.value(pose) + reference).collect()
    }

    fn temperatures(&self) -> Vec<f64> {
        self.poses.iter().map(|pose| pose.temperature.copied().unwrap_or_default()).collect()
    }

    /// The effect's displacement over its size in each row; none where that is 0.
    fn over(&self, sizes: impl Iterator<Item = f64>) -> Vec<Vector3<f64>> {
        let lever = |(own, size): (&Vector3<f64>, f64)| {
            if size == 0.0 { Vector3::zeros() } else { own / size }
        };
        self.own.iter().zip(sizes).map(lever).collect()
    }
}

/// An effect that is no error of a joint's coordinate.
fn elsewhere<'a>(found: &Effect, problem: &Problem, rows: &'a Rows) -> View<'a> {
    let sum: f64 = rows.values.iter().sum();
    let norm = rows.values.iter().map(|value| value * value).sum::<f64>().sqrt();
    let elapsed: Vec<f64> = rows.poses.iter().map(|pose| pose.elapsed).collect();
    let last = elapsed.iter().copied().fold(0.0, f64::max);
    let most = rows
        .own
        .iter()
        .fold(Vector3::zeros(), |a: Vector3<f64>, b| if b.norm() > a.norm() { *b } else { a });
    let measured = |_| Quantity::new("displacement, measured [mm]", 1e3);
    // Of the measuring frame: every pose moves in one direction.
    let of_time = |law: Law<'a>| View {
        across: Quantity::elapsed(last),
        up: Box::new(measured),
        x: elapsed.clone(),
        levers: vec![most.try_normalize(0.0).unwrap_or_default(); rows.own.len()],
        law,
        reading: ALONG,
    };
    match found {
        Effect::LinkThermalBending { link }
        | Effect::LinkThermalExpansion { link }
        | Effect::LinkThermalBendingLag { link, .. }
        | Effect::LinkThermalExpansionLag { link, .. } => {
            let reference = problem.data.reference_temperature.unwrap_or_default();
            let (across, felt) = match found {
                Effect::LinkThermalBendingLag { time_constant, .. }
                | Effect::LinkThermalExpansionLag { time_constant, .. } => {
                    (Quantity::lagging(*time_constant), rows.felt(reference, *time_constant))
                }
                _ => (Quantity::temperature(), rows.temperatures()),
            };
            let bends = matches!(
                found,
                Effect::LinkThermalBending { .. } | Effect::LinkThermalBendingLag { .. }
            );
            let link = link.clone();
            // An expansion has one coefficient with a sign; a bending's two make one size.
            let size = if bends { norm } else { sum };
            View {
                across,
                up: if bends {
                    Box::new(move |most| {
                        Quantity::small(&format!("curvature of link {link}"), "rad/m", most)
                    })
                } else {
                    Box::new(move |_| Quantity::new(format!("strain of link {link} [10⁻⁶]"), 1e6))
                },
                levers: rows.over(felt.iter().map(|felt| size * (felt - reference))),
                x: felt,
                law: Box::new(move |t| size * (t - reference)),
                reading: SIZE,
            }
        }
        Effect::PayloadMass => View {
            across: Quantity::new("payload [kg]", 1.0),
            up: Box::new(|_| Quantity::new("missing mass [kg]", 1.0)),
            x: rows.poses.iter().map(|pose| pose.payload.copied().unwrap_or_default()).collect(),
            levers: rows.over(std::iter::repeat(sum)),
            law: Box::new(move |_| sum),
            reading: SIZE,
        },
        Effect::TrackerDrift => {
            let speed = if last > 0.0 { most.norm() / last } else { 0.0 };
            of_time(Box::new(move |t| speed * t))
        }
        Effect::TrackerSettling { time_constant } => {
            let (time_constant, size) = (*time_constant, norm);
            of_time(Box::new(move |t| size * (1.0 - (-t / time_constant).exp())))
        }
        Effect::StationShift { at_time } => {
            let first = rows.poses.first().map_or(0.0, |pose| pose.time - pose.elapsed);
            let (at, step) = (at_time - first, most.norm());
            of_time(Box::new(move |t| if t >= at { step } else { 0.0 }))
        }
        _ => View {
            across: Quantity::new("displacement by the law [mm]", 1e3),
            up: Box::new(measured),
            x: rows.own.iter().map(Vector3::norm).collect(),
            levers: rows.own.iter().map(|own| own.try_normalize(0.0).unwrap_or_default()).collect(),
            law: Box::new(|displacement| displacement),
            reading: ALONG,
        },
    }
}

/// The correction of structure without a cause, less its mean; none where it is no function of one
/// covariate, or of the order of the rows.
pub fn unexplained(left: &Unexplained, problem: &Problem, split: &Split) -> Option<Cause> {
    let of = left.correction.as_ref()?.curve.as_ref()?;
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
    let most = of.points.iter().map(|point| point.lever).fold(0.0, f64::max);
    let telling =
        of.points.iter().enumerate().filter(|(_, point)| point.lever > LEAST_LEVER * most);
    let point = |(k, point): (usize, &PartialResidual)| Point {
        x: point.covariate,
        y: point.value - mean,
        held_out: false,
        row: split.identification.get(k).copied(),
    };
    let points: Vec<Point> = telling.map(point).collect();
    let place = left.site?;
    let up = Quantity::error(&place.to_string(), of.unit);
    let title = format!("{place}: structure without a known cause");
    Some(Cause { title, across, up, points, curve, reading: COORDINATE })
}

/// The fitted law at a value, between the points of its curve; 0 without one.
fn at_law(curve: &[(f64, f64)], x: f64) -> f64 {
    let next = curve.partition_point(|at| at.0 < x);
    match (next.checked_sub(1).and_then(|k| curve.get(k)), curve.get(next)) {
        (Some(a), Some(b)) if b.0 > a.0 => a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0),
        (Some(one), _) | (None, Some(one)) => one.1,
        (None, None) => 0.0,
    }
}

impl Cause {
    /// Of an effect that was found, with its number.
    pub fn draw_effect(&self, number: usize, shown: &[usize]) -> Drawing {
        self.draw(
            shown,
            &format!("effect-{number}"),
            "fitted law",
            "Found by the loop; the line is the fitted law.",
        )
    }

    /// Of structure that no effect explains.
    pub fn draw_unexplained(&self, shown: &[usize]) -> Drawing {
        let lead = "No effect explains this; the line is the empirical correction. Its mean over this range is taken off line \
                    and dots: a constant is what base and geometry take up.";
        self.draw(shown, "unexplained", "correction", lead)
    }

    /// Each pose's own measurement, of the poses that figures show, and the law as a line.
    fn draw(&self, shown: &[usize], name: &str, law: &str, lead: &str) -> Drawing {
        let finite = |point: &&Point| point.x.is_finite() && point.y.is_finite();
        let all: Vec<&Point> = self.points.iter().filter(finite).collect();
        let at = |x: f64, y: f64| (x * self.across.factor, y * self.up.factor);
        let known = |k: &usize| all[*k].row.is_none_or(|row| shown.binary_search(&row).is_ok());
        let known: Vec<usize> = (0..all.len()).filter(known).collect();
        let kept = thin(&known, MOST, |k| all[k].y - at_law(&self.curve, all[k].x));
        let points: Vec<((f64, f64), &Point)> =
            kept.iter().map(|&k| (at(all[k].x, all[k].y), all[k])).collect();
        let curve: Vec<(f64, f64)> = self.curve.iter().map(|&(x, y)| at(x, y)).collect();
        let every_point = || points.iter().map(|(at, _)| *at).chain(curve.iter().copied());
        let x = with_margin(range(every_point().map(|at| at.0)), 0.04);
        let law_at = |x: f64| at_law(&curve, x);
        let most = reach(points.iter().map(|((x, y), _)| y - law_at(*x)));
        let near = |(x, y): &(f64, f64)| (y - law_at(*x)).abs() <= most;
        let close = points.iter().map(|(at, _)| *at).filter(near).chain(curve.iter().copied());
        let y = with_margin(range(close.map(|at| at.1)), 0.06);
        let is_beyond = |at: &(f64, f64)| at.1 < y.0 || at.1 > y.1;
        let outside = points.iter().filter(|(at, _)| is_beyond(at)).count();
        let tags = Tags::of_dots();
        let svg = figure((WIDTH, HEIGHT), &self.title, |area| {
            let held_out = points.iter().any(|(_, point)| point.held_out);
            let dots = [("fitted pose", FAINT, Mark::Dot), ("held-out pose", INK, Mark::Dot)];
            let dots = dots.into_iter().take(if held_out { 2 } else { 1 });
            let entries: Vec<_> = dots.chain([(law, ACCENT, Mark::Line)]).collect();
            let body = legend(area, 20, &entries)?;
            let mut chart = chart(
                &body,
                &Axis::linear(x, &self.across.label),
                &Axis::linear(y, &self.up.label),
            )?;
            if y.0 < 0.0 && y.1 > 0.0 {
                chart.draw_series([PathElement::new(
                    vec![(x.0, 0.0), (x.1, 0.0)],
                    line(FAINT, 1.0),
                )])?;
            }
            for (only, colour) in [(false, FAINT), (true, INK)] {
                for (at, point) in points.iter().filter(|(_, point)| point.held_out == only) {
                    let style = if is_beyond(at) { line(WARM, 1.4) } else { colour.filled() };
                    tags.pose(point.row);
                    chart.draw_series([Circle::new(
                        (at.0, at.1.clamp(y.0, y.1)),
                        pixels(2.2),
                        style,
                    )])?;
                }
            }
            chart.draw_series(LineSeries::new(curve.iter().copied(), line(ACCENT, 2.2)))?;
            note_beyond(&body, outside)
        });
        let mut letters = self.title.chars();
        let title = letters
            .next()
            .map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect());
        let caption =
            format!("{lead} {}{}{}", self.reading, beyond(outside), thinned(kept.len(), all.len()));
        let columns = ["held_out", self.across.label.as_str(), self.up.label.as_str()];
        let row = |(at, point): &((f64, f64), &Point)| {
            vec![point.held_out.to_string(), fixed(at.0, 6), fixed(at.1, 9)]
        };
        let sheet = Sheet::new(&columns, points.iter().map(row).collect());
        Drawing::new(name, &title, caption, tags.put(&svg)).with(sheet)
    }
}
