//! Files that are written whole or not at all, and tables as their text.

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

/// Lines of cells as CSV, the names of the columns first; every line has as many cells.
pub(crate) fn csv(header: Vec<String>, lines: impl IntoIterator<Item = Vec<String>>) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    for line in std::iter::once(header).chain(lines) {
        // Memory takes whatever is written to it.
        let _ = writer.write_record(line);
    }
    writer.into_inner().ok().and_then(|bytes| String::from_utf8(bytes).ok()).unwrap_or_default()
}
