//! Access to files: reads with a size limit, atomic writes, a record of written files, and CSV
//! text.

mod record;
mod staged;

use std::fs::File;
use std::io::{self, Read as _};
use std::path::Path;

pub use record::{FolderRecord, digest};
pub use staged::StagedFile;

/// Reads a file of at most `max_bytes` bytes.
///
/// # Errors
/// The file cannot be read, or is larger ([`io::ErrorKind::FileTooLarge`]).
pub fn read_limited(path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(max_bytes + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > max_bytes { Err(io::ErrorKind::FileTooLarge.into()) } else { Ok(bytes) }
}

/// Returns true if two paths lead to the same existing file, also through links.
pub fn same_file(first: &Path, second: &Path) -> bool {
    #[cfg(unix)]
    if let (Ok(first), Ok(second)) = (first.metadata(), second.metadata()) {
        use std::os::unix::fs::MetadataExt as _;
        return (first.dev(), first.ino()) == (second.dev(), second.ino());
    }
    matches!((first.canonicalize(), second.canonicalize()), (Ok(first), Ok(second)) if first == second)
}

/// Returns CSV text with a header line; every line must have as many cells as the header.
pub(crate) fn csv(header: Vec<String>, lines: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for line in std::iter::once(header).chain(lines) {
        // Writing to memory cannot fail.
        let _ = writer.write_record(line);
    }
    writer.into_inner().ok().and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default()
}
