//! Which effects the residual of a fit points to, without fitting any of them.

mod library;
mod linear;
mod open;
mod scan;
mod score;

pub(super) use library::Library;
pub(super) use linear::Linear;
pub(super) use open::open;
pub(super) use scan::{Scan, Tried, tries};
pub(super) use score::{Gain, LEAST_SCATTER};
