//! Format of the cells of a table.

/// Format of the cells of a table.
#[derive(Debug, Clone, Copy)]
pub(super) struct CellStyle {
    pub delimiter: char,
    pub decimal_comma: bool,
}
