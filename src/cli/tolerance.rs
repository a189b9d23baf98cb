//! Plausibility of the tolerance that commands take.

use super::diagnostic;

/// Smallest tolerance of an arm that is plausible \[mm\].
const MIN_TOLERANCE_MM: f64 = 1e-3;

/// Warns if a tolerance is below what arms hold, as it is in metres.
pub(super) fn warn_if_tiny(tolerance_mm: Option<f64>, quiet: bool) {
    if let Some(tolerance) = tolerance_mm.filter(|mm| *mm < MIN_TOLERANCE_MM && !quiet) {
        diagnostic::warn(&format!(
            "a tolerance of {tolerance} mm is below what an arm holds; if it is in metres, write \
             --tolerance-mm {}",
            (tolerance * 1e9).round() / 1e6
        ));
    }
}
