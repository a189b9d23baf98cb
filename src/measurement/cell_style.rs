//! Style of the cells of a table.

/// Separator of the cells of a table, and decimal mark of its numbers.
#[derive(Debug, Clone, Copy)]
pub(super) struct CellStyle {
    pub delimiter: char,
    /// True if numbers have a decimal comma, false for a decimal point.
    pub decimal_comma: bool,
}
