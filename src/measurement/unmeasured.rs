//! Errors of rows that contain no measurement: summaries, titles of pages, and missing positions.

use super::cell_words::is_not_available;
use super::columns::{Column, Columns};
use super::latin::parsed;
use super::role::POSITION;
use super::table::{Table, shortened};
use crate::error::{InputError, InputErrorKind, TableErrorKind};
use crate::problem::Missing;

/// Minimum number of empty cells at which a row that begins with a word is probably a summary.
const MIN_EMPTY_CELLS: usize = 2;

impl Table {
    /// Returns true if the current row is probably the title or foot of a page: its first cell
    /// begins with a letter, and fewer than half of the filled cells are numbers.
    pub(super) fn is_line_of_words(&self) -> bool {
        let cells = || self.cells().iter().map(|cell| String::from_utf8_lossy(cell.trim_ascii()));
        let filled = || cells().filter(|cell| !cell.is_empty());
        let numbers = filled().filter(|cell| parsed(cell).is_some()).count();
        let begins_with_word =
            cells().next().is_some_and(|cell| cell.starts_with(|c: char| c.is_alphabetic()));
        begins_with_word && filled().count() > 2 * numbers
    }

    /// Returns a separator, other than that of the header, with which the current row has as many
    /// cells as the header.
    pub(super) fn other_separator(&self, expected: usize) -> Option<char> {
        let header = self.style.delimiter;
        let cells = self.cells().iter().map(String::from_utf8_lossy).collect::<Vec<_>>();
        let row = cells.join(&header.to_string());
        let is_other = |other: &char| *other != header && row.split(*other).count() == expected;
        let is_whole = cells.len() == 1 && expected > 1;
        [';', '\t', ',', '|'].into_iter().find(is_other).filter(|_| is_whole)
    }

    /// Returns the error of an empty cell of the current row, or of the whole row if it is empty or
    /// probably a summary.
    pub(super) fn empty_cell(&self, place: usize) -> InputError {
        let empty = self.cells().iter().filter(|cell| cell.trim_ascii().is_empty()).count();
        let first = std::str::from_utf8(self.cell(0)).unwrap_or_default();
        let is_word = !first.is_empty() && first.chars().all(|c| c.is_alphabetic() || c == '.');
        if self.is_empty_row() {
            self.error(TableErrorKind::EmptyRow)
        } else if is_word && empty >= MIN_EMPTY_CELLS {
            self.error(TableErrorKind::SummaryRow { word: shortened(first), empty })
        } else {
            self.cell_error(place, TableErrorKind::EmptyCell)
        }
    }

    /// Returns a coordinate of a measured position in the current row, as [`number`](Self::number)
    /// does. Its errors say how rows without a measurement are left out.
    pub fn measured_number(&self, place: usize) -> Result<f64, InputError> {
        self.number(place).map_err(|error| match *error.kind {
            InputErrorKind::Table(
                TableErrorKind::EmptyCell | TableErrorKind::SummaryRow { .. },
            ) => self.cell_error(place, TableErrorKind::EmptyMeasurement),
            InputErrorKind::Table(TableErrorKind::SpreadsheetError { value })
                if is_not_available(&value) =>
            {
                self.cell_error(place, TableErrorKind::WordForMeasurement { value })
            }
            InputErrorKind::Table(TableErrorKind::NotANumber { value })
                if !value.contains(|c: char| c.is_ascii_digit()) =>
            {
                self.cell_error(place, TableErrorKind::WordForMeasurement { value })
            }
            InputErrorKind::NotFinite { value } if value.to_lowercase().contains("nan") => {
                self.cell_error(place, TableErrorKind::WordForMeasurement { value })
            }
            _ => error,
        })
    }
}

/// Returns true if the position of the current row is the word or number that marks a missing
/// measurement.
pub(super) fn is_missing(missing: &Missing, table: &Table, columns: &Columns) -> bool {
    let axis = |column: &&Column| {
        let axis = POSITION.iter().position(|role| *role == column.role)?;
        Some((axis, column.place))
    };
    let mut cells = columns.read.iter().filter_map(|column| axis(&column)).peekable();
    match missing {
        Missing::Word(word) => {
            cells.any(|(_, place)| table.text(place).is_ok_and(|cell| cell == word))
        }
        Missing::Position(nothing) => {
            let same = |(axis, place): (usize, usize)| {
                table.number(place).is_ok_and(|value| {
                    nothing
                        .get(axis)
                        .is_some_and(|marker| marker.to_bits() == (value + 0.0).to_bits())
                })
            };
            cells.peek().is_some() && cells.all(same)
        }
    }
}
