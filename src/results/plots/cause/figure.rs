//! Partial residuals of an effect with its fitted law.

use super::axis::Quantity;

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
