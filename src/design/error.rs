//! What keeps a design from being made.

use std::path::PathBuf;

use crate::error::{InputError, Location};

/// How to free the geometry of an arm.
const FREE: &str = "write [parameters] with lines such as \"joint*.alpha\" = { sigma_deg = 1.0 }, \"joint*.a\" = { sigma_mm = 5.0 }, \
                    \"joint*.theta\" = { sigma_deg = 1.0 }, \"joint*.d\" = { sigma_mm = 5.0 }, \"base.*\" = { free = true }";

/// Why there is no plan and no forecast.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DesignError {
    /// Problem and poses do not fit each other.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A joint may go anywhere.
    #[error("{location}.{end}_{unit}: missing; write min_{unit} and max_{unit} of every moving joint")]
    NoRange {
        /// The joint in the problem file.
        location: Box<Location>,
        /// Which end has no limit: `min` or `max`.
        end: &'static str,
        /// Suffix of its unit.
        unit: &'static str,
    },
    /// Nothing says how exact positions will be.
    #[error(
        "{}: data.position_sigma_mm: missing; write the 1 σ of a coordinate to reckon with (or give the poses a column sigma_mm)",
        file.display()
    )]
    NoSigma {
        /// The problem file.
        file: PathBuf,
    },
    /// No parameter is free.
    #[error("{}: parameters: no parameter is free, so there is nothing to identify; {FREE}", file.display())]
    NothingFree {
        /// The problem file.
        file: PathBuf,
    },
    /// No pose was asked for, or a table has none.
    #[error("no pose to plan or to judge")]
    NoPoses,
    /// Fewer candidates than poses.
    #[error("{poses} poses: there are only {candidates} candidates")]
    TooFewCandidates {
        /// Poses asked for.
        poses: usize,
        /// Candidates in which the arm comes to rest.
        candidates: usize,
    },
    /// Two effects that are one.
    #[error("both effects are the same: {effect}")]
    SameEffect {
        /// In words.
        effect: String,
    },
    /// An effect that the problem has.
    #[error("the problem declares this effect already: {effect}")]
    DeclaredEffect {
        /// In words.
        effect: String,
    },
    /// An effect that no choice of poses shows.
    #[error("an effect of time is told by when poses are measured, not by which: {effect}")]
    FollowsTime {
        /// In words.
        effect: String,
    },
    /// The nominal arm does not come to rest anywhere.
    #[error("the nominal arm has no equilibrium under its loads in any pose; check stiffnesses and masses")]
    NoEquilibrium,
}
