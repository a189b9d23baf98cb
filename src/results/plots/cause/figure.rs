//! Partial residuals of an effect with its fitted law.

use super::axis::Quantity;

/// Partial residual of one pose, SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Value of the regressor in the pose, SI.
    pub x: f64,
    /// Partial residual of the pose, SI.
    pub y: f64,
    /// True for a held-out pose.
    pub held_out: bool,
    /// Row of the pose, counted from 0, if known.
    pub row: Option<usize>,
}

/// Figure data of an effect: partial residuals over its regressor, with the fitted law.
#[derive(Debug, Clone, PartialEq)]
pub struct Cause {
    /// Description of the effect.
    pub title: String,
    /// Quantity on the horizontal axis.
    pub across: Quantity,
    /// Quantity on the vertical axis.
    pub up: Quantity,
    /// Poses that depend on the effect, in the order of the rows.
    pub points: Vec<Point>,
    /// Points of the fitted law.
    pub curve: Vec<(f64, f64)>,
    /// Sentence of the caption that explains what a dot shows.
    pub(crate) reading: &'static str,
}
