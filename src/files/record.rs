//! Record of the files that flexcal wrote to a folder.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use sha2::{Digest as _, Sha256};

use super::regular::read_limited;
use super::staged::folder_of;

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

/// Returns true if flexcal wrote the file to its folder, and the file was changed since.
pub fn was_changed(file: &Path) -> bool {
    let Some(name) = file.file_name().and_then(|name| name.to_str()) else { return false };
    let folder = folder_of(file);
    FolderRecord::read(folder).is_ok_and(|record| {
        record.names().any(|recorded| recorded == name) && record.writer(folder, name).is_none()
    })
}

impl FolderRecord {
    /// Name of the record file, with which the names of all other files of flexcal's own begin.
    pub const NAME: &str = ".flexcal";

    /// Reads the record of a folder; returns an empty record if there is none.
    ///
    /// # Errors
    /// Returns an error if the record exists and cannot be read.
    pub fn read(folder: &Path) -> io::Result<Self> {
        Self::read_file(&Self::file(folder))
    }

    /// Reads the record in a file; returns an empty record if there is none.
    pub(super) fn read_file(file: &Path) -> io::Result<Self> {
        let text = match read_limited(file, MAX_RECORD_BYTES) {
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

    /// Records the files `names` of a folder as they are; skips those that are no regular files.
    pub(super) fn of_files<'a>(folder: &Path, names: impl Iterator<Item = &'a String>) -> Self {
        let line = |name: &String| {
            let digest = digest_of_file(&folder.join(name)).ok()?;
            Some(RecordLine { digest, command: "replaced".to_owned(), name: name.clone() })
        };
        Self { lines: names.filter_map(line).collect() }
    }

    /// Records `text` as the file `name` of a command.
    pub fn add(&mut self, command: &str, name: &str, text: &str) {
        self.remove(name);
        let (command, name) = (command.to_owned(), name.to_owned());
        self.lines.push(RecordLine { digest: digest(text.as_bytes()), command, name });
    }

    /// Removes the file `name` from the record.
    pub fn remove(&mut self, name: &str) {
        self.lines.retain(|line| line.name != name);
    }

    /// Returns the record as text.
    pub(super) fn text(&self) -> String {
        let line = |RecordLine { digest, command, name }: &RecordLine| {
            format!("{digest} {command} {name}\n")
        };
        self.lines.iter().map(line).collect()
    }

    /// Returns the path of the record, the file `.flexcal` in a folder.
    pub fn file(folder: &Path) -> PathBuf {
        folder.join(Self::NAME)
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
            fs::write(FolderRecord::file(path), record.text()).unwrap();
        }
        record = FolderRecord::read(path).unwrap();
        assert_eq!(record.writer(path, "report of mine.md"), Some("identify"));
        assert_eq!(record.names().count(), 1);
        fs::write(path.join("report of mine.md"), "one").unwrap();
        assert_eq!(record.writer(path, "report of mine.md"), None, "the text before the last");
        assert_eq!(record.writer(path, "another"), None);
        record.remove("report of mine.md");
        assert_eq!(record, FolderRecord::default());
    }
}
