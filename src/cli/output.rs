//! Results on disk and on standard output.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use flexcal::report::Page;

/// A result that could not be written.
#[derive(Debug, thiserror::Error)]
#[error("cannot write {}: {source}", path.display())]
pub struct WriteError {
    path: PathBuf,
    source: io::Error,
}

/// Makes a folder for results, with those above it.
pub fn folder(path: &Path) -> Result<PathBuf, WriteError> {
    fs::create_dir_all(path).map_err(|source| WriteError { path: path.to_owned(), source })?;
    Ok(path.to_owned())
}

/// Writes `text` to `folder`/`name`, whole or not at all: to a temporary file beside it, then renamed.
pub fn write(folder: &Path, name: &str, text: &str) -> Result<PathBuf, WriteError> {
    write_all(folder, &[(name, text)])?;
    Ok(folder.join(name))
}

/// Writes texts by name, each whole or not at all, and none before all of them are on the disk.
pub fn write_all(path: &Path, texts: &[(&str, &str)]) -> Result<(), WriteError> {
    folder(path)?;
    let mut files = Vec::new();
    for (name, text) in texts {
        let path_of = path.join(name);
        let failed = |source| WriteError { path: path_of.clone(), source };
        let mut file = tempfile::NamedTempFile::new_in(path).map_err(failed)?;
        file.write_all(text.as_bytes()).and_then(|()| file.flush()).map_err(failed)?;
        files.push((file, path_of));
    }
    for (file, path) in files {
        file.persist(&path).map_err(|error| WriteError { path, source: error.error })?;
    }
    Ok(())
}

/// Writes a page as `report.html` in `folder`, and its figures in `figures` beside it.
pub fn write_page(folder: &Path, page: &Page) -> Result<(), WriteError> {
    for (name, figure) in &page.figures {
        write(&folder.join("figures"), name, figure)?;
    }
    write(folder, "report.html", &page.html)?;
    Ok(())
}

/// Prints to standard output; a closed pipe ends the printing quietly.
pub fn print(text: &str) -> Result<(), WriteError> {
    match anstream::stdout().write_all(text.as_bytes()) {
        Err(source) if source.kind() != io::ErrorKind::BrokenPipe => {
            Err(WriteError { path: PathBuf::from("standard output"), source })
        }
        _ => Ok(()),
    }
}
