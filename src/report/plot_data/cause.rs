//! The residual against what drives an effect: each pose's own measurement of the effect, and the law that was fitted.
//!
//! Shown is the partial residual: what the fit leaves, with the effect's own part put back. At a joint it is turned into the
//! error of the joint's coordinate by the lever of each pose; elsewhere it is the part along the effect's displacement.

use nalgebra::Vector3;

use super::joint::{along, levers, telling};
use super::states::{Arm, Sight};
use crate::model::parameter::{EffectParameter, JointField, Slot};
use crate::problem::PoseView;
use crate::problem::{Effect, JointKind, Problem};
use crate::quantity::Unit;

/// Steps of a curve.
const STEPS: u32 = 160;

/// What a picture of a cause has from left to right; joints counted from 1, SI units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Abscissa {
    /// Command of a joint [rad] or, where it slides, [m].
    Command {
        /// Which.
        joint: usize,
        /// Whether it slides.
        slides: bool,
    },
    /// Side from which a joint came, −1, 0 or +1.
    Approach(usize),
    /// Moment about a joint's axis [N·m].
    Moment(usize),
    /// Temperature [°C].
    Temperature,
    /// Time since the first pose [s].
    Elapsed,
    /// Payload [kg].
    Payload,
    /// Hoist force [N].
    Hoist,
    /// Displacement that the law gives [m].
    Displacement,
}

/// What it has from bottom to top, SI units.
#[derive(Debug, Clone, PartialEq)]
pub enum Ordinate {
    /// Error of a joint's coordinate.
    Joint {
        /// Which, counted from 1.
        joint: usize,
        /// [rad] or [m].
        unit: Unit,
    },
    /// Error of one coordinate of a place.
    Place {
        /// Where, in words.
        place: String,
        /// [rad] or [m].
        unit: Unit,
    },
    /// Curvature of a link [1/m].
    Curvature(String),
    /// Strain of a link.
    Strain(String),
    /// Mass [kg].
    Mass,
    /// Displacement along the effect's own direction [m].
    Displacement,
}

/// One pose's own measurement of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Value of the abscissa.
    pub x: f64,
    /// Value of the ordinate.
    pub y: f64,
    /// Whether the pose was held out.
    pub held_out: bool,
}

/// The residual against the cause of an effect.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// The effect in words.
    pub title: String,
    /// From left to right.
    pub abscissa: Abscissa,
    /// From bottom to top.
    pub ordinate: Ordinate,
    /// Poses that say something about it, in the order of the rows.
    pub points: Vec<Point>,
    /// The fitted law.
    pub curve: Vec<(f64, f64)>,
}

/// How an effect is looked at.
struct View<'a> {
    abscissa: Abscissa,
    ordinate: Ordinate,
    /// The abscissa of a pose.
    x: Box<dyn Fn(usize) -> f64 + 'a>,
    /// What one unit of the ordinate does to each pose [m].
    levers: Vec<Vector3<f64>>,
    /// The ordinate at an abscissa.
    law: Box<dyn Fn(f64) -> f64 + 'a>,
}

/// Every row with its conditions and what an effect does to it.
struct Rows<'a> {
    setups: Vec<PoseView<'a>>,
    /// The effect's displacement [m].
    own: Vec<Vector3<f64>>,
    /// The residual with that displacement put back [m].
    with: Vec<Vector3<f64>>,
}

