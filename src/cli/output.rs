//! Results on disk and on standard output.

use std::fs;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use flexcal::files;
use flexcal::report::{Report, is_figure};

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
pub fn write_all(folder: &Path, texts: &[(&str, &str)]) -> Result<(), WriteError> {
    keep(texts.iter().map(|(name, text)| (folder.join(name), *text)).collect())
}

/// The same with a report: `report.md`, `report.html` and its figures in `figures`, from where those of an older page go.
pub fn write_report(folder: &Path, texts: &[(&str, &str)], report: &Report) -> Result<(), WriteError> {
    let drawn = folder.join("figures");
    let texts =
        texts.iter().copied().chain([("report.md", report.markdown.as_str()), ("report.html", report.html.as_str())]);
    let mut files: Vec<(PathBuf, &str)> = texts.map(|(name, text)| (folder.join(name), text)).collect();
    files.extend(report.figures.iter().map(|(name, figure)| (drawn.join(name), figure.as_str())));
    keep(files)?;
    forget(&drawn, report).map_err(|source| WriteError { path: drawn, source })
}

/// Writes files all or none, as far as file systems allow: what can be in the way is found before the first is in its place.
fn keep(texts: Vec<(PathBuf, &str)>) -> Result<(), WriteError> {
    for (path, _) in &texts {
        let above = path.ancestors().skip(1).find(|above| above.exists());
        let source = match above {
            _ if path.is_dir() => "a folder of that name is in the way",
            Some(above) if !above.is_dir() => "a file is in the way of its folder",
            _ => continue,
        };
        return Err(WriteError { path: path.clone(), source: io::Error::other(source) });
    }
    let mut ready = Vec::with_capacity(texts.len());
    for (path, text) in texts {
        match files::prepared(&path, text) {
            Ok(file) => ready.push((file, path)),
            Err(source) => return Err(WriteError { path, source }),
        }
    }
    for (file, path) in ready {
        file.persist(&path).map_err(|error| WriteError { path, source: error.error })?;
    }
    Ok(())
}

/// Removes figures from a folder that are not on the page; files that are no figures of flexcal stay.
fn forget(drawn: &Path, report: &Report) -> io::Result<()> {
    for entry in fs::read_dir(drawn)? {
        let entry = entry?;
        let name = entry.file_name();
        let is_old = |name: &str| is_figure(name) && report.figures.iter().all(|(own, _)| own != name);
        if name.to_str().is_some_and(is_old) && entry.file_type()?.is_file() {
            fs::remove_file(entry.path())?;
        }
    }
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
