//! Files that are written whole or not at all.

use std::fs;
use std::io::{self, Write as _};
use std::path::Path;

use tempfile::NamedTempFile;

/// Writes `text` to a temporary file beside `path`, whose folder is made if it is not there; [`NamedTempFile::persist`] then
/// puts it in its place at once.
///
/// An existing file keeps its permissions, a new one gets those that files of the process get.
///
/// # Errors
/// The folder or the file cannot be made or written.
pub fn prepared(path: &Path, text: &str) -> io::Result<NamedTempFile> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    fs::create_dir_all(folder)?;
    let mut builder = tempfile::Builder::new();
    // What a program asks for when it makes a file; the system takes its mask off. Left alone, it would be for the owner only.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder)?;
    if let Ok(existing) = fs::metadata(path) {
        file.as_file().set_permissions(existing.permissions())?;
    }
    file.write_all(text.as_bytes())?;
    file.flush()?;
    Ok(file)
}
