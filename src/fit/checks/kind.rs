//! The identification rows of one kind, and the words for them.

use crate::problem::Observation;

/// The identification rows of one kind; lengths \[m\], of tilts angles \[rad\].
pub(in crate::fit) struct Kind {
    pub observation: Observation,
    pub rows: Vec<usize>,
    /// Root mean squared distance from their centre: of positions and tilts as they were measured,
    /// of others of the places at which the nominal arm has its target there.
    pub spread: f64,
    /// 1 σ of a number: as declared, if it was, and as the fit took it.
    pub sigma: (Option<f64>, f64),
}

/// From here on lengths are written with a power of ten \[m\].
const HUGE: f64 = 1e6;

/// An error with its unit: of tilts \[rad\] with a decimal more, of others \[m\].
pub(crate) fn size(kind: &str, error: f64, decimals: usize) -> String {
    match kind {
        _ if !error.is_finite() => "more than numbers hold".to_owned(),
        "tilt" => format!("{:.*}°", decimals + 1, error.to_degrees()),
        _ if error < HUGE => format!("{:.*} mm", decimals, error * 1e3),
        _ => format!("{:.2e} mm", error * 1e3),
    }
}

/// Rows of a kind.
pub(crate) fn rows(kind: &str) -> &'static str {
    match kind {
        "point" => "contacts with points",
        "distance" => "distances",
        "surface" => "contacts with surfaces",
        "tilt" => "rows of tilts",
        _ => "poses",
    }
}

/// What rows of a kind measure.
pub(in crate::fit) fn measured(kind: &str) -> &'static str {
    match kind {
        "position" => "measurements",
        "tilt" => "tilts",
        _ => rows(kind),
    }
}

/// Which words of a table are to be checked where rows of a kind are missed.
pub(in crate::fit) fn named(kind: &str) -> &'static str {
    match kind {
        "point" => "the names in the column point",
        "distance" => "the names in the column anchor",
        "surface" => "the names in the column surface",
        "tilt" => "the names in the column frame",
        _ => "whether base and session are declared",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_without_a_number_is_said_in_words() {
        for error in [f64::INFINITY, f64::NAN] {
            assert_eq!(size("position", error, 3), "more than numbers hold");
        }
        assert_eq!(
            (size("position", 1e-3, 2), size("tilt", 0.0, 1)),
            ("1.00 mm".to_owned(), "0.00°".to_owned())
        );
    }
}
