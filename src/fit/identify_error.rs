//! Errors of an identification.

use super::StageError;
use crate::error::InputError;

/// Error of an identification that could not be computed, or whose result could not be applied.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum IdentifyError {
    /// The data have no identification row.
    #[error("no pose to identify from")]
    NoPoses,
    /// The problem or the data are wrong, or do not belong together.
    #[error("{0}")]
    Input(#[from] InputError),
    /// A fit could not be set up.
    #[error(transparent)]
    Stage(#[from] StageError),
    /// The problem declares bounds or constraints that the chosen solver cannot keep.
    #[error(
        "{solver} does not keep the bounds of [parameters] and constraints: take the solver bounded, interior-point or auto, or leave out \
         min, max and [[constraint]]"
    )]
    BoundsIgnored {
        /// Name of the solver.
        solver: &'static str,
    },
    /// `SolverChoice::Custom` was chosen without a solver.
    #[error("the solver custom needs a solver of the caller: Options::with_custom_solver")]
    NoCustomSolver,
    /// The strategy has no parameter to vary.
    #[error(
        "strategy {strategy} has nothing to fit: no parameter of its kind is free in [parameters]"
    )]
    NothingToFit {
        /// Name of the strategy.
        strategy: &'static str,
    },
    /// A rule of the search for effects has a value outside its range.
    #[error(
        "the rule {rule} of the search for effects has a value outside its range; \
         docs/selection.md explains it"
    )]
    Rule {
        /// Name of the rule.
        rule: &'static str,
    },
    /// The configurations of the data have another number of joints than the arm.
    #[error("configurations of {found} joints for an arm of {joints}")]
    JointCount {
        /// Number of joints in the configurations of the data.
        found: usize,
        /// Number of joints of the problem, including fixed ones.
        joints: usize,
    },
    /// The model lacks a parameter that was identified.
    #[error("{name} was identified, but the problem has no such parameter: identify this problem")]
    NotInModel {
        /// Name of the parameter.
        name: String,
    },
    /// A parameter is needed that was not identified.
    #[error("{name} was not identified: the sessions, targets or effects differ")]
    NoEstimate {
        /// Name of the parameter.
        name: String,
    },
}

impl IdentifyError {
    /// Creates the error of work that was stopped on request.
    pub(crate) fn interrupted() -> Self {
        Self::Stage(StageError::Interrupted)
    }

    /// Returns true if the work was stopped on request.
    pub(crate) fn is_interrupted(&self) -> bool {
        matches!(self, Self::Stage(StageError::Interrupted))
    }
}
