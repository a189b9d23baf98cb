//! Quantities and their units: SI inside, a suffix in files, a unit of a handy size for people.

mod unit;

pub(crate) use unit::Suffix;
pub use unit::{Display, Unit};
