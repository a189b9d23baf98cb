//! Parts of error messages.

use std::path::Path;

use super::shortened;

/// Returns the plural ending `s` unless `count` is 1.
pub(super) fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

/// Returns a quotation of the text near an error.
pub(super) fn near(text: &str) -> String {
    if text.is_empty() { String::new() } else { format!(", near `{text}`") }
}

/// States which of two files has a column: the present one if `has`, else `other`.
pub(super) fn difference(other: &Path, has: bool) -> String {
    let says = if has { "has this column, this file does not" } else { "does not have it" };
    format!("{} {says}", other.display())
}

/// Returns names in quotes, as in `there are "a", "b"`.
pub(super) fn in_quotes(names: &[String]) -> String {
    let names: Vec<String> =
        names.iter().map(|name| format!("\"{}\"", shortened(name, 40))).collect();
    list("there are", &names, "its header is empty")
}

/// Returns `verb` followed by the names, or the text `none` if there are no names.
pub(super) fn list(verb: &str, names: &[String], none: &str) -> String {
    if names.is_empty() { none.to_owned() } else { format!("{verb} {}", names.join(", ")) }
}
