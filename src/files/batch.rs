//! Files of one result, which take their places in the folder together.

use std::collections::BTreeSet;
use std::fs;
use std::io;
use std::path::{Component, Path, PathBuf};

use super::lock::{FolderLock, MAX_LOCK_WAIT};
use super::record::FolderRecord;
use super::regular;
use super::staged::{StagedFile, folder_of, sync_folder};

/// Subfolder of the results that holds the complete files of a new result.
///
/// While this folder exists, its files count as the result: whoever takes the lock next moves those
/// that are left to their places.
const STAGE: &str = ".flexcal-new";
/// Prefix of the names of incomplete stages.
const INCOMPLETE_STAGE: &str = ".flexcal-new-";
/// File of the stage that records the files which the result replaces or removes.
const REPLACED_FILE: &str = ".flexcal-replaced";

/// Files of one result, all of which appear in their folder or none.
///
/// The files are written without names and linked into a stage, a subfolder of the results. One
/// rename completes the stage. From then on the result is decided, and the files only have to be
/// moved: [`commit`](Self::commit) does this within a fraction of a millisecond. If the process is
/// killed there, the next process that reads or writes in the folder moves the other files.
#[derive(Debug)]
pub struct Batch {
    folder: PathBuf,
    files: Vec<(String, StagedFile)>,
}

impl Batch {
    /// Creates an empty batch for a folder, and the folder if needed.
    ///
    /// # Errors
    /// Returns an error if the folder cannot be created.
    pub fn new(folder: &Path) -> io::Result<Self> {
        fs::create_dir_all(folder)?;
        Ok(Self { folder: folder.to_owned(), files: Vec::new() })
    }

    /// Writes `text` for the file `name` to the disk. The file will keep the permissions of a file
    /// that it replaces.
    ///
    /// # Errors
    /// Returns an error if the text cannot be written.
    pub fn add(&mut self, name: &str, text: &str) -> io::Result<()> {
        let existing = fs::symlink_metadata(self.folder.join(name)).ok();
        let permissions = existing.filter(fs::Metadata::is_file).map(|of| of.permissions());
        self.files.push((name.to_owned(), StagedFile::new(&self.folder, text, permissions)?));
        Ok(())
    }

    /// Moves the files to their places, removes the files `outdated`, and replaces the record of
    /// the locked folder by `record`.
    ///
    /// # Errors
    /// Returns an error if the stage cannot be made, and nothing has changed then; or if a file
    /// cannot be moved, which the next command tries again.
    pub fn commit(
        self,
        _lock: &FolderLock,
        record: &FolderRecord,
        outdated: &[String],
    ) -> io::Result<()> {
        let Self { folder, mut files } = self;
        let written = files.iter().map(|(name, _)| name);
        let replaced = FolderRecord::of_files(&folder, written.chain(outdated));
        for (name, record) in [(FolderRecord::NAME, record), (REPLACED_FILE, &replaced)] {
            files.push((name.to_owned(), StagedFile::new(&folder, &record.text(), None)?));
        }
        let stage = builder().tempdir_in(&folder)?;
        for (name, file) in files {
            let path = stage.path().join(name);
            fs::create_dir_all(folder_of(&path))?;
            file.place(&path)?;
        }
        sync_folders(stage.path(), record);
        // A file system frees the blocks of a replaced file within the rename, which may take
        // milliseconds, unless the file is open.
        let names = replaced.names().chain([FolderRecord::NAME]);
        let open_files: Vec<_> = names.map(|name| regular::open(&folder.join(name))).collect();
        fs::rename(stage.path(), folder.join(STAGE))?;
        // The rename has already removed this name.
        _ = stage.keep();
        let moved = take_places(&folder, record, &replaced, |_| false);
        drop(open_files);
        moved?;
        clear(&folder, record)
    }
}

impl FolderLock {
    /// Locks an existing folder, and completes the result of a process that was killed while its
    /// files took their places.
    ///
    /// # Errors
    /// Returns [`io::ErrorKind::WouldBlock`] if another process holds the lock for more than
    /// [`MAX_LOCK_WAIT`], and an error if the result cannot be completed.
    pub fn take(folder: &Path) -> io::Result<Self> {
        let lock = Self::take_within(folder, MAX_LOCK_WAIT)?;
        if folder.is_dir() {
            finish(folder)?;
        }
        Ok(lock)
    }
}

/// Completes the results in the folder of a file, and in that to which it is a link, if the process
/// that wrote them was killed.
///
/// # Errors
/// Returns an error if they cannot be completed.
pub(super) fn complete_beside(file: &Path) -> io::Result<()> {
    complete(folder_of(file))?;
    file.canonicalize().map_or(Ok(()), |real| complete(folder_of(&real)))
}

