//! Finished parts on disk, one small file each, written atomically.

use std::path::{Path, PathBuf};
use std::{fs, io};

use serde::{Deserialize, Serialize};

use super::definition::{Cell, Part, Study};
use super::key::key;
use super::tally::Tally;
use crate::files::{
    FORMAT_VERSION, Format, PROGRAM, changed_key, newer_version, read_text, sealed, write_new,
};

/// Number of hexadecimal digits of the key that form the file name of a part.
const NAME_DIGITS: usize = 16;

/// Folder of finished parts, which several machines may share.
#[derive(Debug, Clone)]
pub struct Store {
    folder: PathBuf,
}

/// Error while writing or reading a finished part.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    #[error("cannot write {}: {source}", path.display())]
    Unwritable { path: PathBuf, source: io::Error },
    #[error("{}: cannot be read: {source}", path.display())]
    Unreadable { path: PathBuf, source: io::Error },
    #[error("{}: damaged ({source}); delete it and its fits are done again", path.display())]
    Damaged { path: PathBuf, source: serde_json::Error },
    #[error("{}: {key}: changed since flexcal wrote it; delete it and its fits are done again", path.display())]
    Changed { path: PathBuf, key: String },
    #[error("the study has no cell {cell}; it has {cells}, counted from 0")]
    NoSuchCell { cell: usize, cells: usize },
    #[error("{}: format: version {version}, and this program reads versions up to {FORMAT_VERSION}; use a newer flexcal, or delete it and its fits are done again", path.display())]
    Newer { path: PathBuf, version: u32 },
    #[error("{}: belongs to other inputs; delete it and its fits are done again", path.display())]
    Foreign { path: PathBuf },
}

impl Study {
    /// Returns the cell to which a part belongs; an error if the study has no such cell.
    pub(super) fn cell(&self, part: &Part) -> Result<&Cell, StoreError> {
        let none = StoreError::NoSuchCell { cell: part.cell, cells: self.cells.len() };
        self.cells.get(part.cell).ok_or(none)
    }
}

/// Finished part with its statistics.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct FinishedPart {
    /// Name and version of the format; empty in files of older versions.
    #[serde(default)]
    format: Format,
    /// Program and version that wrote the file; empty in files of older versions.
    #[serde(default)]
    program: String,
    /// Description of the part for people.
    part: String,
    /// Digest of the inputs of the part.
    key: String,
    /// Statistics over the fits of the part.
    pub tally: Tally,
    /// Duration of each fit \[s\]; the only field that differs from run to run.
    pub seconds: Vec<f64>,
}

impl FinishedPart {
    pub fn new(
        study: &Study,
        (part, cell): (&Part, &Cell),
        tally: Tally,
        seconds: Vec<f64>,
    ) -> Self {
        let what = format!(
            "{}: σ {} mm, {} poses, {}, {}, repetitions {} to {}",
            study.name,
            cell.sigma * 1e3,
            cell.poses,
            cell.strategy.as_str(),
            cell.solver.as_str(),
            part.repetitions.start + 1,
            part.repetitions.end
        );
        Self {
            format: Format::current("flexcal-study-part"),
            program: PROGRAM.to_owned(),
            part: what,
            key: key(study, part, cell),
            tally,
            seconds,
        }
    }
}

impl Store {
    /// Returns the store below the folder of a study's results.
    pub fn new(results: &Path) -> Self {
        Self { folder: results.join("cells") }
    }

    /// Returns the folder of the parts.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Returns the number of files in the folder; 0 if it cannot be read.
    pub(super) fn len(&self) -> usize {
        fs::read_dir(&self.folder).map_or(0, |entries| entries.flatten().count())
    }

    /// Writes a finished part.
    pub(super) fn keep(&self, finished: &FinishedPart) -> Result<(), StoreError> {
        let path = self.path(&finished.key);
        let write = || write_new(&path, &sealed(&serde_json::to_string_pretty(finished)?));
        match write() {
            // Another process has finished the same part.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Ok(()),
            done => done.map_err(|source| StoreError::Unwritable { path, source }),
        }
    }

    /// Reads a finished part of the study; `None` if the store does not contain it.
    pub(super) fn find(
        &self,
        study: &Study,
        part: &Part,
    ) -> Result<Option<FinishedPart>, StoreError> {
        let key = key(study, part, study.cell(part)?);
        let path = self.path(&key);
        let text = match read_text(&path) {
            Ok(text) => text,
            Err(source) if source.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(StoreError::Unreadable { path, source }),
        };
        if let Some(version) = newer_version(text.as_bytes()) {
            return Err(StoreError::Newer { path, version });
        }
        let finished: FinishedPart = match serde_json::from_str(&text) {
            Ok(finished) => finished,
            Err(source) => return Err(StoreError::Damaged { path, source }),
        };
        match changed_key(&text) {
            Ok(Some(key)) => Err(StoreError::Changed { path, key }),
            _ if finished.key == key => Ok(Some(finished)),
            _ => Err(StoreError::Foreign { path }),
        }
    }

    /// Returns the path of the part with a key.
    fn path(&self, key: &str) -> PathBuf {
        self.folder.join(key.get(..NAME_DIGITS).unwrap_or(key)).with_extension("json")
    }
}
