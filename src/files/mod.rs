//! Access to files: reads with a size limit, results whose files appear together, a record of
//! written files, and CSV text.

mod batch;
mod format;
mod latin;
mod lock;
mod record;
mod regular;
mod sealed;
mod staged;

use std::fs::File;
use std::io;
use std::path::Path;

pub use batch::Batch;
pub use format::{FORMAT_VERSION, PROGRAM};
pub(crate) use format::{Format, newer_version};
pub(crate) use latin::windows_1252;
pub use lock::{FolderLock, MAX_LOCK_WAIT};
pub use record::{FolderRecord, digest, was_changed};
pub use sealed::Changes;
pub(crate) use sealed::{DIGEST_KEY, changed_key, digest_of_values, sealed};
pub use staged::write_new;

/// Reads a file of at most `max_bytes` bytes; see [`open`] for the files that are refused.
///
/// # Errors
/// Returns an error if the file cannot be read, or is larger ([`io::ErrorKind::FileTooLarge`]).
pub fn read_limited(path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
    batch::complete_beside(path)?;
    regular::read_limited(path, max_bytes)
}

/// Opens a file for reading. Returns an error for folders, FIFOs, sockets, devices and files of the
/// kernel (`/proc`, `/sys`), which could block or never end. The standard input is allowed as
/// `/dev/stdin`, `/dev/fd/N` or `/proc/self/fd/N`. If a process was killed while it wrote results
/// to the folder of the file, they are completed first.
///
/// # Errors
/// Returns an error if the file cannot be opened, or is no regular file.
pub fn open(path: &Path) -> io::Result<File> {
    batch::complete_beside(path)?;
    regular::open(path)
}

/// Reads a text file of any size; see [`open`] for the files that are refused.
///
/// # Errors
/// Returns an error if the file cannot be opened or read, or is not UTF-8.
pub fn read_text(path: &Path) -> io::Result<String> {
    io::read_to_string(open(path)?)
}

/// Returns true if two paths lead to the same existing file, if necessary through links.
pub fn same_file(first: &Path, second: &Path) -> bool {
    #[cfg(unix)]
    if let (Ok(first), Ok(second)) = (first.metadata(), second.metadata()) {
        use std::os::unix::fs::MetadataExt as _;
        return (first.dev(), first.ino()) == (second.dev(), second.ino());
    }
    matches!((first.canonicalize(), second.canonicalize()), (Ok(first), Ok(second)) if first == second)
}

/// Returns CSV text with a header line; every line must have as many cells as the header. Words
/// that a spreadsheet would run as a formula are escaped; see [`unescape_cell`].
pub(crate) fn csv(header: Vec<String>, lines: impl IntoIterator<Item = Vec<String>>) -> String {
    separated(b',', header, &mut lines.into_iter())
}

/// Formats a table with semicolons between the cells, which may then have decimal commas.
pub(crate) fn csv_with_semicolons(header: Vec<String>, lines: Vec<Vec<String>>) -> String {
    separated(b';', header, &mut lines.into_iter())
}

/// Formats a table with a delimiter between the cells.
fn separated(
    delimiter: u8,
    header: Vec<String>,
    lines: &mut dyn Iterator<Item = Vec<String>>,
) -> String {
    let mut writer = csv::WriterBuilder::new().delimiter(delimiter).from_writer(Vec::new());
    for line in std::iter::once(header).chain(lines) {
        // Writing to memory cannot fail.
        let _ = writer.write_record(line.into_iter().map(escape_cell));
    }
    writer.into_inner().ok().and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default()
}

/// Returns true if a spreadsheet would run the word as a formula: it begins with `=`, `+`, `-`, `@`
/// or a tab, perhaps after apostrophes, and is no number. Some spreadsheets take the full-width
/// signs of East Asian keyboards for these too.
fn is_formula(word: &str) -> bool {
    const SIGNS: [char; 10] = ['=', '+', '-', '@', '\t', '\r', '＝', '＋', '－', '＠'];
    let start = word.trim_start_matches('\'');
    // Tables with another decimal mark have numbers with a comma.
    let is_number = start.replacen(',', ".", 1).parse::<f64>().is_ok();
    start.starts_with(SIGNS) && !is_number
}

/// Escapes a word that a spreadsheet would run as a formula, by an apostrophe in front.
fn escape_cell(word: String) -> String {
    if is_formula(&word) { format!("'{word}") } else { word }
}

/// Returns the word of a cell without the apostrophe that protects it from spreadsheets, if it
/// stands before a formula.
pub(crate) fn unescape_cell(cell: &str) -> &str {
    cell.strip_prefix('\'').filter(|word| is_formula(word)).unwrap_or(cell)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formulas_are_escaped_and_read_back_unchanged() {
        for word in ["=1+1", "+A1", "-x", "@SUM(A1)", "\tx", "'=1", "''-x", "＝1+1"] {
            let escaped = escape_cell(word.to_owned());
            assert_eq!(escaped, format!("'{word}"));
            assert_eq!(unescape_cell(&escaped), word);
        }
        for word in ["-1.5", "-32,015", "+2e-3", "-inf", "'quoted", "x=1", "", "'", "2024-05-31"] {
            assert_eq!(escape_cell(word.to_owned()), word);
            assert_eq!(unescape_cell(word), word);
        }
        assert_eq!(csv(vec!["a".to_owned()], [vec!["=1".to_owned()]]), "a\n'=1\n");
    }
}
