//! Detection of tables whose file was cut inside the last number.

use csv::ByteRecord;

/// Minimum number of rows before the last one, with which its digits are compared.
const MIN_ROWS: usize = 10;

/// Digits behind the decimal mark of the last cells of a table's rows.
#[derive(Default)]
pub(super) struct LastCells {
    /// Number of digits in the current row.
    current: usize,
    /// Smallest and largest number of digits in the rows before the current one.
    before: Option<(usize, usize)>,
    /// Number of rows, including the current one.
    rows: usize,
}

impl LastCells {
    /// Counts the digits of the last cell of a row. A cell that is no number, as in a header, is
    /// passed over.
    pub fn count(&mut self, row: &ByteRecord) {
        let Some(cell) = row.iter().next_back().map(<[u8]>::trim_ascii) else { return };
        let digits = cell.strip_prefix(b"-").unwrap_or(cell);
        if !digits.first().is_some_and(u8::is_ascii_digit) {
            return;
        }
        if self.rows > 0 {
            let (fewest, most) = self.before.unwrap_or((self.current, self.current));
            self.before = Some((fewest.min(self.current), most.max(self.current)));
        }
        let mark = digits.iter().rposition(|byte| matches!(byte, b'.' | b','));
        self.current = mark.map_or(0, |mark| digits.len() - mark - 1);
        self.rows += 1;
    }

    /// Returns true if the last number has clearly fewer digits than those of all rows before.
    pub fn is_last_cut(&self) -> bool {
        self.before.is_some_and(|(fewest, most)| {
            // Numbers that are written without final zeros differ by a digit by chance.
            let least_difference = if fewest == most && fewest > 1 { 1 } else { 2 };
            self.rows > MIN_ROWS && self.current + least_difference <= fewest
        })
    }
}
