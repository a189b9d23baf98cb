//! Reads of regular files alone, which neither block nor never end.

use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::Path;

/// Maximum number of files in a folder that a message lists.
const MAX_LISTED_NAMES: usize = 6;

/// Returns the names of the files in a folder in alphabetical order, without hidden ones; empty if
/// the folder cannot be read.
fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let files = entries.filter(|entry| entry.path().is_file());
    let names = files.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = names.filter(|name| !name.starts_with('.')).collect();
    names.sort();
    names
}

/// Opens a file for reading; see [`open`](super::open) for the files that are refused.
///
/// # Errors
/// Returns an error if the file cannot be opened, or is no regular file.
pub(super) fn open(path: &Path) -> io::Result<File> {
    let kind = fs::metadata(path)?.file_type();
    let descriptors = ["/dev/stdin", "/dev/fd", "/proc/self/fd"];
    if descriptors.iter().any(|start| path.starts_with(start)) {
        return File::open(path);
    }
    let refused = |what: &str| {
        let message = format!("it is a {what}; give a regular file");
        Err(io::Error::new(io::ErrorKind::InvalidInput, message))
    };
    if kind.is_dir() {
        let names = names_in(path);
        let listed = names.get(..MAX_LISTED_NAMES).unwrap_or(&names).join(", ");
        let message = if names.is_empty() {
            "it is a folder; give a regular file".to_owned()
        } else {
            format!("it is a folder; give a regular file in it, such as {listed}")
        };
        return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
    }
    if !kind.is_file() {
        return refused("FIFO, socket or device");
    }
    let real = path.canonicalize()?;
    if real.starts_with("/proc") || real.starts_with("/sys") {
        return refused("file of the kernel");
    }
    File::open(path)
}

/// Reads a file of at most `max_bytes` bytes.
///
/// # Errors
/// Returns an error if the file cannot be read, or is larger ([`io::ErrorKind::FileTooLarge`]).
pub(super) fn read_limited(path: &Path, max_bytes: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.take(max_bytes + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > max_bytes { Err(io::ErrorKind::FileTooLarge.into()) } else { Ok(bytes) }
}
