//! Tables in memory, stored by column and read like files.

use std::fmt::Write as _;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use super::Labels;
use crate::error::{InputError, Location, TableErrorKind};

/// Size of the text that is generated at a time \[bytes\].
const CHUNK_BYTES: usize = 1 << 15;
/// Magnitude below which a 64-bit float holds every integer exactly: 2⁵³.
const MAX_EXACT_INTEGER: f64 = 9_007_199_254_740_992.0;

/// Table of measurements in memory, with the column names that a file would have. Messages refer to
/// a row by the line that it would have in a file; the first row is on line 2.
///
/// ```
/// use std::path::Path;
/// use flexcal::measurement::{ColumnTable, ColumnValues, Dataset};
/// use flexcal::problem::Problem;
///
/// let text = "name = \"arm\"\njoint = [{ a_m = 1.0 }]\ndata.held_out = { column = \"split\" }";
/// let problem = Problem::parse(text, Path::new("arm.toml"))?;
/// let numbers = |values: [f64; 2]| ColumnValues::Numbers(values.to_vec());
/// let columns = vec![
///     ("q1_deg".to_owned(), numbers([0.0, 90.0])),
///     ("x_mm".to_owned(), numbers([1000.0, 0.1])),
///     ("y_mm".to_owned(), numbers([0.2, 1000.0])),
///     ("z_mm".to_owned(), numbers([0.0, 0.0])),
///     ("split".to_owned(), ColumnValues::Words(["identification", "validation"].into_iter().collect())),
/// ];
/// let (data, _warnings) = Dataset::read_columns(ColumnTable::new("data", columns)?, &problem)?;
/// assert_eq!(data.measurements.positions[1].y, 1.0);
/// # Ok::<(), flexcal::error::InputError>(())
/// ```
#[derive(Debug, Clone)]
pub struct ColumnTable {
    name: PathBuf,
    columns: Vec<(String, ColumnValues)>,
    rows: usize,
}

/// Values of a column, one per row.
#[derive(Debug, Clone)]
pub enum ColumnValues {
    /// Numbers in the unit given by the column's name.
    Numbers(Vec<f64>),
    /// Words, as in the cells of a file.
    Words(Labels),
}

impl ColumnTable {
    /// Creates a table from named columns; messages call the table `name`.
    ///
    /// # Errors
    /// Returns an error if a column has another length than the first.
    pub fn new(
        name: impl Into<PathBuf>,
        columns: Vec<(String, ColumnValues)>,
    ) -> Result<Self, InputError> {
        let name = name.into();
        let rows = columns.first().map_or(0, |(_, values)| values.len());
        for (column, values) in &columns {
            if values.len() != rows {
                let kind = TableErrorKind::ColumnLength { expected: rows, found: values.len() };
                return Err(Location::file(name).with_key(format!("column {column}")).error(kind));
            }
        }
        Ok(Self { name, columns, rows })
    }

    /// Returns the name used in messages.
    pub(crate) fn name(&self) -> &Path {
        &self.name
    }

    /// Returns a reader of the table as CSV text.
    pub(super) fn into_text(self) -> impl Read {
        let header =
            self.columns.iter().map(|(name, _)| quoted(name)).collect::<Vec<_>>().join(",") + "\n";
        TableTextReader { table: self, row: 0, chunk: header, bytes_read: 0 }
    }
}

impl ColumnValues {
    /// Returns the number of rows.
    fn len(&self) -> usize {
        match self {
            Self::Numbers(values) => values.len(),
            Self::Words(labels) => labels.of_row.len(),
        }
    }

    /// Appends the cell of a row; numbers keep all their digits. Whole numbers are written without
    /// a decimal point, because they may be names, such as those of sessions or markers.
    fn write(&self, row: usize, text: &mut String) {
        match self {
            Self::Numbers(values) => {
                let Some(value) = values.get(row) else { return };
                let is_whole = value.fract() == 0.0 && value.abs() < MAX_EXACT_INTEGER;
                // Writing to a String cannot fail.
                _ = if is_whole { write!(text, "{value}") } else { write!(text, "{value:?}") };
            }
            Self::Words(labels) => {
                let word = labels.of_row.get(row).and_then(|&label| labels.names.get(label));
                text.push_str(&quoted(word.map_or("", String::as_str)));
            }
        }
    }
}

/// Reader that generates the text of a table a few rows at a time.
struct TableTextReader {
    table: ColumnTable,
    /// Next row to generate.
    row: usize,
    /// Text of the header or of the last rows that were generated.
    chunk: String,
    /// Number of bytes of the chunk that were read.
    bytes_read: usize,
}

impl TableTextReader {
    /// Generates the text of the next rows as a new chunk.
    fn next_rows(&mut self) {
        self.chunk.clear();
        self.bytes_read = 0;
        while self.row < self.table.rows && self.chunk.len() < CHUNK_BYTES {
            for (k, (_, values)) in self.table.columns.iter().enumerate() {
                if k > 0 {
                    self.chunk.push(',');
                }
                values.write(self.row, &mut self.chunk);
            }
            self.chunk.push('\n');
            self.row += 1;
        }
    }
}

impl Read for TableTextReader {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        if self.bytes_read == self.chunk.len() {
            self.next_rows();
        }
        let left = self.chunk.as_bytes().get(self.bytes_read..).unwrap_or_default();
        let count = left.len().min(out.len());
        out.iter_mut().zip(left).for_each(|(out, byte)| *out = *byte);
        self.bytes_read += count;
        Ok(count)
    }
}

/// Returns a CSV cell, quoted if needed; an empty cell is quoted so that its row is not empty.
fn quoted(word: &str) -> String {
    if word.is_empty() || word.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", word.replace('"', "\"\""))
    } else {
        word.to_owned()
    }
}
