//! Figure of a cause: its points, its law, and its axes.

use crate::problem::{JointKind, Problem};
use crate::quantity::Unit;

/// Partial residual of one pose, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Abscissa: value of the effect's regressor in the pose, SI.
    pub x: f64,
    /// Ordinate: partial residual of the pose, SI.
    pub y: f64,
    /// True for a held-out pose.
    pub held_out: bool,
    /// Row of the pose, counted from 0; `None` if it is unknown.
    pub row: Option<usize>,
}

/// Figure data of an effect, or of structure without a known cause: partial residuals over the
/// regressor, with the fitted law.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// Description of the effect.
    pub title: String,
    /// Index (from 0) of the effect among those that the loop found; `None` for structure without a
    /// known cause.
    pub found: Option<usize>,
    /// Quantity on the horizontal axis.
    pub across: Quantity,
    /// Quantity on the vertical axis.
    pub up: Quantity,
    /// Partial residuals of the poses that depend on the effect.
    pub points: Vec<Point>,
    /// Points (abscissa, ordinate) of the fitted law, SI.
    pub curve: Vec<(f64, f64)>,
    /// Sentence of the caption that explains what a dot shows.
    pub(crate) reading: &'static str,
}

/// Factor from rad to °.
const DEGREES_PER_RADIAN: f64 = 180.0 / std::f64::consts::PI;

/// Quantity along an axis: its label and the factor from SI to the unit shown.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// Label with the unit, for example `temperature [°C]`.
    pub label: String,
    /// Factor from SI to the unit of the label.
    pub factor: f64,
}

impl Quantity {
    pub(super) fn new(label: impl Into<String>, factor: f64) -> Self {
        Self { label: label.into(), factor }
    }

    /// Returns the axis of the command of a joint, numbered from 1.
    pub(super) fn command(problem: &Problem, joint: usize) -> Self {
        let (unit, factor) =
            if is_prismatic(problem, joint) { ("mm", 1e3) } else { ("°", DEGREES_PER_RADIAN) };
        Self::new(format!("command of joint {joint}, q{joint} [{unit}]"), factor)
    }

    pub(super) fn temperature() -> Self {
        Self::new("temperature [°C]", 1.0)
    }

    /// Returns the axis of a lagged temperature with this time constant \[s\].
    pub(super) fn lagging(time_constant: f64) -> Self {
        Self::new(format!("temperature that lags by {time_constant} s [°C]"), 1.0)
    }

    /// Returns the axis of the time since the first pose, in hours if the `longest` \[s\] exceeds
    /// two hours.
    pub(super) fn elapsed(longest: f64) -> Self {
        let (unit, factor) = if longest > 7200.0 { ("h", 1.0 / 3600.0) } else { ("s", 1.0) };
        Self::new(format!("time since the first pose [{unit}]"), factor)
    }

    /// Returns the axis of the error of the coordinate with the name `of`, in mm or °.
    pub(super) fn error(of: &str, unit: Unit) -> Self {
        match unit {
            Unit::Length => Self::new(format!("error of {of} [mm]"), 1e3),
            // Angles have the unit of the tables.
            _ => Self::new(format!("error of {of} [°]"), DEGREES_PER_RADIAN),
        }
    }

    /// Returns the axis of a small quantity `what`, whose `largest` value in `unit` determines the
    /// prefix µ or m.
    pub(super) fn small(what: &str, unit: &str, largest: f64) -> Self {
        let (prefix, factor) = if largest < 1e-3 { ('µ', 1e6) } else { ('m', 1e3) };
        Self::new(format!("{what} [{prefix}{unit}]"), factor)
    }
}

/// Returns true if a joint, numbered from 1, is prismatic.
pub(super) fn is_prismatic(problem: &Problem, joint: usize) -> bool {
    problem.joints[joint - 1].kind == JointKind::Prismatic
}
