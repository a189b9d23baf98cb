//! Common imports of the figures: plotters, canvas and axes, data sheets, and formatted numbers.

pub use plotters::prelude::*;
pub use plotters::style::text_anchor::HPos;

pub use super::frame::{
    ACCENT, Area, Axis, BELOW, Drawing, FAINT, Failure, GRID, INK, LEFT, MUTED, Mark, TEXT, WARM,
    WIDTH, band, chart, figure, legend, line, note_beyond, pixels, px, range, round_numbers,
    stacked, vertical_line, with_margin, write, write_sized,
};
pub use super::sheet::Sheet;
pub use super::tags::Tags;
pub(in crate::report) use crate::report::quantity::{decimals, fixed, mm, number, two_digits};
