//! Argument of the commands that apply an estimate, and the function that reads the estimate.

use std::error::Error;
use std::path::{Path, PathBuf};

use clap::Args;
use flexcal::files::{Changes, was_changed};
use flexcal::fit::{SavedEstimate, SavedEstimateError};
use flexcal::life::{FleetPrior, PriorError, PriorSource};
use flexcal::measurement::Measurements;
use flexcal::problem::Problem;

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
            warn_of_change(&format!("{}: {key}", file.display()));
        }
        Ok(estimate)
    }

    /// Reads the prior of an identification: a PRIOR.toml, or an estimate. Returns an error also if
    /// the fit of the estimate was not trusted.
    pub fn read_prior(self, file: &Path) -> Result<PriorSource, Box<dyn Error>> {
        if file.extension().is_some_and(|ending| ending == "toml") {
            return Ok(PriorSource::Fleet(FleetPrior::read(file)?));
        }
        let estimate = self.read(file)?;
        if !estimate.trusted {
            return Err(PriorError::Untrusted { file: file.to_owned() }.into());
        }
        Ok(PriorSource::Estimate(Box::new(estimate)))
    }

    /// Returns an error if a table beside an estimate was changed since flexcal wrote it, unless
    /// `trust` is set; then prints a warning.
    pub fn check_table(self, file: &Path) -> Result<(), ChangedTable> {
        if !was_changed(file) {
            return Ok(());
        }
        if !self.trust {
            return Err(ChangedTable { file: file.to_owned() });
        }
        warn_of_change(&file.display().to_string());
        Ok(())
    }
}

/// Returns the warning that an estimate of an older version does not say whether its rows had
/// directions of approach, if `rows` lack them and an effect of the problem is the play of a joint.
pub fn older_sides(
    estimate: &SavedEstimate,
    problem: &Problem,
    rows: &Measurements,
) -> Option<String> {
    let is_older = !estimate.states_approach && rows.approach.is_none();
    let mut effects = problem.effects.iter().map(|declared| &declared.effect);
    let play = effects.find(|effect| is_older && effect.is_play())?;
    Some(format!(
        "{}: an older version wrote it, which did not state whether its rows had directions of approach; \
         {} takes the sign of the loads' moment: identify again, or give the rows columns approach1 …",
        estimate.file.display(),
        play.name_and_place()
    ))
}

/// Error of a table that was changed.
#[derive(Debug, thiserror::Error)]
#[error("{}: changed since flexcal wrote it; identify again, or use it all the same with --trust", file.display())]
pub struct ChangedTable {
    file: PathBuf,
}

/// Warns that something changed is used.
fn warn_of_change(place: &str) {
    diagnostic::warn(&format!("{place}: changed since flexcal wrote it; used all the same"));
}
