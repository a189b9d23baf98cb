//! Physical quantities and their units: SI inside the program, unit suffixes in files, convenient
//! units on screens.

mod right_angle;
mod unit;

pub(crate) use right_angle::rounded_right_angle;
pub(crate) use unit::Display;
pub(crate) use unit::Suffix;
pub use unit::Unit;
