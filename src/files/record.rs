//! Record of the files that flexcal wrote to a folder.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use sha2::{Digest as _, Sha256};

use super::{StagedFile, read_limited};

/// Name of the record file.
const RECORD_NAME: &str = ".flexcal";
/// Maximum size of a record that is read \[bytes\].
const MAX_RECORD_BYTES: u64 = 1 << 20;

/// Record of the files written to a folder, stored there as `.flexcal`: one line of digest, command
/// and name per file.
///
/// A file that was changed afterwards no longer counts as written by flexcal.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct FolderRecord {
    lines: Vec<RecordLine>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct RecordLine {
    digest: String,
    command: String,
    name: String,
}

/// Returns the SHA-256 digest of `bytes` as hexadecimal digits.
pub fn digest(bytes: &[u8]) -> String {
    hexadecimal(Sha256::digest(bytes).as_slice())
}

impl FolderRecord {
    /// Reads the record of a folder; returns an empty record if there is none.
    ///
    /// # Errors
    /// Returns an error if the record exists and cannot be read.
    pub fn read(folder: &Path) -> io::Result<Self> {
        let text = match read_limited(&folder.join(RECORD_NAME), MAX_RECORD_BYTES) {
            Ok(text) => text,
            Err(error)
                if matches!(
                    error.kind(),
                    io::ErrorKind::NotFound | io::ErrorKind::NotADirectory
                ) =>
            {
                return Ok(Self::default());
            }
            Err(error) => return Err(error),
        };
        let line = |line: &str| {
            let (digest, rest) = line.split_once(' ')?;
            let (command, name) = rest.split_once(' ')?;
            Some(RecordLine {
                digest: digest.to_owned(),
                command: command.to_owned(),
                name: name.to_owned(),
            })
        };
        Ok(Self { lines: String::from_utf8_lossy(&text).lines().filter_map(line).collect() })
    }

    /// Returns the command that wrote the file `name`; `None` if the record does not list it or the
    /// file has changed since.
    pub fn writer(&self, folder: &Path, name: &str) -> Option<&str> {
        let mut lines = self.lines.iter().filter(|line| line.name == name).peekable();
        lines.peek()?;
        let digest = digest_of_file(&folder.join(name)).ok()?;
        lines.find(|line| line.digest == digest).map(|line| line.command.as_str())
    }

    /// Returns the names of all recorded files.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.lines.iter().map(|line| line.name.as_str())
    }

    /// Adds a record for `text`, which a command is about to write to the file `name`.
    pub fn add(&mut self, command: &str, name: &str, text: &str) {
        let (command, name) = (command.to_owned(), name.to_owned());
        self.lines.push(RecordLine { digest: digest(text.as_bytes()), command, name });
    }

    /// Keeps the newest line of each name and removes the names for which `is_gone` returns true.
    pub fn settle(&mut self, is_gone: impl Fn(&str) -> bool) {
        let newest: Vec<RecordLine> = self
            .lines
            .iter()
            .enumerate()
            .filter(|(index, line)| {
                !is_gone(&line.name)
                    && self.lines.iter().skip(index + 1).all(|later| later.name != line.name)
            })
            .map(|(_, line)| line.clone())
            .collect();
        self.lines = newest;
    }

    /// Writes the record to its folder.
    ///
    /// # Errors
    /// Returns an error if the record cannot be written.
    pub fn write(&self, folder: &Path) -> io::Result<()> {
        let line = |RecordLine { digest, command, name }: &RecordLine| {
            format!("{digest} {command} {name}\n")
        };
        let lines = self.lines.iter().map(line).collect::<Vec<_>>().concat();
        StagedFile::new(&Self::file(folder), &lines)?.commit()
    }

    /// Returns the path of the record, the file `.flexcal` in a folder.
    pub fn file(folder: &Path) -> PathBuf {
        folder.join(RECORD_NAME)
    }
}

/// Returns the SHA-256 digest of a regular file; a symbolic link is refused.
fn digest_of_file(path: &Path) -> io::Result<String> {
    if !fs::symlink_metadata(path)?.is_file() {
        return Err(io::ErrorKind::InvalidInput.into());
    }
    let mut digest = Sha256::new();
    let (mut file, mut piece) = (File::open(path)?, vec![0; 1 << 16]);
    loop {
        let read = io::Read::read(&mut file, &mut piece)?;
        if read == 0 {
            return Ok(hexadecimal(digest.finalize().as_slice()));
        }
        digest.update(piece.get(..read).unwrap_or_default());
    }
}

fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect::<Vec<_>>().concat()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_changed_is_not_known_any_more() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path();
        let mut record = FolderRecord::read(path).unwrap();
        assert_eq!(record, FolderRecord::default());
        for text in ["one", "two"] {
            record.add("identify", "report of mine.md", text);
            fs::write(path.join("report of mine.md"), text).unwrap();
            record.write(path).unwrap();
        }
        record = FolderRecord::read(path).unwrap();
        assert_eq!(record.writer(path, "report of mine.md"), Some("identify"));
        record.settle(|_| false);
        assert_eq!(record.names().count(), 1);
        fs::write(path.join("report of mine.md"), "one").unwrap();
        assert_eq!(record.writer(path, "report of mine.md"), None, "the text before the last");
        assert_eq!(record.writer(path, "another"), None);
        record.settle(|name| name.starts_with("report"));
        assert_eq!(record, FolderRecord::default());
    }
}
