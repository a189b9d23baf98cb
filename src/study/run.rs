//! Runs the fits of a study and combines its finished parts.

use std::path::PathBuf;

use rayon::prelude::*;

use super::definition::{Part, Shard, Study};
use super::repetition::{fit, problem_of};
use super::results::{CellResult, Results};
use super::store::{FinishedPart, Store, StoreError};
use super::tally::Tally;

/// Error that prevents the results of a study.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    #[error(transparent)]
    Store(#[from] StoreError),
    #[error(
        "{missing} of {parts} parts of the study are missing in {}; {}run the study or the \
         missing shards",
        list(folders),
        match others {
            0 => String::new(),
            _ => format!("{others} there are of other inputs, so that the study or its problem was changed since: "),
        }
    )]
    Incomplete { missing: usize, parts: usize, others: usize, folders: Vec<PathBuf> },
}

/// Returns the parts of a shard that the store does not contain yet.
///
/// # Errors
/// Returns an error if a finished part cannot be read.
pub fn pending(study: &Study, store: &Store, shard: Shard) -> Result<Vec<Part>, StoreError> {
    let mut pending = Vec::new();
    for (_, part) in study.parts().into_iter().enumerate().filter(|(index, _)| shard.holds(*index))
    {
        if store.find(study, &part)?.is_none() {
            pending.push(part);
        }
    }
    Ok(pending)
}

/// Runs the fits of `parts` in parallel, and writes each part to the store as soon as it is
/// finished. Calls `fitted` after each fit, from several threads.
///
/// # Errors
/// Returns an error if a part cannot be written.
pub fn run(
    study: &Study,
    store: &Store,
    parts: &[Part],
    fitted: impl Fn() + Sync,
) -> Result<(), StoreError> {
    let run_part = |part: &Part| {
        let cell = study.cell(part)?;
        let problem = problem_of(study, cell);
        let score = |repetition| {
            let score = fit(study, &problem, cell, repetition);
            fitted();
            score
        };
        let fits: Vec<_> = part.repetitions.clone().into_par_iter().map(score).collect();
        let mut tally = Tally::new(study.parameters.len());
        let mut seconds = Vec::with_capacity(fits.len());
        for (score, time) in fits {
            tally.push(score);
            seconds.push(time);
        }
        store.keep(&FinishedPart::new(study, (part, cell), tally, seconds))
    };
    parts.par_iter().try_for_each(run_part)
}

/// Combines the finished parts of a study, which may be in several stores, into its results.
///
/// # Errors
/// Returns an error if a part is missing or cannot be read.
pub fn collect(study: &Study, stores: &[Store]) -> Result<Results, RunError> {
    let empty = |cell: &_| CellResult {
        cell: *cell,
        tally: Tally::new(study.parameters.len()),
        seconds: Vec::new(),
    };
    let mut cells: Vec<CellResult> = study.cells.iter().map(empty).collect();
    let parts = study.parts();
    let mut missing = 0;
    for part in &parts {
        let mut finished = None;
        for store in stores {
            finished = finished.or(store.find(study, part)?);
        }
        match (finished, cells.get_mut(part.cell)) {
            (Some(finished), Some(cell)) => {
                cell.tally.merge(&finished.tally);
                cell.seconds.extend(finished.seconds);
            }
            _ => missing += 1,
        }
    }
    if missing > 0 {
        let folders = stores.iter().map(|store| store.folder().to_owned()).collect();
        let (parts, kept) = (parts.len(), stores.iter().map(Store::len).sum::<usize>());
        let others = kept.saturating_sub(parts - missing);
        return Err(RunError::Incomplete { missing, parts, others, folders });
    }
    Ok(Results { cells })
}

/// Returns the paths of folders, separated by commas.
fn list(folders: &[PathBuf]) -> String {
    folders.iter().map(|folder| folder.display().to_string()).collect::<Vec<_>>().join(", ")
}
