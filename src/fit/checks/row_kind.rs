//! Identification rows that measure the same kind of quantity, and the words for them in texts.

use nalgebra::Vector3;

use crate::fit::stages::placement::Placement;
use crate::observation::{Observation, kind_named};
use crate::quantity::Unit;

/// Identification rows that measure the same kind of quantity; lengths are in m, angles of tilts in
/// rad.
pub(in crate::fit) struct RowKind {
    pub observation: Observation,
    pub rows: Vec<usize>,
    /// Root mean squared distance of the measured positions or tilts from their centre. For other
    /// kinds it is that of the target's positions as the nominal arm predicts them.
    pub spread: f64,
    /// Declared standard deviation (1 σ) of a coordinate; `None` if there is none.
    pub declared_sigma: Option<f64>,
    /// 1 σ of a coordinate that the fit assumed.
    pub taken_sigma: f64,
}

/// Returns the root mean squared distance \[m\] of the points of `rows` from the centre of those
/// with the same base.
pub(super) fn spread(
    placement: &Placement,
    rows: &[usize],
    point: impl Fn(usize) -> Vector3<f64>,
) -> f64 {
    let points: Vec<(usize, Vector3<f64>)> = rows
        .iter()
        .enumerate()
        .map(|(place, &row)| (placement.base_of(row), point(place)))
        .collect();
    let mut squares = 0.0;
    for base in 0..placement.bases.len() {
        let of_base = || points.iter().filter(|(of, _)| *of == base).map(|(_, point)| point);
        let centre = of_base().sum::<Vector3<f64>>() / of_base().count().max(1) as f64;
        squares += of_base().map(|point| (point - centre).norm_squared()).sum::<f64>();
    }
    (squares / rows.len().max(1) as f64).sqrt()
}

/// Smallest length that is written with a power of ten \[m\].
const MIN_SCIENTIFIC_LENGTH: f64 = 1e6;

/// Formats an error of rows of a kind with its unit: tilts \[rad\] in degrees with one more
/// decimal, others \[m\] in millimetres.
pub(crate) fn size(kind: &str, error: f64, decimals: usize) -> String {
    match kind_named(kind).unit {
        _ if !error.is_finite() => "more than can be computed".to_owned(),
        Unit::Angle => format!("{:.*}°", decimals + 1, error.to_degrees()),
        Unit::Pixel => format!("{error:.decimals$} px"),
        _ if error < MIN_SCIENTIFIC_LENGTH => format!("{:.*} mm", decimals, error * 1e3),
        _ => format!("{:.2e} mm", error * 1e3),
    }
}

/// Returns the word for rows of a kind.
pub(crate) fn rows(kind: &str) -> &'static str {
    kind_named(kind).row.1
}

/// Returns the word for the quantity that rows of a kind measure.
pub(in crate::fit) fn measured(kind: &str) -> &'static str {
    kind_named(kind).measured
}

/// Returns the columns and declarations to check if the arm does not fit rows of a kind.
pub(in crate::fit) fn named(kind: &str) -> &'static str {
    kind_named(kind).suspects
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_without_a_number_is_said_in_words() {
        for error in [f64::INFINITY, f64::NAN] {
            assert_eq!(size("position", error, 3), "more than can be computed");
        }
        assert_eq!(
            (size("position", 1e-3, 2), size("tilt", 0.0, 1)),
            ("1.00 mm".to_owned(), "0.00°".to_owned())
        );
    }
}
