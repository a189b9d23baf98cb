//! Errors of an identification with a prior, of a fleet, and of a watch.

use std::path::{Path, PathBuf};

use crate::error::InputError;
use crate::fit::{IdentifyError, PredictError, SavedEstimateError};
use crate::remainder::SavedRemainderError;

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
    Remainder(#[from] SavedRemainderError),
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    #[error(
        "{}: none of its parameters has a variance, so it is no prior; identify the earlier rows \
         again",
        file.display()
    )]
    NoCovariance { file: PathBuf },
    #[error(
        "{}: was identified with strategy {found}; a prior needs the strategy joint, in the \
         earlier and in the new identification",
        file.display()
    )]
    Strategy { file: PathBuf, found: &'static str },
    #[error("a fleet of {arms} is too small; give the estimates of at least {least} arms")]
    FewArms { arms: usize, least: usize },
    #[error("{}: is of another type of arm than {}: {part} differs", file.display(), other.display())]
    OtherType { file: PathBuf, other: PathBuf, part: String },
    #[error("{}: cannot be read: {source}", file.display())]
    Unreadable { file: PathBuf, source: std::io::Error },
    #[error(
        "{}: changed or cut since flexcal wrote it; run flexcal fleet again, or remove its line \
         digest and move it to another folder to use it as it is",
        file.display()
    )]
    Changed { file: PathBuf },
    #[error(
        "{}: not a PRIOR.toml of flexcal fleet: {reason}; --prior takes that or the estimate.json \
         of flexcal identify",
        file.display()
    )]
    Syntax { file: PathBuf, reason: String },
    #[error("{}: {part} is declared differently in the problem; a prior is of arms with the same declaration", file.display())]
    OtherPart { file: PathBuf, part: String },
    #[error("{}: is of problem {found}, not {expected}", file.display())]
    OtherProblem { file: PathBuf, found: String, expected: String },
    #[error("{}: {name} is part of the prior, but not free in the problem", file.display())]
    NotFree { file: PathBuf, name: String },
    #[error(
        "{}: the arm it describes has no prediction in some pose of the table; check the loads \
         there, such as payload_kg",
        file.display()
    )]
    NotFinite { file: PathBuf },
    #[error(
        "{}: neither it nor the problem states σ of a measured position; declare \
         position_sigma_mm in [data], or a column sigma_mm",
        file.display()
    )]
    NoSigma { file: PathBuf },
    #[error(
        "{}: {}; give one estimate of each arm",
        file.display(),
        shared(file, other, *rows)
    )]
    SameRows { file: PathBuf, other: PathBuf, rows: usize },
    #[error(
        "{}: was identified with a prior from siblings, which would count twice; identify its \
         rows without --prior",
        file.display()
    )]
    HasFleetPrior { file: PathBuf },
    #[error(
        "{}: its fit was not trusted, so it is no prior; see its findings, and identify its rows \
         together with the new ones",
        file.display()
    )]
    Untrusted { file: PathBuf },
    #[error(
        "{}: all {rows} rows to fit were fitted there already, so nothing is new; give new rows",
        file.display()
    )]
    NothingNew { file: PathBuf, rows: usize },
}

impl PriorError {
    /// Returns true if the work was stopped on request.
    pub(crate) fn is_interrupted(&self) -> bool {
        matches!(self, Self::Identify(error) if error.is_interrupted())
    }
}

/// States that two estimates were fitted to the same rows, or that a file was given twice.
fn shared(file: &Path, other: &Path, rows: usize) -> String {
    if file == other {
        "was given twice".to_owned()
    } else {
        format!("shares {rows} fitted rows with {}", other.display())
    }
}
