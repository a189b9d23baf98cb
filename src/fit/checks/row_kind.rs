//! Identification rows that measure the same kind of quantity, and the words for them in texts.

use nalgebra::Vector3;

use crate::fit::stages::placement::Placement;
use crate::observation::{Observation, kind_named};
use crate::quantity::Unit;

/// Identification rows that measure the same kind of quantity, such as positions or tilts. Lengths
/// are in m, angles of tilts in rad, images in px.
pub(in crate::fit) struct RowKind {
    pub observation: Observation,
    pub rows: Vec<usize>,
    /// Root mean squared distance of the measured positions or tilts from their mean. For other
    /// kinds of rows it is that of the target positions which the registered nominal arm predicts
    /// \[m\].
    pub spread: f64,
    /// Declared standard deviation (1 σ) of a coordinate, rms over the rows; `None` if none is
    /// declared.
    pub declared_sigma: Option<f64>,
    /// 1 σ of a coordinate that the fit assumed, rms over the rows.
    pub taken_sigma: f64,
}

/// Returns the root mean squared distance \[m\] of the points of `rows` from the mean of the points
/// with the same base. `point` returns the point of the row with a given index in `rows`.
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

/// Names of the coordinates of a position.
pub(super) const AXES: [&str; 3] = ["x", "y", "z"];

/// Maximum number of rows or limits that a text lists.
pub(super) const MAX_LISTED: usize = 3;

/// Joins the first words by commas and states how many others there are: "a, b, c and 4 more".
pub(super) fn listed(words: &[impl AsRef<str>]) -> String {
    listed_up_to(words, MAX_LISTED)
}

/// Does the work of [`listed`] for the first `max` words.
pub(super) fn listed_up_to(words: &[impl AsRef<str>], max: usize) -> String {
    let shown: Vec<&str> = words.iter().take(max).map(AsRef::as_ref).collect();
    let more = words.len().saturating_sub(max);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{}{more}", shown.join(", "))
}

/// Smallest length that [`format_error`] writes with a power of ten \[m\].
const MIN_SCIENTIFIC_LENGTH: f64 = 1e6;

/// Formats an error of rows of a kind with its unit: tilts \[rad\] in degrees with one more
/// decimal, images in px, all others \[m\] in mm.
pub(crate) fn format_error(kind: &str, error: f64, decimals: usize) -> String {
    match kind_named(kind).unit {
        _ if !error.is_finite() => "more than can be computed".to_owned(),
        Unit::Angle => format!("{:.*}°", decimals + 1, error.to_degrees()),
        Unit::Pixel => format!("{error:.decimals$} px"),
        _ if error < MIN_SCIENTIFIC_LENGTH => format!("{:.*} mm", decimals, error * 1e3),
        _ => format!("{:.2e} mm", error * 1e3),
    }
}

/// Returns the plural noun for rows of a kind, such as "contacts".
pub(crate) fn row_noun(kind: &str) -> &'static str {
    kind_named(kind).row.1
}

/// Returns the noun for the quantity that rows of a kind measure.
pub(in crate::fit) fn quantity_noun(kind: &str) -> &'static str {
    kind_named(kind).measured
}

/// Returns the text that lists the columns and declarations to check if the arm does not fit rows
/// of a kind.
pub(in crate::fit) fn suspects(kind: &str) -> &'static str {
    kind_named(kind).suspects
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_without_a_number_is_said_in_words() {
        for error in [f64::INFINITY, f64::NAN] {
            assert_eq!(format_error("position", error, 3), "more than can be computed");
        }
        assert_eq!(
            (format_error("position", 1e-3, 2), format_error("tilt", 0.0, 1)),
            ("1.00 mm".to_owned(), "0.00°".to_owned())
        );
    }
}
