//! Errors of work with an earlier estimate.

use std::path::PathBuf;

use crate::error::InputError;
use crate::fit::{IdentifyError, PredictError, SavedEstimateError};

/// Error of an earlier estimate that cannot serve as a prior or a reference.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs, reason = "the message of each variant says what it stands for")]
pub enum PriorError {
    #[error("{0}")]
    Input(#[from] InputError),
    #[error(transparent)]
    Estimate(#[from] SavedEstimateError),
    #[error(transparent)]
    Predict(#[from] PredictError),
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    #[error(
        "{}: none of its parameters has a variance, so it is no prior; identify the earlier rows again",
        file.display()
    )]
    NoCovariance { file: PathBuf },
    #[error(
        "{}: was identified with strategy {found}; a prior needs the strategy joint, in the earlier and in the new identification",
        file.display()
    )]
    Strategy { file: PathBuf, found: &'static str },
    #[error("{}: the arm it describes has no prediction in some pose of the table", file.display())]
    NotFinite { file: PathBuf },
    #[error("{}: all {rows} rows of the table were fitted there already, so nothing is new", file.display())]
    NothingNew { file: PathBuf, rows: usize },
}

impl PriorError {
    /// Returns true if the work was stopped on request.
    pub(crate) fn is_interrupted(&self) -> bool {
        matches!(self, Self::Identify(error) if error.is_interrupted())
    }
}
