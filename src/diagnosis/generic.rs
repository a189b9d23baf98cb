//! Smooth functions of what is known of a pose, at a place of the arm: what no catalogue holds.

use nalgebra::DMatrix;

use super::data::Data;
use super::trace::Library;
use crate::arm::Setup;
use crate::parameter::{Driver, JointField, Quantity, Slot, cubic};
use crate::problem::{JointKind, Problem};

/// Numbers of intervals that are tried.
const INTERVALS: [usize; 3] = [3, 5, 8];
/// Poses per spline at least.
const POSES_PER_SPLINE: usize = 3;

/// Steps of a curve.
const CURVE: u32 = 100;

/// A smooth error at one place that depends on one quantity.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Generic {
    pub slot: Slot,
    pub of: Quantity,
    /// Range of the quantity in the identification poses.
    pub range: (f64, f64),
    pub intervals: usize,
}

impl Generic {
    /// Every place and quantity, with as many splines as the poses allow.
    pub fn all(problem: &Problem, data: &Data) -> Vec<Self> {
        let mut all = Vec::new();
        for of in quantities(problem, data) {
            let range = data.range(of);
            let distinct = data.distinct(of);
            if range.1 <= range.0 {
                continue;
            }
            for intervals in INTERVALS {
                let splines = intervals + 3;
                if splines * POSES_PER_SPLINE <= data.rows().len() && splines <= distinct {
                    all.extend(places(problem).map(|slot| Self { slot, of, range, intervals }));
                }
            }
        }
        all
    }

    /// Whether it corrects a pose: nothing is said beyond the range that the identification poses cover.
    pub fn reaches(&self, setup: &Setup) -> bool {
        (self.range.0..=self.range.1).contains(&self.of.value(setup))
    }

    /// Its columns: those of the place times cubic B-splines over the range, shape = (3 N, splines).
    pub fn columns(&self, library: &Library) -> DMatrix<f64> {
        let step = (self.range.1 - self.range.0) / self.intervals as f64;
        let place = library.place(self.slot);
        let poses = library.poses();
        let splines = self.intervals + 3;
        let mut columns = DMatrix::zeros(3 * poses.len(), splines);
        let Some(place) = place else { return columns };
        for (spline, mut out) in columns.column_iter_mut().enumerate() {
            let begin = self.range.0 + (spline as f64 - 3.0) * step;
            let driver = Driver::Spline { of: self.of, begin, step };
            for (k, pose) in poses.iter().enumerate().filter(|(_, pose)| self.reaches(&pose.setup)) {
                let value = driver.value(&pose.setup);
                for row in 3 * k..3 * k + 3 {
                    out[row] = place[row] * value;
                }
            }
        }
        columns
    }

    /// Number of its columns.
    pub fn splines(&self) -> usize {
        self.intervals + 3
    }

    /// The function that these coefficients make, at a hundred values over the range.
    pub fn curve(&self, coefficients: &[f64]) -> Vec<(f64, f64)> {
        let step = (self.range.1 - self.range.0) / self.intervals as f64;
        let at = |value: f64| {
            let spline = |(k, c): (usize, &f64)| c * cubic((value - self.range.0) / step + 3.0 - k as f64);
            coefficients.iter().enumerate().map(spline).sum::<f64>()
        };
        (0..=CURVE)
            .map(|k| self.range.0 + (self.range.1 - self.range.0) * f64::from(k) / f64::from(CURVE))
            .map(|v| (v, at(v)))
            .collect()
    }

    /// Where it is, in words.
    pub fn place(&self) -> String {
        match self.slot {
            Slot::Joint { joint, field: JointField::Alpha | JointField::A } => {
                format!("link before joint {}", joint + 1)
            }
            Slot::Joint { joint, .. } => format!("joint {}", joint + 1),
            _ => "measurement".to_owned(),
        }
    }

    /// What it depends on, as the files name it.
    pub fn depends_on(&self) -> String {
        match self.of {
            Quantity::Command(joint) => format!("q{}", joint + 1),
            Quantity::Temperature => "temperature".to_owned(),
            Quantity::Elapsed => "time".to_owned(),
            Quantity::Payload => "payload".to_owned(),
            Quantity::Hoist => "hoist".to_owned(),
        }
    }
}

/// Every place where a generic error may be.
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
