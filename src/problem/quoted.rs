//! Names as TOML writes them.

/// A name in quotes, quotes and backslashes in it with a backslash before them; names hold nothing
/// that is not seen.
pub(crate) fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\""))
}
