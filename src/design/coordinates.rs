//! Number of coordinates that poses measure.

use std::collections::HashSet;

use crate::measurement::Measurements;

/// Returns the number of coordinates that some rows of a table measure. `of_position` is the number
/// for a row that measures a position: three, or six with its orientation.
pub(super) fn coordinates(
    table: &Measurements,
    of_position: usize,
    rows: impl IntoIterator<Item = usize>,
) -> usize {
    let of_row = |row: usize| {
        let observation = table.observation(row);
        if observation.is_position() { of_position } else { observation.coordinates() }
    };
    rows.into_iter().map(of_row).sum()
}

/// Returns the index of the first row with each pose number; `numbers` holds one for every row.
pub(super) fn first_rows(numbers: &[usize]) -> Vec<usize> {
    let mut numbers_so_far = HashSet::new();
    (0..numbers.len()).filter(|&row| numbers_so_far.insert(numbers[row])).collect()
}
