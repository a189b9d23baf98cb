//! Probabilities in words.

/// Smallest probability at which a text calls a law, or a cause at a place, more probable than not.
pub(super) const MIN_PROBABLE: f64 = 0.5;

/// Formats a probability (0 to 1) as a percentage, as "over 99 %" or "under 1 %" at the ends.
pub(super) fn percent(probability: f64) -> String {
    match probability {
        p if p > 0.995 => "over 99 %".to_owned(),
        p if p < 0.005 => "under 1 %".to_owned(),
        p => format!("{:.0} %", 100.0 * p),
    }
}
