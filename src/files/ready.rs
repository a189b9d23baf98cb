//! A file on the disk that is not yet in its place.

use std::fs::{self, File};
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

/// A text that is on the disk as a whole and lacks only its name.
///
/// Where the system can, it has no name at all until then, so that a process that is killed leaves
/// nothing behind; killed between the two calls that replace a file, it leaves what the next one to
/// replace files there takes away.
#[derive(Debug)]
pub struct Ready {
    path: PathBuf,
    file: Kept,
}

#[derive(Debug)]
enum Kept {
    #[cfg(target_os = "linux")]
    Nameless(File),
    Named(NamedTempFile),
}

impl Ready {
    /// Writes `text` for `path`, whose folder is made if it is not there, and waits until the disk
    /// has it.
    ///
    /// An existing file keeps its permissions, a new one gets those that files of the process get.
    ///
    /// # Errors
    /// The folder or the file cannot be made or written.
    pub fn new(path: &Path, text: &str) -> io::Result<Self> {
        let folder = folder_of(path);
        fs::create_dir_all(folder)?;
        let file = Kept::in_folder(folder)?;
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

    /// Puts the file in its place at once; what stood there before is gone then.
    ///
    /// # Errors
    /// The name cannot be given.
    pub fn put(self) -> io::Result<()> {
        let folder = folder_of(&self.path);
        match self.file {
            #[cfg(target_os = "linux")]
            Kept::Nameless(file) => name(&file, folder, &self.path)?,
            Kept::Named(file) => _ = file.persist(&self.path).map_err(|error| error.error)?,
        }
        // Names are on the disk when their folder is; not every system lets one wait for that.
        if let Ok(folder) = File::open(folder) {
            let _ = folder.sync_all();
        }
        Ok(())
    }
}

impl Kept {
    fn in_folder(folder: &Path) -> io::Result<Self> {
        #[cfg(target_os = "linux")]
        {
            use rustix::fs::{Mode, OFlags, open};
            // What a program asks for when it makes a file; the system takes its mask off.
            let mode = Mode::from_raw_mode(0o666);
            // Naming goes through /proc.
            if let (Ok(file), true) = (
                open(folder, OFlags::TMPFILE | OFlags::WRONLY | OFlags::CLOEXEC, mode),
                Path::new("/proc/self/fd").is_dir(),
            ) {
                return Ok(Self::Nameless(file.into()));
            }
        }
        let mut builder = tempfile::Builder::new();
        // Left alone, it would be for the owner only.
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

/// How names begin that last until a file is replaced; the number of their process follows.
#[cfg(target_os = "linux")]
const PASSING: &str = ".flexcal-";

/// Nothing takes so long between two names.
#[cfg(target_os = "linux")]
const LEFT: std::time::Duration = std::time::Duration::from_secs(60);

/// Takes away what processes left that are no more. On a folder that several machines share a
/// number may be that of another one's: what is younger than [`LEFT`] stays.
#[cfg(target_os = "linux")]
fn clear(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let process = name
            .to_str()
            .and_then(|name| name.strip_prefix(PASSING)?.split_once('-')?.0.parse::<u32>().ok());
        let is_gone = |process: u32| !Path::new("/proc").join(process.to_string()).exists();
        let is_old = || {
            entry.metadata()?.modified()?.elapsed().map_err(io::Error::other).map(|age| age > LEFT)
        };
        if process.is_some_and(is_gone) && is_old().unwrap_or(false) {
            _ = fs::remove_file(entry.path());
        }
    }
}

/// Gives a file without a name its own: at once where nothing has it, else by way of a name that
/// nobody else takes.
#[cfg(target_os = "linux")]
fn name(file: &File, folder: &Path, path: &Path) -> io::Result<()> {
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
    clear(folder);
    let new = tempfile::Builder::new()
        .prefix(&format!("{PASSING}{}-", std::process::id()))
        .make_in(folder, link)?;
    fs::rename(new.path(), path)?;
    // It is gone under this name already.
    _ = new.into_temp_path().keep();
    Ok(())
}

fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}
