//! What keeps a design from being made.

use crate::error::{InputError, InputErrorKind, Location};
use crate::problem::{Joint, JointKind, Problem};

/// How to free the geometry of an arm.
const FREE: &str = "write [parameters] with lines such as \"joint*.alpha\" = { sigma_deg = 1.0 }, \"joint*.a\" = { sigma_mm = 5.0 }, \
                    \"joint*.theta\" = { sigma_deg = 1.0 }, \"joint*.d\" = { sigma_mm = 5.0 }, \"base.*\" = { free = true }";

/// Why there is no plan and no forecast.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DesignError {
    /// Problem and poses do not fit each other.
    #[error("{0}")]
    Input(#[from] InputError),
    /// A joint may go anywhere.
    #[error("{0}")]
    NoRange(#[source] InputError),
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
    #[error(
        "the nominal arm has no equilibrium under its loads in any pose; check stiffnesses and masses"
    )]
    NoEquilibrium,
    /// No pose tells anything.
    #[error(
        "no free parameter moves the target in any pose; check lengths, ranges and their units"
    )]
    NothingSeen,
}

impl DesignError {
    /// A joint without a limit at `end`, `min` or `max`.
    pub(super) fn no_range(joint: &Joint, end: &str) -> Self {
        let unit = if joint.kind == JointKind::Prismatic { "mm" } else { "deg" };
        let key = format!("{}.{end}_{unit}", joint.location.key.as_deref().unwrap_or("joint"));
        let write = format!("min_{unit} and max_{unit} of every moving joint");
        let location = joint.location.clone().with_key(key);
        Self::NoRange(location.error(InputErrorKind::MissingKey { write, near: None }))
    }

    /// Nothing says how exact positions will be.
    pub(super) fn no_sigma(problem: &Problem) -> Self {
        let sigma = "the 1 σ of a coordinate to reckon with (or give the poses a column sigma_mm)";
        let write = if problem.fixtures.is_empty() {
            sigma.to_owned()
        } else {
            format!(
                "--candidates FILE.csv, a table that says in a column point, anchor or surface what each pose is to touch or to measure \
                 against; of poses whose positions are measured, {sigma}"
            )
        };
        let location = problem.data.location.clone().with_key("data.position_sigma_mm");
        location.error(InputErrorKind::MissingKey { write, near: None }).into()
    }

    /// No parameter is free.
    pub(super) fn nothing_free(problem: &Problem) -> Self {
        let location = Location::file(&problem.data.location.file).with_key("parameters");
        location.error(InputErrorKind::NothingFree { write: FREE }).into()
    }
}
