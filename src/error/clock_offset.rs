//! Offset between the clocks of two tables that are joined by time.

use std::fmt;

/// Offset of the clock of a joint table with which its rows pair with those of the measurements.
#[doc(hidden)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClockOffset {
    /// Value of `offset_s` \[s\].
    pub seconds: f64,
    /// Larger value of `tolerance_s` that the rows need \[s\]; `None` if the present one is enough.
    pub tolerance: Option<f64>,
    /// True if so many rows pair so closely that no other pairs are likely.
    pub is_clear: bool,
}

impl fmt::Display for ClockOffset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "offset_s = {:?}", self.seconds)?;
        self.tolerance.map_or(Ok(()), |tolerance| write!(f, " and tolerance_s = {tolerance}"))
    }
}

/// Largest deviation \[h\] from a whole number of hours at which clocks are in two time zones.
const MAX_OFF_HOUR: f64 = 2e-3;

/// Returns the remedy for clocks that differ; empty without an `offset` that pairs most rows.
pub(super) fn clock_offset_remedy(offset: Option<ClockOffset>) -> String {
    offset.map_or_else(String::new, |offset| {
        let hours = offset.seconds / 3600.0;
        let is_zone =
            (0.5..=14.1).contains(&hours.abs()) && (hours - hours.round()).abs() < MAX_OFF_HOUR;
        let zone = if is_zone { " (by whole hours, as for summer time or UTC)" } else { "" };
        format!(
            "; with the clock of the joint table moved by {:?} s the rows have partners: the clocks \
             differ{zone}, so write {offset} in joints",
            offset.seconds
        )
    })
}
