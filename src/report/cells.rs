//! Cells of tables for other programs.

/// A word as a cell of CSV: in quotes where it holds a comma, a quote or the end of a line.
pub(super) fn quoted(word: &str) -> String {
    if word.contains([',', '"', '\n', '\r']) { format!("\"{}\"", word.replace('"', "\"\"")) } else { word.to_owned() }
}
