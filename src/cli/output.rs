//! Writing of results to a folder, and printing to standard output.

use std::fs;
use std::io::{self, Write as _};
use std::path::PathBuf;

use flexcal::error::{escape_hidden, is_hidden};
use flexcal::files::{Batch, FolderLock, FolderRecord, MAX_LOCK_WAIT, digest, same_file};
use flexcal::report::{Report, is_figure};

use super::{diagnostic, interrupt};

/// Names of the two files of a report, without its figures.
pub const REPORT: [&str; 2] = ["report.md", "report.html"];
/// Subfolder of the results for the figures of a report.
const FIGURES: &str = "figures";

/// Error of results that cannot be written.
#[derive(Debug, thiserror::Error)]
pub enum WriteError {
    #[error("cannot write {}: {source}", path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error(
        "{}: another flexcal has been writing there for {} s; wait for its end, or name another \
         folder with --out",
        folder.display(),
        MAX_LOCK_WAIT.as_secs()
    )]
    Busy { folder: PathBuf },
    #[error("cannot write {}: {why}", path.display())]
    InTheWay { path: PathBuf, why: &'static str },
    #[error(
        "{} is an input of this command or belongs to its problem; name another place with --out, \
         or overwrite it with --force",
        path.display()
    )]
    Input { path: PathBuf },
    #[error(
        "{} exists and was not written by flexcal, or was changed since; name another place with --out, or replace the file with --force", path.display()
    )]
    Foreign { path: PathBuf },
}

/// Folder and file names that a command has claimed for its results. The results may replace files
/// that flexcal wrote there, except files that the command reads.
#[derive(Clone)]
pub struct Results {
    pub folder: PathBuf,
    /// Name of the command, as the record of the folder states it.
    command: &'static str,
    /// Names of the files that the command may write, without figures.
    names: Vec<String>,
    /// Paths of the files that the command or its problem reads.
    inputs: Vec<PathBuf>,
    /// True if the results may replace any file.
    force: bool,
    /// True if no warning is printed.
    quiet: bool,
}

impl Results {
    /// Claims the files `names` in `folder` for results of `command`. Returns an error if they
    /// would replace a file that flexcal did not write or that the command reads.
    /// [`write`](Self::write) may write files with other names too.
    pub fn claim(
        command: &'static str,
        folder: PathBuf,
        inputs: Vec<PathBuf>,
        names: &[&str],
        (force, quiet): (bool, bool),
    ) -> Result<Self, WriteError> {
        let names: Vec<String> = names.iter().map(|&name| name.to_owned()).collect();
        let claimed = Self { folder, command, names, inputs, force, quiet };
        let _lock = claimed.lock()?;
        let record = claimed.record()?;
        claimed.names.iter().try_for_each(|name| claimed.check(&record, name))?;
        if claimed.names.iter().any(|name| name == REPORT[0]) {
            claimed.existing_figures().iter().try_for_each(|name| claimed.check(&record, name))?;
        }
        Ok(claimed)
    }

    /// Returns the existing files in the folder of figures whose names are those of figures. A new
    /// report may replace them.
    fn existing_figures(&self) -> Vec<String> {
        let Ok(entries) = fs::read_dir(self.folder.join(FIGURES)) else { return Vec::new() };
        let names = entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
        names.filter(|name| is_figure(name)).map(|name| format!("{FIGURES}/{name}")).collect()
    }

    /// Returns a sentence that names the folder and the claimed files that exist.
    pub fn written(&self) -> String {
        // A command does not always write all files that it claims.
        let is_there = |name: &&String| self.path(name).exists();
        let names: Vec<&str> = self.names.iter().filter(is_there).map(String::as_str).collect();
        format!("\nWritten to {}: {}\n", self.folder.display(), names.join(", "))
    }

    /// Returns true if this command wrote the file `name`, perhaps in an earlier run, and the file
    /// has not changed since.
    pub fn is_recorded(&self, name: &str) -> bool {
        self.record().is_ok_and(|record| record.writer(&self.folder, name) == Some(self.command))
    }

    /// Claims the same file names in the subfolder `name` instead. Returns an error if they would
    /// replace a file there that flexcal did not write.
    pub fn below(&self, name: &str) -> Result<Self, WriteError> {
        let names: Vec<&str> = self.names.iter().map(String::as_str).collect();
        let (folder, flags) = (self.folder.join(name), (self.force, self.quiet));
        Self::claim(self.command, folder, self.inputs.clone(), &names, flags)
    }

