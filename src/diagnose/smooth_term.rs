//! Smooth functions of what is known of a pose, at a place of the arm: what no catalogue holds.

use nalgebra::DMatrix;

use super::covariate::Place;
use super::data::Data;
use super::neighbourhood::Linearised;
use super::rules::SelectionRules;
use crate::model::parameter::{Driver, JointField, Quantity, Slot};
use crate::problem::PoseView;
use crate::problem::{JointKind, Problem};

/// Steps of a curve.
const CURVE: u32 = 100;

/// A smooth error at one place that depends on one quantity.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SmoothTerm {
    pub slot: Slot,
    pub of: Quantity,
    /// Range of the quantity in the identification poses.
    pub range: (f64, f64),
    /// Functions of the quantity that it is a sum of.
    pub functions: Vec<Driver>,
    /// How many of its kind are tried at each place.
    pub tries: usize,
    /// Parameters of the functions' shape that were fitted.
    pub fitted: usize,
}

impl SmoothTerm {
    /// Every place and quantity: cubic B-splines as fine as the poses allow, single bumps and single steps.
    pub fn all(problem: &Problem, data: &Data) -> Vec<Self> {
        let (mut all, rules) = (Vec::new(), data.rules);
        for of in quantities(problem, data) {
            let (range, distinct) = (data.range(of), data.distinct(of));
            if range.1 <= range.0 || distinct < 4 {
                continue;
            }
            let few = |intervals: usize| {
                (intervals + 3) * rules.poses_per_spline <= data.rows().len() && intervals + 3 <= distinct
            };
            let splines: Vec<Vec<Driver>> =
                rules.spline_intervals.into_iter().filter(|&n| few(n)).map(|n| splines(of, range, n)).collect();
            let shapes = if distinct > rules.shape_centres as usize { shapes(of, range, rules) } else { Vec::new() };
            for functions in [splines, shapes] {
                let tries = functions.len();
                for functions in functions {
                    let at = |slot| Self { slot, of, range, functions: functions.clone(), tries, fitted: 0 };
                    all.extend(places(problem).map(at));
                }
            }
        }
        all
    }

    /// A single bump or step with centre and width fitted: where `gain` is largest, by a search along both in turn.
    pub fn refined(mut self, rules: &SelectionRules, gain: impl Fn(&Self) -> f64) -> Self {
        let (Some(first), 1) = (self.functions.first().copied(), self.functions.len()) else { return self };
        let moved = |function: Driver, along: f64, wider: f64| match function {
            Driver::Bump { of, centre, width } => {
                Driver::Bump { of, centre: centre + along * width, width: width * wider }
            }
            Driver::Step { of, centre, width } => {
                Driver::Step { of, centre: centre + along * width, width: width * wider }
            }
            other => other,
        };
        let (mut function, mut step) = (first, rules.shape_steps.0);
        let mut best = gain(&self);
        while step > rules.shape_steps.1 {
            let moves = [(step, 1.0), (-step, 1.0), (0.0, 1.0 + step), (0.0, (1.0 + step).recip())];
            let tried = moves.map(|(along, wider)| {
                let function = moved(function, along, wider);
                (function, gain(&Self { functions: vec![function], ..self.clone() }))
            });
            let (next, found) = tried.into_iter().fold((function, best), |a, b| if b.1 > a.1 { b } else { a });
            if found > best {
                (function, best) = (next, found);
            } else {
                step /= 2.0;
            }
        }
        // What was fitted is counted as fitted, not as tried.
        (self.functions, self.tries, self.fitted) = (vec![function], 2, 2);
        self
    }

    /// Whether it is a single bump or step.
    pub fn is_single(&self) -> bool {
        self.functions.len() == 1
    }

    /// Whether a pose is within the range that the identification poses cover.
    pub fn reaches(&self, setup: &PoseView) -> bool {
        (self.range.0..=self.range.1).contains(&self.of.value(setup))
    }

    /// Its columns: those of the place times its functions, shape = (3 N, functions); beyond the range they keep their last
    /// values.
    pub fn columns(&self, linearised: &Linearised) -> DMatrix<f64> {
        let poses = linearised.poses();
        let mut columns = DMatrix::zeros(3 * poses.len(), self.functions.len());
        let Some(place) = linearised.place(self.slot) else { return columns };
        for (function, mut out) in self.functions.iter().zip(columns.column_iter_mut()) {
            for (k, pose) in poses.iter().enumerate() {
                let value = function.at(self.of.value(&pose.setup).clamp(self.range.0, self.range.1));
                for row in 3 * k..3 * k + 3 {
                    out[row] = place[row] * value;
                }
            }
        }
        columns
    }

    /// The function that these coefficients make, at a hundred values over the range.
    pub fn curve(&self, coefficients: &[f64]) -> Vec<(f64, f64)> {
        let value = |k| self.range.0 + (self.range.1 - self.range.0) * f64::from(k) / f64::from(CURVE);
        (0..=CURVE).map(value).map(|value| (value, self.at(coefficients, value))).collect()
    }

    /// Where it is.
    pub fn place(&self) -> Place {
        Place::of(self.slot)
    }

    /// The function that these coefficients make, at a value of the quantity; beyond the range it keeps its last value.
    pub fn at(&self, coefficients: &[f64], value: f64) -> f64 {
        let value = value.clamp(self.range.0, self.range.1);
        coefficients.iter().zip(&self.functions).map(|(c, function)| c * function.at(value)).sum()
    }
}

/// Every place where a smooth error may be.
pub(super) fn places(problem: &Problem) -> impl Iterator<Item = Slot> + '_ {
    (0..problem.joints.len())
        .flat_map(|joint| JointField::GEOMETRY.into_iter().map(move |field| Slot::Joint { joint, field }))
}

fn quantities(problem: &Problem, data: &Data) -> Vec<Quantity> {
    let moving = problem.joints.iter().enumerate().filter(|(_, joint)| joint.kind != JointKind::Fixed);
    let mut all: Vec<Quantity> = moving.map(|(joint, _)| Quantity::Command(joint)).collect();
    let columns = [
        (Quantity::Temperature, &data.measurements.temperature),
        (Quantity::Payload, &data.measurements.payload),
        (Quantity::Hoist, &data.measurements.hoist),
    ];
    all.extend(columns.into_iter().filter(|(_, column)| column.is_some()).map(|(quantity, _)| quantity));
    all.push(Quantity::Elapsed);
    all
}

fn splines(of: Quantity, (low, high): (f64, f64), intervals: usize) -> Vec<Driver> {
    let step = (high - low) / intervals as f64;
    (0..intervals + 3).map(|k| Driver::Spline { of, begin: low + (k as f64 - 3.0) * step, step }).collect()
}

fn shapes(of: Quantity, (low, high): (f64, f64), rules: &SelectionRules) -> Vec<Vec<Driver>> {
    let count = rules.shape_centres;
    let centre = |k: u32| low + (high - low) * (f64::from(k) + 0.5) / f64::from(count);
    let of_width = |part: f64| {
        let width = part * (high - low);
        (0..count).map(centre).flat_map(move |centre| {
            [vec![Driver::Bump { of, centre, width }], vec![Driver::Step { of, centre, width }]]
        })
    };
    rules.shape_widths.into_iter().flat_map(of_width).collect()
}