/// The picture of an effect's cause at the fit of `problem`, which declares it.
pub(super) fn of(found: &Effect, problem: &Problem, arm: &Arm, sight: &Sight) -> Option<Cause> {
    let parameters = found.parameters(problem);
    let place = |parameter: &EffectParameter| arm.model.parameters.iter().position(|own| own.name == parameter.name);
    let places: Vec<usize> = parameters.iter().map(place).collect::<Option<_>>()?;
    let mut without = arm.clone();
    for &k in &places {
        without.x[k] = 0.0;
    }
    let all: Vec<usize> = (0..sight.measurements.len()).collect();
    let (left, with) = (sight.errors(arm, &all), sight.errors(&without, &all));
    let poses = sight.placement.poses(sight.measurements, &all, 1.0);
    let rows = Rows {
        setups: poses.iter().map(|pose| pose.setup).collect(),
        own: with.iter().zip(&left).map(|(with, left)| with - left).collect(),
        with,
    };
    let values: Vec<f64> = places.iter().map(|&k| arm.x[k]).collect();
    let view = match at_joint(found, problem, sight.measurements.approach.is_some()) {
        Some((joint, abscissa, slot)) => {
            let unit =
                if matches!(slot, Slot::Joint { field: JointField::D, .. }) { Unit::Length } else { Unit::Angle };
            let levers = levers(arm, sight, &all, slot);
            let (x, law) = joint_law(found, abscissa, &rows, &levers, &parameters, &values);
            View { abscissa, ordinate: Ordinate::Joint { joint, unit }, x, levers, law }
        }
        None => elsewhere(found, problem, &rows, &values),
    };
    Some(view.cause(found.describe_in(sight.measurements.time_measured), &rows, sight))
}

/// The joint whose coordinate an effect changes, what it depends on, and the coordinate.
fn at_joint(found: &Effect, problem: &Problem, approach_known: bool) -> Option<(usize, Abscissa, Slot)> {
    let slides = |joint: usize| problem.joints[joint - 1].kind == JointKind::Prismatic;
    let (joint, abscissa) = match *found {
        Effect::JointHarmonic { joint, .. } | Effect::GearRatio { joint } => {
            (joint, Abscissa::Command { joint, slides: slides(joint) })
        }
        Effect::JointCoupling { joint, from } => (joint, Abscissa::Command { joint: from, slides: slides(from) }),
        Effect::JointThermalDrift { joint } => (joint, Abscissa::Temperature),
        Effect::Backlash { joint } if approach_known => (joint, Abscissa::Approach(joint)),
        Effect::JointCompliance { joint } | Effect::JointNonlinearStiffness { joint } => {
            (joint, Abscissa::Moment(joint))
        }
        _ => return None,
    };
    let field = if slides(joint) { JointField::D } else { JointField::Theta };
    Some((joint, abscissa, Slot::Joint { joint: joint - 1, field }))
}

type OfRow<'a> = Box<dyn Fn(usize) -> f64 + 'a>;
type Law<'a> = Box<dyn Fn(f64) -> f64 + 'a>;

/// The abscissa of each row and the law of an effect at a joint's coordinate.
fn joint_law<'a>(
    found: &Effect,
    abscissa: Abscissa,
    rows: &'a Rows,
    levers: &[Vector3<f64>],
    parameters: &'a [EffectParameter],
    values: &'a [f64],
) -> (OfRow<'a>, Law<'a>) {
    let first = values.first().copied().unwrap_or_default();
    let own: Vec<f64> = levers.iter().zip(&rows.own).map(|(lever, own)| along(lever, own)).collect();
    match (found, abscissa) {
        // Δθ = c₃ M³, c M: the moment follows from the law itself.
        (Effect::JointNonlinearStiffness { .. }, _) => {
            (Box::new(move |k| (own[k] / first).cbrt()), Box::new(move |moment| first * moment.powi(3)))
        }
        (Effect::JointCompliance { .. }, _) => {
            (Box::new(move |k| own[k] / first), Box::new(move |moment| first * moment))
        }
        (_, Abscissa::Approach(joint)) => (
            Box::new(move |k| rows.setups[k].approach.map_or(0.0, |all| all[joint - 1])),
            Box::new(move |side| 0.5 * first * side),
        ),
        (_, Abscissa::Command { joint, .. }) => (
            Box::new(move |k| rows.setups[k].configuration[joint - 1]),
            Box::new(move |q| {
                let configuration = vec![q; rows.setups[0].configuration.len()];
                driven(parameters, values, &PoseView::of(&configuration))
            }),
        ),
        _ => (
            Box::new(move |k| rows.setups[k].temperature.unwrap_or_default()),
            Box::new(move |t| driven(parameters, values, &PoseView { temperature: Some(t), ..PoseView::of(&[]) })),
        ),
    }
}

/// Σ value · driver.
fn driven(parameters: &[EffectParameter], values: &[f64], setup: &PoseView) -> f64 {
    parameters.iter().zip(values).map(|(parameter, value)| value * parameter.driver.value(setup)).sum()
}

