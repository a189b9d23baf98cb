//! Columns of a joint table that are appended to a table of measured rows.

use std::path::PathBuf;

use csv::ByteRecord;

use super::cell_style::CellStyle;
use super::time::DateOrder;

/// Columns of a joint table that are appended to the columns of a table.
pub(super) struct Appended {
    /// Number of columns of the table itself, which stand before the appended ones.
    pub columns_before: usize,
    /// Index of each appended column among those of the joint table, the second file, which holds
    /// the joint coordinates.
    pub places: Vec<usize>,
    pub format: JointTableFormat,
    /// Row of the joint table whose cells the current row has; `None` if it has none.
    pub row: Option<JointRow>,
}

/// Format of a joint table, and the place of its header.
#[derive(Clone)]
pub(super) struct JointTableFormat {
    pub style: CellStyle,
    pub date_order: DateOrder,
    /// Columns of a date and of the time of day beside it.
    pub date_columns: Option<[usize; 2]>,
    /// File and line of the header.
    pub header_place: (PathBuf, usize),
}

/// Row of a joint table.
#[derive(Clone)]
pub(super) struct JointRow {
    pub file: PathBuf,
    /// Line of the row, from 1.
    pub line: usize,
    pub cells: ByteRecord,
}
