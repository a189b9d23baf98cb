//! Errors in a study.

use std::path::PathBuf;

use thiserror::Error;

/// Kind of error in a study; [`Location`](super::Location) holds the place.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum StudyErrorKind {
    #[error(
        "no such file; give a STUDY.toml or the folder that holds one; docs/study.md says how \
         to write one"
    )]
    Missing,
    #[error("no such file: {}; paths are relative to the study's folder", path.display())]
    FileMissing { path: PathBuf },
    #[error(
        "a study draws and fits positions; this problem measures points, distances or surfaces: \
         `simulate` and `identify` do"
    )]
    PositionsOnly,
    #[error("is already in the list; remove it")]
    Repeated,
    #[error("the list is empty; write at least one value")]
    EmptyList,
    #[error("a study of misprints runs in one piece; leave out --shard and merge")]
    StudyNotDivisible,
    #[error("the study sets the number of poses; leave this out")]
    PosesOfStudy,
    #[error(
        "the model cannot simulate effects that the problem does not declare; write data = \"rig\""
    )]
    NeedsRig,
    #[error(
        "{solver} does not keep the bounds and constraints of the problem; write bounded, \
         interior-point or auto"
    )]
    SolverIgnoresBounds { solver: &'static str },
    #[error("no parameter that {strategy} varies is free in the problem; leave the strategy out")]
    NothingToVary { strategy: &'static str },
}
