//! Common imports of the figures: charts and axes, CSV data, and formats of numbers.

pub use super::axis::{Axis, axis_limit, with_margin};
pub use super::chart::{FIGURE_WIDTH, Mark, Panel, Shape, chart, poses_legend};
pub use super::drawing::{
    Drawing, beyond_note, omission_note, pose_sheet, shades, sheet, thinning_note,
};
pub use super::svg::{
    ACCENT, Anchor, Colour, FAINT, GRID, INK, MUTED, Paint, TEXT_SIZE, WARM, text_width,
};
pub(super) use crate::numeric::range;
pub(super) use crate::quantity::format::{decimals, fixed, number, two_digits};
pub(super) use crate::results::{PlotData, PoseError, sample};
