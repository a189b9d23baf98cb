//! Format of the cells of a table.

/// Format of a table's cells: separators, decimal mark.
#[derive(Debug, Clone, Copy)]
pub(super) struct CellStyle {
    pub delimiter: char,
    pub decimal_comma: bool,
}
