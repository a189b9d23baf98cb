//! Physical quantities and their units: SI inside the program, unit suffixes in files, convenient
//! units on screens.

mod unit;

pub(crate) use unit::Suffix;
pub use unit::{Display, Unit};
