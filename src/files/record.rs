//! Which files of a folder flexcal wrote.

use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

use sha2::{Digest as _, Sha256};

use super::{Ready, at_most};

/// Name of the file that says so.
const NAME: &str = ".flexcal";
/// Largest one that is read [bytes].
const LARGEST: u64 = 1 << 20;

/// What flexcal wrote to a folder: a line of digest, command and name for each file, in `.flexcal`
/// there.
///
/// A file that has been changed since is not flexcal's any more.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Record {
    lines: Vec<Line>,
}

#[derive(Debug, Clone, PartialEq, Eq)]
struct Line {
    digest: String,
    command: String,
    name: String,
}

/// SHA-256 of some bytes, hexadecimal.
pub fn digest(bytes: &[u8]) -> String {
    hexadecimal(Sha256::digest(bytes).as_slice())
}

impl Record {
    /// Of a folder; empty where nothing is recorded.
    ///
    /// # Errors
    /// The record is there and cannot be read.
    pub fn of(folder: &Path) -> io::Result<Self> {
        let text = match at_most(&folder.join(NAME), LARGEST) {
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
            Some(Line {
                digest: digest.to_owned(),
                command: command.to_owned(),
                name: name.to_owned(),
            })
        };
        Ok(Self { lines: String::from_utf8_lossy(&text).lines().filter_map(line).collect() })
    }

    /// The command that wrote a file, if flexcal did and it is as it was written.
    pub fn writer(&self, folder: &Path, name: &str) -> Option<&str> {
        let mut lines = self.lines.iter().filter(|line| line.name == name).peekable();
        lines.peek()?;
        let digest = digest_of_file(&folder.join(name)).ok()?;
        lines.find(|line| line.digest == digest).map(|line| line.command.as_str())
    }

    /// Names of all files.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.lines.iter().map(|line| line.name.as_str())
    }

    /// Adds a text that a command is about to write under a name.
    pub fn add(&mut self, command: &str, name: &str, text: &str) {
        let (digest, command, name) =
            (hexadecimal(Sha256::digest(text).as_slice()), command.to_owned(), name.to_owned());
        self.lines.push(Line { digest, command, name });
    }

    /// Keeps of each name the line that was added last, and none of names of which `gone` says so.
    pub fn settle(&mut self, gone: impl Fn(&str) -> bool) {
        let last: Vec<Line> = self
            .lines
            .iter()
            .enumerate()
            .filter(|(k, own)| {
                !gone(&own.name)
                    && self.lines.iter().skip(k + 1).all(|later| later.name != own.name)
            })
            .map(|(_, line)| line.clone())
            .collect();
        self.lines = last;
    }

    /// Writes it to its folder.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn write(&self, folder: &Path) -> io::Result<()> {
        let line = |Line { digest, command, name }: &Line| format!("{digest} {command} {name}\n");
        let lines = self.lines.iter().map(line).collect::<Vec<_>>().concat();
        Ready::new(&Self::file(folder), &lines)?.put()
    }

    /// Where the record of a folder stands.
    pub fn file(folder: &Path) -> PathBuf {
        folder.join(NAME)
    }
}

/// The SHA-256 digest of a regular file, not of what a link leads to.
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
        let mut record = Record::of(path).unwrap();
        assert_eq!(record, Record::default());
        for text in ["one", "two"] {
            record.add("identify", "report of mine.md", text);
            fs::write(path.join("report of mine.md"), text).unwrap();
            record.write(path).unwrap();
        }
        record = Record::of(path).unwrap();
        assert_eq!(record.writer(path, "report of mine.md"), Some("identify"));
        record.settle(|_| false);
        assert_eq!(record.names().count(), 1);
        fs::write(path.join("report of mine.md"), "one").unwrap();
        assert_eq!(record.writer(path, "report of mine.md"), None, "the text before the last");
        assert_eq!(record.writer(path, "another"), None);
        record.settle(|name| name.starts_with("report"));
        assert_eq!(record, Record::default());
    }
}
