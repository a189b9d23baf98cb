//! How many numbers poses measure.

use std::collections::HashSet;

use crate::measurement::Measurements;
use crate::problem::Observation;

/// Numbers that some rows of a table measure, of which a position has so many.
pub(super) fn coordinates(
    table: &Measurements,
    of_position: usize,
    rows: impl IntoIterator<Item = usize>,
) -> usize {
    let of_row = |row: usize| match table.observation(row) {
        Observation::Position => of_position,
        other => other.coordinates(),
    };
    rows.into_iter().map(of_row).sum()
}

/// The first row with each number.
pub(super) fn first_of_each(numbers: &[usize]) -> Vec<usize> {
    let mut seen = HashSet::new();
    (0..numbers.len()).filter(|&row| seen.insert(numbers[row])).collect()
}
