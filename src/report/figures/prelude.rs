//! What figures are drawn with: plotters, paper and axes, the numbers beside a drawing, and numbers
//! in words.

pub use plotters::prelude::*;
pub use plotters::style::text_anchor::HPos;

pub use super::frame::{
    ACCENT, Area, Axis, BELOW, Drawing, FAINT, Failure, GRID, INK, LEFT, MUTED, Mark, TEXT, WARM,
    WIDTH, band, chart, figure, legend, line, note_beyond, pixels, px, range, round_numbers,
    stacked, upright, with_margin, write, write_sized,
};
pub use super::sheet::Sheet;
pub use super::tags::Tags;
pub(in crate::report) use crate::report::quantity::{decimals, fixed, mm, number, two_digits};
