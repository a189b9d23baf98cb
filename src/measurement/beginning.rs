//! Look at the first rows of a table, before they are read.

use std::collections::BTreeSet;
use std::sync::Arc;

use super::dialect::{HEADER_SEARCH_BYTES, Layout, cells};
use super::latin::{decoded, parsed};

/// Beginning of the text of a table.
pub(super) struct Beginning {
    text: Arc<[u8]>,
    layout: Layout,
    /// Mark of comment lines.
    comment: Option<String>,
}

/// Mark of the decimals of a number, as far as the number by itself shows it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Mark {
    /// Decimal point that separates no thousands.
    Point,
    /// Comma, or points between thousands, which show that the decimal mark is no point.
    NotPoint,
}

impl Beginning {
    pub fn new(text: Arc<[u8]>, layout: Layout, comment: Option<String>) -> Self {
        Self { text, layout, comment }
    }

    /// Returns the cells of the rows below the header. A row that is cut off is left out.
    pub fn rows(&self) -> Vec<Vec<String>> {
        let text = decoded(&self.text).replace("\r\n", "\n").replace('\r', "\n");
        let is_cut = self.text.len() as u64 >= HEADER_SEARCH_BYTES;
        let whole =
            if is_cut { text.rsplit_once('\n').map_or("", |(whole, _)| whole) } else { &text };
        let is_comment = |line: &&str| {
            self.comment.as_ref().is_some_and(|mark| line.trim_start().starts_with(mark))
        };
        let lines = whole.split('\n').skip(self.layout.skipped);
        let lines = lines.filter(|line| !line.trim().is_empty() && !is_comment(line));
        lines.skip(1).map(|line| cells(line, self.layout.delimiter)).collect()
    }

    /// Returns the cells of the first row; empty without a row.
    pub fn first_row(&self) -> Vec<String> {
        self.rows().into_iter().next().unwrap_or_default()
    }

    /// Returns true if the numbers have decimal points: one has a point that cannot separate
    /// thousands, and none has a comma or several points.
    pub fn has_decimal_points(&self) -> bool {
        let rows = self.rows();
        let mut marks = rows.iter().flatten().filter_map(|cell| mark(cell)).peekable();
        marks.peek().is_some() && marks.all(|mark| mark == Mark::Point)
    }

    /// Returns true if a comma stands between two digits.
    pub fn has_decimal_commas(&self) -> bool {
        let is_decimal = |of: &[u8]| matches!(of, [b'0'..=b'9', b',', b'0'..=b'9']);
        self.text.windows(3).any(is_decimal)
    }

    /// Returns the indices of the columns that hold words, not only numbers.
    pub fn word_columns(&self) -> BTreeSet<usize> {
        let is_word = |cell: &String| !cell.is_empty() && parsed(cell).is_none();
        let rows = self.rows();
        let cells = rows.iter().flat_map(|row| row.iter().enumerate());
        cells.filter(|(_, cell)| is_word(cell)).map(|(place, _)| place).collect()
    }
}

/// Returns the decimal mark of a number; `None` for other words, for numbers without a mark, and for
/// points that may separate thousands.
fn mark(cell: &str) -> Option<Mark> {
    if cell.contains(',') {
        return parsed(cell).map(|_| Mark::NotPoint);
    }
    let (whole, decimals) = cell.split_once('.')?;
    let is_group =
        |group: &str| group.len() == 3 && group.bytes().all(|byte| byte.is_ascii_digit());
    if decimals.contains('.') {
        return decimals.split('.').all(is_group).then_some(Mark::NotPoint);
    }
    cell.parse::<f64>().ok()?;
    let whole = whole.trim_start_matches(['-', '+']);
    let may_be_thousands =
        decimals.len() == 3 && (1..=3).contains(&whole.len()) && !whole.starts_with('0');
    (!may_be_thousands).then_some(Mark::Point)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimal_points_are_told_from_points_between_thousands() {
        for (number, expected) in [
            ("1121.8105", Some(Mark::Point)),
            ("1121.810", Some(Mark::Point)),
            ("-0.403", Some(Mark::Point)),
            ("9.5", Some(Mark::Point)),
            ("1.500", None),
            ("-12.345", None),
            ("51,888", Some(Mark::NotPoint)),
            ("1.121.810", Some(Mark::NotPoint)),
            ("31.05.2024", None),
            ("P1.5", None),
            ("12", None),
            ("", None),
        ] {
            assert_eq!(mark(number), expected, "{number}");
        }
    }
}
