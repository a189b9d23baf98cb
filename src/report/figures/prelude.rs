//! Common imports of the figures: charts and axes, data sheets, and formatted numbers.

pub use super::axis::{Axis, axis_limit, with_margin};
pub use super::chart::{Mark, Panel, Shape, WIDTH, chart, poses_legend};
pub use super::drawing::{Drawing, beyond_note, omission_note, pose_sheet, sheet, thinning_note};
pub use super::svg::{ACCENT, Anchor, Colour, FAINT, GRID, INK, MUTED, Paint, TEXT, WARM};
pub(super) use crate::numeric::range;
pub(super) use crate::quantity::format::{decimals, fixed, mm, number, two_digits};
pub(super) use crate::results::{PlotData, PoseError, sample};