/// How an effect is looked at that is at no joint's coordinate.
fn elsewhere<'a>(found: &Effect, problem: &Problem, rows: &'a Rows, values: &[f64]) -> View<'a> {
    let size = values.iter().map(|value| value * value).sum::<f64>().sqrt();
    let scaled = |by: &dyn Fn(&PoseView) -> f64| -> Vec<Vector3<f64>> {
        let lever = |(own, setup): (&Vector3<f64>, &PoseView)| {
            if by(setup) == 0.0 { Vector3::zeros() } else { own / by(setup) }
        };
        rows.own.iter().zip(&rows.setups).map(lever).collect()
    };
    let elapsed: OfRow = Box::new(|k: usize| rows.setups[k].elapsed);
    let most =
        rows.own.iter().copied().fold(Vector3::zeros(), |a: Vector3<f64>, b| if b.norm() > a.norm() { b } else { a });
    let direction = || vec![most.try_normalize(0.0).unwrap_or_default(); rows.own.len()];
    match found {
        Effect::LinkThermalBending { link } | Effect::LinkThermalExpansion { link } => {
            let reference = problem.data.reference_temperature.unwrap_or_default();
            let bends = matches!(found, Effect::LinkThermalBending { .. });
            // An expansion has one coefficient with a sign; a bending's two make one size.
            let size = if bends { size } else { values.iter().sum() };
            View {
                abscissa: Abscissa::Temperature,
                ordinate: if bends { Ordinate::Curvature(link.clone()) } else { Ordinate::Strain(link.clone()) },
                x: Box::new(|k| rows.setups[k].temperature.unwrap_or_default()),
                levers: scaled(&|setup| size * (setup.temperature.unwrap_or(reference) - reference)),
                law: Box::new(move |t| size * (t - reference)),
            }
        }
        Effect::PayloadMass => {
            let mass: f64 = values.iter().sum();
            View {
                abscissa: Abscissa::Payload,
                ordinate: Ordinate::Mass,
                x: Box::new(|k| rows.setups[k].payload.unwrap_or_default()),
                levers: scaled(&|_| mass),
                law: Box::new(move |_| mass),
            }
        }
        Effect::TrackerDrift => {
            let last = rows.setups.iter().map(|setup| setup.elapsed).fold(0.0, f64::max);
            let speed = if last > 0.0 { most.norm() / last } else { 0.0 };
            let law: Law = Box::new(move |t| speed * t);
            View { abscissa: Abscissa::Elapsed, ordinate: Ordinate::Displacement, x: elapsed, levers: direction(), law }
        }
        Effect::StationShift { at_time } => {
            let first = rows.setups.first().map_or(0.0, |setup| setup.time - setup.elapsed);
            let (at, step) = (at_time - first, most.norm());
            let law: Law = Box::new(move |t| if t >= at { step } else { 0.0 });
            View { abscissa: Abscissa::Elapsed, ordinate: Ordinate::Displacement, x: elapsed, levers: direction(), law }
        }
        _ => View {
            abscissa: Abscissa::Displacement,
            ordinate: Ordinate::Displacement,
            x: Box::new(|k| rows.own[k].norm()),
            levers: rows.own.iter().map(|own| own.try_normalize(0.0).unwrap_or_default()).collect(),
            law: Box::new(|displacement| displacement),
        },
    }
}

impl View<'_> {
    fn cause(self, title: String, rows: &Rows, sight: &Sight) -> Cause {
        let telling = telling(&self.levers);
        let point = |k: usize| Point {
            x: (self.x)(k),
            y: along(&self.levers[k], &rows.with[k]),
            held_out: sight.split.held_out.binary_search(&k).is_ok(),
        };
        let points: Vec<Point> = (0..rows.own.len()).filter(|&k| telling[k]).map(point).collect();
        let (low, high) = points
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), point| (low.min(point.x), high.max(point.x)));
        let at = |step: u32| low + (high - low) * f64::from(step) / f64::from(STEPS);
        let curve = if low <= high { (0..=STEPS).map(at).map(|x| (x, (self.law)(x))).collect() } else { Vec::new() };
        Cause { title, abscissa: self.abscissa, ordinate: self.ordinate, points, curve }
    }
}
