//! Probabilities in words.

/// Smallest probability at which a law, or a cause at a place, is more probable than not.
pub(super) const MIN_PROBABLE: f64 = 0.5;

/// Returns a probability in percent.
pub(super) fn percent(probability: f64) -> String {
    match probability {
        p if p > 0.995 => "over 99 %".to_owned(),
        p if p < 0.005 => "under 1 %".to_owned(),
        p => format!("{:.0} %", 100.0 * p),
    }
}