/// Completes the results in a folder if the process that wrote them was killed.
fn complete(folder: &Path) -> io::Result<()> {
    if !is_interrupted(folder) {
        return Ok(());
    }
    FolderLock::take(folder).map(drop).map_err(|error| {
        let message = format!("a new result is not complete in its folder, and cannot be: {error}");
        io::Error::new(error.kind(), message)
    })
}

/// Returns true if a complete stage is in the folder.
fn is_interrupted(folder: &Path) -> bool {
    folder.join(STAGE).symlink_metadata().is_ok_and(|stage| stage.is_dir())
}

/// Moves the files of a complete stage in a locked folder to their places, and removes incomplete
/// stages. A file stays if it was changed since the stage was made, or is behind a symbolic link.
///
/// # Errors
/// Returns an error if a file cannot be moved.
fn finish(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)?.flatten() {
        let is_incomplete = |name: &str| name.starts_with(INCOMPLETE_STAGE);
        if entry.file_name().to_str().is_some_and(is_incomplete) {
            // Nobody misses a stage that cannot be removed.
            _ = fs::remove_dir_all(entry.path());
        }
    }
    if !is_interrupted(folder) {
        return Ok(());
    }
    let stage = folder.join(STAGE);
    let replaced = FolderRecord::read_file(&stage.join(REPLACED_FILE))?;
    let record = FolderRecord::read(&stage)?;
    let is_kept = |name: &str| {
        let path = folder.join(name);
        let exists = path.symlink_metadata().is_ok();
        let above = Path::new(name).parent().unwrap_or(Path::new(""));
        let is_link = above
            .ancestors()
            .any(|above| !above.as_os_str().is_empty() && folder.join(above).is_symlink());
        !is_below(name) || is_link || (exists && replaced.writer(folder, name).is_none())
    };
    take_places(folder, &record, &replaced, is_kept)?;
    clear(folder, &record)
}

/// Returns true if a name leads to a place below its folder.
fn is_below(name: &str) -> bool {
    Path::new(name).components().all(|part| matches!(part, Component::Normal(_)))
}

/// Moves the files of the stage, but those for which `is_kept` returns true, then removes the
/// `replaced` files that `record` does not list, and moves the record last.
fn take_places(
    folder: &Path,
    record: &FolderRecord,
    replaced: &FolderRecord,
    is_kept: impl Fn(&str) -> bool,
) -> io::Result<()> {
    let stage = folder.join(STAGE);
    let is_staged = |name: &&str| stage.join(name).symlink_metadata().is_ok();
    for name in record.names().filter(is_staged).filter(|name| !is_kept(name)) {
        let path = folder.join(name);
        fs::create_dir_all(folder_of(&path))?;
        unless_missing(fs::rename(stage.join(name), path))?;
    }
    let is_outdated = |name: &&str| record.names().all(|recorded| recorded != *name);
    // Without its record the stage has taken all places already.
    if is_staged(&FolderRecord::NAME) {
        for name in replaced.names().filter(is_outdated).filter(|name| !is_kept(name)) {
            unless_missing(fs::remove_file(folder.join(name)))?;
        }
    }
    unless_missing(fs::rename(FolderRecord::file(&stage), FolderRecord::file(folder)))
}

/// Removes the stage, and waits until the disk holds the names of the files.
fn clear(folder: &Path, record: &FolderRecord) -> io::Result<()> {
    unless_missing(fs::remove_dir_all(folder.join(STAGE)))?;
    sync_folders(folder, record);
    Ok(())
}

/// Waits until the disk holds the names in a folder and in the subfolders of recorded files.
fn sync_folders(folder: &Path, record: &FolderRecord) {
    let names = record.names().chain([FolderRecord::NAME]);
    let subfolders: BTreeSet<&Path> = names.map(|name| folder_of(Path::new(name))).collect();
    for subfolder in subfolders {
        sync_folder(&folder.join(subfolder));
    }
}

/// Returns no error if a file is missing, because another process has moved it.
fn unless_missing(done: io::Result<()>) -> io::Result<()> {
    match done {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        done => done,
    }
}

