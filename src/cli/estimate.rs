//! Argument of the commands that apply an estimate, and the function that reads the estimate.

use std::path::Path;

use clap::Args;
use flexcal::files::Changes;
use flexcal::fit::{SavedEstimate, SavedEstimateError};

use super::diagnostic;

/// Argument that accepts an estimate that was changed since flexcal wrote it.
#[derive(Debug, Clone, Copy, Args)]
pub struct Trust {
    /// Take an estimate.json, and the remainder.json beside it, that were changed since flexcal
    /// wrote them
    #[arg(long)]
    trust: bool,
}

impl Trust {
    /// Reads an estimate. Returns an error if it was changed since flexcal wrote it, unless `trust`
    /// is set; then prints a warning with the first changed key.
    pub fn read(self, file: &Path) -> Result<SavedEstimate, SavedEstimateError> {
        let changes = if self.trust { Changes::Accepted } else { Changes::Refused };
        let estimate = SavedEstimate::read_with(file, changes)?;
        if let Some(key) = &estimate.changed_key {
            diagnostic::warn(&format!(
                "{}: {key}: changed since flexcal wrote it; used all the same",
                file.display()
            ));
        }
        Ok(estimate)
    }
}
