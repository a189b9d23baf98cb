//! Atomic file writes: a file is written in full before it appears under its name.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// File whose contents are completely on the disk, but which does not have its name yet.
///
/// On Linux the file has no name at all until [`commit`](Self::commit), so that a killed process
/// leaves nothing behind. A process that is killed while it replaces an existing file can leave a
/// temporary name; the next replacement in that folder removes it.
#[derive(Debug)]
pub struct StagedFile {
    path: PathBuf,
    file: Storage,
}

#[derive(Debug)]
enum Storage {
    #[cfg(target_os = "linux")]
    Nameless(File),
    Named(NamedTempFile),
}

impl StagedFile {
    /// Writes `text` to a staged file for `path` and waits until the disk holds it. Creates the
    /// folder if needed.
    ///
    /// An existing file keeps its permissions. A new file gets the default permissions of the
    /// process.
    ///
    /// # Errors
    /// Returns an error if the folder or the file cannot be created or written.
    pub fn new(path: &Path, text: &str) -> io::Result<Self> {
        let folder = folder_of(path);
        fs::create_dir_all(folder)?;
        let file = Storage::in_folder(folder)?;
        let mut open = file.as_file();
        if let Ok(existing) = fs::symlink_metadata(path)
            && existing.is_file()
        {
            open.set_permissions(existing.permissions())?;
        }
        open.write_all(text.as_bytes())?;
        open.sync_all()?;
        Ok(Self { path: path.to_owned(), file })
    }

    /// Moves the file to its path and atomically replaces a file that exists there.
    ///
    /// # Errors
    /// Returns an error if the file cannot be renamed.
    pub fn commit(self) -> io::Result<()> {
        Self::commit_all([self]).map_err(|(_, error)| error)
    }

    /// Moves files to their paths, one right after the other, and waits for the disk only then.
    ///
    /// # Errors
    /// Returns the path and the error of the first file that cannot be renamed.
    pub fn commit_all(files: impl IntoIterator<Item = Self>) -> Result<(), (PathBuf, io::Error)> {
        let mut folders = Vec::new();
        let moved = files.into_iter().try_for_each(|Self { path, file }| {
            let folder = folder_of(&path).to_owned();
            let moved = match file {
                #[cfg(target_os = "linux")]
                Storage::Nameless(file) => link_at(&file, &folder, &path),
                Storage::Named(file) => file.persist(&path).map(drop).map_err(|error| error.error),
            };
            if !folders.contains(&folder) {
                folders.push(folder);
            }
            moved.map_err(|error| (path, error))
        });
        // A name is durable once its folder is synchronised, which some systems do not support.
        for folder in folders {
            if let Ok(folder) = File::open(folder) {
                let _ = folder.sync_all();
            }
        }
        moved
    }
}

impl Storage {
    fn in_folder(folder: &Path) -> io::Result<Self> {
        #[cfg(target_os = "linux")]
        {
            use rustix::fs::{Mode, OFlags, open};
            // This is the usual mode of a new file; the system applies its umask.
            let mode = Mode::from_raw_mode(0o666);
            // A nameless file is linked through /proc.
            if let (Ok(file), true) = (
                open(folder, OFlags::TMPFILE | OFlags::WRONLY | OFlags::CLOEXEC, mode),
                Path::new("/proc/self/fd").is_dir(),
            ) {
                return Ok(Self::Nameless(file.into()));
            }
        }
        let mut builder = tempfile::Builder::new();
        // By default only the owner could read a temporary file.
        #[cfg(unix)]
        builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
        builder.tempfile_in(folder).map(Self::Named)
    }

    fn as_file(&self) -> &File {
        match self {
            #[cfg(target_os = "linux")]
            Self::Nameless(file) => file,
            Self::Named(file) => file.as_file(),
        }
    }
}

/// Prefix of temporary names, followed by the process number.
#[cfg(target_os = "linux")]
const TEMPORARY_PREFIX: &str = ".flexcal-";

/// Minimum age of a temporary file before another process removes it; renaming takes far less.
#[cfg(target_os = "linux")]
const MIN_STALE_AGE: std::time::Duration = std::time::Duration::from_secs(60);

/// Removes temporary files of processes that have ended. On a network folder the process number may
/// belong to another machine, so files younger than [`MIN_STALE_AGE`] stay.
#[cfg(target_os = "linux")]
fn remove_stale_files(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let process = name.to_str().and_then(|name| {
            name.strip_prefix(TEMPORARY_PREFIX)?.split_once('-')?.0.parse::<u32>().ok()
        });
        let is_gone = |process: u32| !Path::new("/proc").join(process.to_string()).exists();
        let is_old = || {
            entry
                .metadata()?
                .modified()?
                .elapsed()
                .map_err(io::Error::other)
                .map(|age| age > MIN_STALE_AGE)
        };
        if process.is_some_and(is_gone) && is_old().unwrap_or(false) {
            _ = fs::remove_file(entry.path());
        }
    }
}

/// Links a nameless file to `path`. Replaces an existing file through a temporary name.
#[cfg(target_os = "linux")]
fn link_at(file: &File, folder: &Path, path: &Path) -> io::Result<()> {
    use std::os::fd::AsRawFd as _;

    use rustix::fs::{AtFlags, CWD, linkat};
    let nameless = format!("/proc/self/fd/{}", file.as_raw_fd());
    let link = |to: &Path| {
        linkat(CWD, &nameless, CWD, to, AtFlags::SYMLINK_FOLLOW).map_err(io::Error::from)
    };
    match link(path) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
        done => return done,
    }
    remove_stale_files(folder);
    let new = tempfile::Builder::new()
        .prefix(&format!("{TEMPORARY_PREFIX}{}-", std::process::id()))
        .make_in(folder, link)?;
    fs::rename(new.path(), path)?;
    // The rename has already removed this name.
    _ = new.into_temp_path().keep();
    Ok(())
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
