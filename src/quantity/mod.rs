//! Quantities and their units: SI inside, a suffix at every boundary.

pub(crate) mod suffix;
