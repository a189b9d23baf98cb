//! Physical quantities and their units: SI inside the program, unit suffixes in files, convenient
//! units on screens.

mod foreign;
pub(crate) mod format;
mod quotient;
mod right_angle;
mod unit;

pub use quotient::Quotient;
pub(crate) use right_angle::unrounded_right_angle;
pub use unit::Unit;
pub(crate) use unit::{Display, Suffix, TableUnit};