    /// Returns the path of the result `name`.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Writes texts, given as (file name, text). The files appear together or not at all.
    pub fn write(&self, texts: &[(&str, &str)]) -> Result<(), WriteError> {
        self.write_all(texts, |_| false)
    }

    /// Writes texts, given as (file name, text), and a report: `report.md`, `report.html` and its
    /// figures. These replace the figures of an earlier report.
    pub fn write_report(&self, texts: &[(&str, &str)], report: &Report) -> Result<(), WriteError> {
        let drawn: Vec<(String, &str)> = report
            .figures
            .iter()
            .map(|(name, figure)| (format!("{FIGURES}/{name}"), figure.as_str()))
            .collect();
        let pages = REPORT.into_iter().zip([report.markdown.as_str(), report.html.as_str()]);
        let figures = drawn.iter().map(|(name, figure)| (name.as_str(), *figure));
        let texts: Vec<(&str, &str)> = texts.iter().copied().chain(pages).chain(figures).collect();
        let is_outdated = |name: &str| {
            let figure = name.strip_prefix("figures/").is_some_and(is_figure);
            figure && drawn.iter().all(|(drawn, _)| drawn != name)
        };
        self.write_all(&texts, is_outdated)
    }

    /// Writes all files or none; see [`Batch`]. Removes recorded files for which `is_outdated`
    /// returns true, and claimed files of an earlier run of this command that are not written now.
    fn write_all(
        &self,
        texts: &[(&str, &str)],
        is_outdated: impl Fn(&str) -> bool,
    ) -> Result<(), WriteError> {
        let failed = |path: PathBuf| |source| WriteError::Io { path, source };
        let mut batch = Batch::new(&self.folder).map_err(failed(self.folder.clone()))?;
        for (name, text) in texts {
            batch.add(name, text).map_err(failed(self.path(name)))?;
        }
        let lock = self.lock()?;
        let mut record = self.record()?;
        texts.iter().try_for_each(|(name, _)| self.check(&record, name))?;
        let replaced = self.replaced_by_other_command(&record, texts);
        let replaced_sheet = self.replace_source(&mut record);
        let is_left = |name: &str| {
            let claimed = self.names.iter().any(|claimed| claimed == name)
                && texts.iter().all(|(written, _)| *written != name);
            claimed && record.writer(&self.folder, name) == Some(self.command)
        };
        let is_removed = |name: &&str| {
            is_left(name) || (is_outdated(name) && record.writer(&self.folder, name).is_some())
        };
        let outdated: Vec<String> = record.names().filter(is_removed).map(str::to_owned).collect();
        for (name, text) in texts {
            record.add(self.command, name, text);
        }
        for name in &outdated {
            record.remove(name);
        }
        let exit_blocked = interrupt::block_exit();
        batch.commit(&lock, &record, &outdated).map_err(failed(self.folder.clone()))?;
        interrupt::mark_written();
        drop((exit_blocked, lock));
        if replaced_sheet && !self.quiet {
            diagnostic::warn(&format!(
                "{} made of another file is replaced; --out keeps both",
                self.path(self.names.first().map_or("", String::as_str)).display()
            ));
        }
        if let (Some((name, other)), false) = (replaced, self.quiet) {
            let what = if name == REPORT[0] { "the report" } else { &name };
            diagnostic::warn(&format!(
                "{what} of {other} in the same folder is replaced; --out keeps both"
            ));
        }
        Ok(())
    }

    /// Records of which file the results of `init` are made, whose folder has the name of the arm;
    /// returns true if those there were made of another one.
    fn replace_source(&self, record: &mut FolderRecord) -> bool {
        const MADE_OF: &str = "made of ";
        let Some(input) = self.inputs.first().filter(|_| self.command == "init") else {
            return false;
        };
        let path = input.canonicalize().unwrap_or_else(|_| input.clone());
        let source = format!("{MADE_OF}{}", digest(path.to_string_lossy().as_bytes()));
        let is_there = self.names.iter().any(|name| self.is_recorded(name));
        let others = record.names().filter(|name| name.starts_with(MADE_OF) && *name != source);
        let others: Vec<String> = others.map(str::to_owned).collect();
        for other in &others {
            record.remove(other);
        }
        record.add(self.command, &source, "");
        is_there && !others.is_empty()
    }

