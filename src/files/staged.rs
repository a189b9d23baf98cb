//! Files that are written in full before they get a name.

use std::fs::{self, File, Permissions};
use std::io::{self, Write as _};
use std::path::Path;

use tempfile::NamedTempFile;

/// File whose contents are completely on the disk, but which does not have a name yet.
///
/// On Linux the file has no name at all until [`place`](Self::place), so that a killed process
/// leaves nothing behind. Elsewhere it has a temporary name in its folder.
#[derive(Debug)]
pub(super) enum StagedFile {
    #[cfg(target_os = "linux")]
    Nameless(File),
    Named(NamedTempFile),
}

/// Writes a new file, which appears when the disk holds it. Creates its folder if needed.
///
/// # Errors
/// Returns an error if the folder or the file cannot be written, or if the file exists
/// ([`io::ErrorKind::AlreadyExists`]).
pub fn write_new(path: &Path, text: &str) -> io::Result<()> {
    let folder = folder_of(path);
    fs::create_dir_all(folder)?;
    StagedFile::new(folder, text, None)?.place(path)?;
    sync_folder(folder);
    Ok(())
}

impl StagedFile {
    /// Writes `text` to a file without a name on the file system of an existing folder, and waits
    /// until the disk holds it. `permissions` are those of a file that it will replace; otherwise
    /// the file gets the default permissions of the process.
    pub fn new(folder: &Path, text: &str, permissions: Option<Permissions>) -> io::Result<Self> {
        let staged = Self::in_folder(folder)?;
        let mut file = staged.as_file();
        if let Some(permissions) = permissions {
            file.set_permissions(permissions)?;
        }
        file.write_all(text.as_bytes())?;
        file.sync_all()?;
        Ok(staged)
    }

    /// Gives the file its name. Returns an error if a file of that name exists.
    pub fn place(self, path: &Path) -> io::Result<()> {
        match self {
            #[cfg(target_os = "linux")]
            Self::Nameless(file) => {
                use std::os::fd::AsRawFd as _;

                use rustix::fs::{AtFlags, CWD, linkat};
                let nameless = format!("/proc/self/fd/{}", file.as_raw_fd());
                Ok(linkat(CWD, nameless, CWD, path, AtFlags::SYMLINK_FOLLOW)?)
            }
            Self::Named(file) => {
                file.persist_noclobber(path).map(drop).map_err(|error| error.error)
            }
        }
    }

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

/// Waits until the disk holds the names in a folder, which some systems do not support.
pub(super) fn sync_folder(folder: &Path) {
    if let Ok(folder) = File::open(folder) {
        _ = folder.sync_all();
    }
}

/// Returns the folder of a file.
pub(super) fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
