//! Quoted strings of TOML.

/// Returns a name in quotes with escaped quotes and backslashes; names contain no other character
/// that needs an escape.
pub(crate) fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\""))
}
