//! Results of a loop that was interrupted before it ended.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

use flexcal::fit::{Progress, ProgressSink};
use flexcal::problem::{Effect, Problem, edit};
use flexcal::report::shell_word;
use serde_json::Value;

use super::output::{Results, WriteError};
use super::{diagnostic, interrupt};

/// Subfolder of the results for an interrupted loop, used if the folder already contains a finished
/// loop.
const INTERRUPTED_FOLDER: &str = "interrupted";
/// Name of the problem file that declares the effects that were found.
const CLOSED_PROBLEM_FILE: &str = "problem.closed.toml";
/// Exit status of an interrupted loop that has written a file.
const WRITTEN_STATUS: u8 = 1;

/// Record of a running loop, from which results are written if it is interrupted and cannot end in
/// time.
#[derive(Clone)]
pub struct LoopRecord {
    /// Text of the problem file.
    text: String,
    /// Effects that the problem file declares.
    declared: Vec<Effect>,
    /// Paths of the measurement files and of the joint tables.
    files: [Vec<PathBuf>; 2],
    /// Folder and file names of the loop's results.
    results: Results,
    /// Effects of the model after the last finished round.
    added: Arc<Mutex<Vec<Effect>>>,
}

impl LoopRecord {
    /// Creates the record of a loop that is about to start.
    pub fn new(text: &str, problem: &Problem, files: &[PathBuf], results: &Results) -> Self {
        let joint_files = problem.data.joint_log.as_ref().map(|log| log.files.clone());
        Self {
            text: text.to_owned(),
            declared: problem.effects.iter().map(|declared| declared.effect.clone()).collect(),
            files: [files.to_vec(), joint_files.unwrap_or_default()],
            results: results.clone(),
            added: Arc::default(),
        }
    }

    /// Returns a progress receiver that records the effects of finished rounds and forwards
    /// progress to `shown`.
    pub fn recording_sink(&self, shown: Option<ProgressSink>) -> ProgressSink {
        let added = Arc::clone(&self.added);
        Arc::new(move |progress: Progress| {
            if let Progress::Round { effects, .. } = &progress {
                added.lock().unwrap_or_else(PoisonError::into_inner).clone_from(effects);
            }
            if let Some(shown) = &shown {
                shown(progress);
            }
        })
    }

    /// Returns the results in their folder, or in a subfolder if the folder already contains the
    /// results of a finished loop.
    pub fn beside_finished(&self) -> Result<Results, WriteError> {
        if !self.results.is_recorded("loop.json") || !is_finished(&self.results.path("loop.json")) {
            return Ok(self.results.clone());
        }
        let below = self.results.below(INTERRUPTED_FOLDER)?;
        diagnostic::warn(&format!(
            "{} holds a finished loop, which stays; the interrupted one is in {}",
            self.results.folder.display(),
            below.folder.display()
        ));
        Ok(below)
    }

    /// Creates `folder`, and returns the paths of the measurement files and of the joint tables
    /// relative to it.
    pub fn files_relative_to(&self, folder: &Path) -> Result<[Vec<PathBuf>; 2], WriteError> {
        let of = |files: &[PathBuf]| -> io::Result<Vec<PathBuf>> {
            fs::create_dir_all(folder)?;
            let folder = folder.canonicalize()?;
            let relative = |file: &PathBuf| {
                let file = file.canonicalize()?;
                Ok(pathdiff::diff_paths(&file, &folder).unwrap_or(file))
            };
            files.iter().map(relative).collect()
        };
        let [files, joint_files] = &self.files;
        let failed = |source| WriteError::Io { path: folder.to_owned(), source };
        Ok([of(files).map_err(failed)?, of(joint_files).map_err(failed)?])
    }

    /// Writes the problem with the effects of the finished rounds, prints a message, and returns
    /// the exit status. Writes nothing if no round has added an effect.
    pub fn write(self) -> u8 {
        let added = self.added.lock().unwrap_or_else(PoisonError::into_inner).clone();
        if added.is_empty() {
            diagnostic::interrupted(
                "interrupted before the first round was done: nothing is written",
            );
            return interrupt::status();
        }
        match self.write_closed_problem(&added) {
            Ok(file) => {
                diagnostic::warn(&format!(
                    "interrupted: {} declares the effects of the finished rounds; flexcal loop {} \
                     searches on",
                    file.display(),
                    shell_word(&file)
                ));
                WRITTEN_STATUS
            }
            Err(error) => {
                diagnostic::print(error.as_ref());
                interrupt::status()
            }
        }
    }

    /// Writes the problem file with the `added` effects declared, and returns its path.
    fn write_closed_problem(
        &self,
        added: &[Effect],
    ) -> Result<PathBuf, Box<dyn std::error::Error>> {
        let results = self.beside_finished()?;
        let [files, joint_files] = self.files_relative_to(&results.folder)?;
        let declared = self.declared.iter().map(|effect| (effect.clone(), Vec::new()));
        let comment = "Found by flexcal loop before it was interrupted.".to_owned();
        let found = added.iter().filter(|effect| !self.declared.contains(effect));
        let found = found.map(|effect| (effect.clone(), vec![comment.clone()]));
        let effects: Vec<_> = declared.chain(found).collect();
        let text =
            edit::with_effects(&self.text, &self.declared, &effects, [&files, &joint_files])?;
        results.write(&[(CLOSED_PROBLEM_FILE, &text)])?;
        Ok(results.path(CLOSED_PROBLEM_FILE))
    }
}

/// Returns true if a `loop.json` is the result of a loop that was not interrupted; false if the
/// file cannot be read.
fn is_finished(file: &Path) -> bool {
    let result: Option<Value> =
        fs::read_to_string(file).ok().and_then(|text| serde_json::from_str(&text).ok());
    result.is_some_and(|result| result.get("interrupted") != Some(&Value::Bool(true)))
}
