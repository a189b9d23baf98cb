//! Which effects the residual of a fit points to, without fitting any of them.

mod library;
mod linear;
mod scan;

pub(super) use library::Library;
pub(super) use linear::{Gain, Linear};
pub(super) use scan::{Scan, Tried, tries};