/// Returns the builder of incomplete stages.
fn builder() -> tempfile::Builder<'static, 'static> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(INCOMPLETE_STAGE);
    // Whoever may read the results may have to complete them.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
    builder
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads a file as commands do.
    fn read_text(file: &Path) -> io::Result<String> {
        complete_beside(file)?;
        fs::read_to_string(file)
    }

    /// Writes files of a result to a folder.
    fn write(folder: &Path, texts: &[(&str, &str)], outdated: &[&str]) {
        let lock = FolderLock::take(folder).unwrap();
        let mut record = FolderRecord::read(folder).unwrap();
        let mut batch = Batch::new(folder).unwrap();
        for (name, text) in texts {
            batch.add(name, text).unwrap();
            record.add("identify", name, text);
        }
        for name in outdated {
            record.remove(name);
        }
        let outdated: Vec<String> = outdated.iter().map(|&name| name.to_owned()).collect();
        batch.commit(&lock, &record, &outdated).unwrap();
    }

    const OLD: [(&str, &str); 4] =
        [("a.json", "old a"), ("b.csv", "old b"), ("figures/c.svg", "old c"), ("d.md", "old d")];
    const NEW: [(&str, &str); 3] =
        [("a.json", "new a"), ("b.csv", "new b"), ("figures/e.svg", "new e")];
    const OUTDATED: [&str; 2] = ["figures/c.svg", "d.md"];

    /// Returns a folder with an old result and the complete stage of a new one.
    fn staged() -> tempfile::TempDir {
        let [folder, other] = [(); 2].map(|()| tempfile::tempdir().unwrap());
        for folder in [&folder, &other] {
            write(folder.path(), &OLD, &[]);
        }
        write(other.path(), &NEW, &OUTDATED);
        let stage = folder.path().join(STAGE);
        fs::create_dir_all(stage.join("figures")).unwrap();
        fs::copy(FolderRecord::file(folder.path()), stage.join(REPLACED_FILE)).unwrap();
        for name in ["a.json", "b.csv", "figures/e.svg", FolderRecord::NAME] {
            fs::copy(other.path().join(name), stage.join(name)).unwrap();
        }
        folder
    }

    /// Asserts that a folder holds the new result and nothing else.
    fn assert_new(folder: &Path) {
        for (name, text) in NEW {
            assert_eq!(read_text(&folder.join(name)).unwrap(), text);
            let record = FolderRecord::read(folder).unwrap();
            assert_eq!(record.writer(folder, name), Some("identify"));
        }
        let entries =
            fs::read_dir(folder).unwrap().chain(fs::read_dir(folder.join("figures")).unwrap());
        assert_eq!(entries.count(), NEW.len() + 2, "a.json, b.csv, figures, .flexcal and e.svg");
    }

    #[test]
    fn a_result_is_whole_wherever_its_writer_was_killed() {
        for moved in 0..=6 {
            let folder = staged();
            let (folder, stage) = (folder.path(), folder.path().join(STAGE));
            for (name, _) in NEW.iter().take(moved) {
                fs::rename(stage.join(name), folder.join(name)).unwrap();
            }
            for name in OUTDATED.iter().take(moved.saturating_sub(3)) {
                fs::remove_file(folder.join(name)).unwrap();
            }
            if moved == 6 {
                fs::rename(FolderRecord::file(&stage), FolderRecord::file(folder)).unwrap();
            }
            assert_eq!(read_text(&folder.join("b.csv")).unwrap(), "new b", "{moved} moved");
            assert_new(folder);
        }
    }

    #[test]
    fn an_incomplete_stage_is_removed() {
        let folder = staged();
        let folder = folder.path();
        fs::rename(folder.join(STAGE), folder.join(".flexcal-new-x1")).unwrap();
        assert_eq!(read_text(&folder.join("a.json")).unwrap(), "old a");
        write(folder, &NEW, &OUTDATED);
        assert_new(folder);
    }

    #[test]
    fn a_file_that_was_changed_since_stays() {
        let folder = staged();
        let folder = folder.path();
        let outside = tempfile::tempdir().unwrap();
        fs::write(folder.join("a.json"), "mine").unwrap();
        fs::write(folder.join("d.md"), "mine").unwrap();
        // A crafted stage reaches nothing outside its folder.
        let record = FolderRecord::file(&folder.join(STAGE));
        let escaping = outside.path().join("x");
        let text =
            format!("{}0 identify {}\n", fs::read_to_string(&record).unwrap(), escaping.display());
        fs::write(record, text).unwrap();
        assert_eq!(read_text(&folder.join("b.csv")).unwrap(), "new b");
        for name in ["a.json", "d.md"] {
            assert_eq!(read_text(&folder.join(name)).unwrap(), "mine");
            assert_eq!(FolderRecord::read(folder).unwrap().writer(folder, name), None);
        }
        assert!(!is_interrupted(folder));
    }
}
