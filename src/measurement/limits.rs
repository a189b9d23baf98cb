//! Commands beyond the ranges of their joints, and beyond what joints do at all.

use super::Measurements;
use crate::error::{Warning, WarningKind};
use crate::problem::{JointKind, Problem};

/// How far beyond its limit a command may be for rounding alone \[rad\] or \[m\].
const ROUNDING: f64 = 1e-6;
/// Turns from zero that hardly any arm makes.
const MANY_TURNS: f64 = 2.0;
/// A temperature \[°C\] at which no arm is calibrated, and below that of a cold room in kelvins.
const HOT: f64 = 200.0;

/// The column of a joint's commands.
pub(super) struct Commands<'a> {
    /// Joint, counted from 0.
    pub joint: usize,
    /// Name of the column: `q2_deg`.
    pub name: &'a str,
    /// Conversion to the SI unit.
    pub to_si: fn(f64) -> f64,
}

impl Commands<'_> {
    fn unit(&self) -> &str {
        self.name.rsplit_once('_').map_or("", |(_, unit)| unit)
    }

    /// An SI value in the unit of the column; conversions round, and nobody writes more decimals.
    fn shown(&self, value: f64) -> f64 {
        (value / (self.to_si)(1.0) * 1e6).round() / 1e6
    }

    /// The limits of the joint as its section would write them in the unit of the column.
    fn limits(&self, (min, max): (f64, f64)) -> String {
        let limit = |(key, limit): (&str, f64)| {
            limit.is_finite().then(|| format!("{key}_{} = {}", self.unit(), self.shown(limit)))
        };
        [("min", min), ("max", max)].into_iter().filter_map(limit).collect::<Vec<_>>().join(", ")
    }
}

impl Measurements {
    /// A warning where temperatures are those of an oven, or in another unit, at the row of the
    /// least.
    pub(super) fn kelvins(&self) -> Option<Warning> {
        let (row, &least) = self
            .temperature
            .iter()
            .flatten()
            .enumerate()
            .min_by(|(_, a), (_, b)| a.total_cmp(b))?;
        let location = self.location(row).with_key("temperature_C");
        (least > HOT)
            .then(|| Warning { location, kind: WarningKind::Kelvins { least: format!("{least}") } })
    }

    /// A warning where columns in radians turn a joint further than joints turn, at the row that is
    /// furthest off.
    pub(super) fn many_turns(&self, problem: &Problem, columns: &[Commands]) -> Option<Warning> {
        let is_angle = |column: &&Commands| {
            column.unit() == "rad"
                && problem
                    .joints
                    .get(column.joint)
                    .is_some_and(|own| own.commanded() == JointKind::Revolute)
        };
        let value =
            |row: usize, joint: usize| self.configuration(row).get(joint).copied().unwrap_or(0.0);
        let every = columns
            .iter()
            .filter(is_angle)
            .flat_map(|column| (0..self.len()).map(move |row| (column, row)));
        let (column, row) = every.max_by(|(a, i), (b, j)| {
            value(*i, a.joint).abs().total_cmp(&value(*j, b.joint).abs())
        })?;
        let turns = value(row, column.joint).abs() / std::f64::consts::TAU;
        let kind = WarningKind::ManyTurns {
            value: format!("{} = {}", column.name, column.shown(value(row, column.joint))),
            turns: format!("{turns:.0}"),
        };
        let location = self.location(row).with_key(format!("joint {}", column.joint + 1));
        (turns > MANY_TURNS).then_some(Warning { location, kind })
    }

    /// A warning for each joint that was commanded beyond its declared range, at the row that is
    /// furthest beyond.
    pub(super) fn beyond_limits(&self, problem: &Problem, columns: &[Commands]) -> Vec<Warning> {
        let warning = |column: &Commands| {
            let (min, max) = problem.joints.get(column.joint)?.limits;
            let value =
                |row: usize| self.configuration(row).get(column.joint).copied().unwrap_or(0.0);
            let beyond = |row: usize| (min - value(row)).max(value(row) - max);
            let rows: Vec<usize> = (0..self.len()).filter(|&row| beyond(row) > ROUNDING).collect();
            // The first of equals.
            let worst = *rows.iter().rev().max_by(|&&a, &&b| beyond(a).total_cmp(&beyond(b)))?;
            let location = self.location(worst).with_key(format!("joint {}", column.joint + 1));
            let kind = WarningKind::BeyondLimits {
                rows: rows.len(),
                worst: format!("{} = {}", column.name, column.shown(value(worst))),
                limits: column.limits((min, max)),
            };
            Some(Warning { location, kind })
        };
        columns.iter().filter_map(warning).collect()
    }
}