    /// Returns the first of the files `texts` that another command wrote, a report before other
    /// files, and the name of that command. `None` if no other command wrote any of them.
    fn replaced_by_other_command(
        &self,
        record: &FolderRecord,
        texts: &[(&str, &str)],
    ) -> Option<(String, String)> {
        let other = |&(name, _): &(&str, &str)| {
            let writer =
                record.writer(&self.folder, name).filter(|writer| *writer != self.command)?;
            Some((name.to_owned(), writer.to_owned()))
        };
        let report = texts.iter().find(|(name, _)| *name == REPORT[0]);
        report.and_then(other).or_else(|| texts.iter().find_map(other))
    }

    /// Locks the folder, so that no other flexcal process writes there at the same time. Returns an
    /// error if another process holds the lock for longer than [`MAX_LOCK_WAIT`].
    fn lock(&self) -> Result<FolderLock, WriteError> {
        FolderLock::take(&self.folder).map_err(|source| match source.kind() {
            io::ErrorKind::WouldBlock => WriteError::Busy { folder: self.folder.clone() },
            _ => WriteError::Io { path: self.folder.clone(), source },
        })
    }

    /// Reads the record of the files that flexcal wrote to the folder.
    fn record(&self) -> Result<FolderRecord, WriteError> {
        FolderRecord::read(&self.folder)
            .map_err(|source| WriteError::Io { path: FolderRecord::file(&self.folder), source })
    }

    /// Returns an error if a result may not take the file name `name`. A folder may have that name,
    /// or the result would replace an input or a file that flexcal did not write.
    fn check(&self, record: &FolderRecord, name: &str) -> Result<(), WriteError> {
        let path = self.path(name);
        let why = |why| Err(WriteError::InTheWay { path: path.clone(), why });
        if name.starts_with(FolderRecord::NAME) {
            return why("names with .flexcal in front are for flexcal's own records");
        }
        if path.is_dir() {
            return why("a folder of that name is in the way; name a file in it, or another place");
        }
        match path.ancestors().skip(1).find(|above| above.symlink_metadata().is_ok()) {
            Some(above) if !above.is_dir() && !above.as_os_str().is_empty() => {
                return why("a file is in the way of its folder");
            }
            Some(above)
                if above != self.folder
                    && above.starts_with(&self.folder)
                    && above.is_symlink() =>
            {
                return why("its folder is a symbolic link, which is not followed");
            }
            _ => {}
        }
        if self.force || path.symlink_metadata().is_err() {
            return Ok(());
        }
        if self.inputs.iter().any(|input| same_file(input, &path)) {
            return Err(WriteError::Input { path });
        }
        if record.writer(&self.folder, name).is_none() {
            return Err(WriteError::Foreign { path });
        }
        Ok(())
    }
}

/// Returns the number of columns of the terminal on standard output, at least 40; `usize::MAX` if
/// there is no terminal.
pub fn terminal_columns() -> usize {
    terminal_size::terminal_size_of(io::stdout())
        .map_or(usize::MAX, |(width, _)| usize::from(width.0).max(40))
}

/// Prints text to standard output, with hidden characters such as control characters escaped. A
/// closed pipe is no error.
pub fn print(text: &str) -> Result<(), WriteError> {
    print_unchanged(&escape_hidden(text))
}

/// Prints JSON to standard output, with hidden characters in its strings escaped as `\uXXXX`.
pub fn print_json(json: &str) -> Result<(), WriteError> {
    let mut text = String::with_capacity(json.len());
    for character in json.chars() {
        if is_hidden(character) && character != '\n' {
            let mut halves = [0; 2];
            text.extend(
                character.encode_utf16(&mut halves).iter().map(|half| format!("\\u{half:04x}")),
            );
        } else {
            text.push(character);
        }
    }
    print_unchanged(&text)
}

/// Prints a text unchanged to standard output. A closed pipe is no error.
pub fn print_unchanged(text: &str) -> Result<(), WriteError> {
    match anstream::stdout().write_all(text.as_bytes()) {
        Err(source) if source.kind() != io::ErrorKind::BrokenPipe => {
            Err(WriteError::Io { path: PathBuf::from("standard output"), source })
        }
        _ => Ok(()),
    }
}
