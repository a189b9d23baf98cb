//! What a fit's residual says about effects that the model lacks, and the loop that adds them.
//!
//! - [`test_residual`]: residual tests, whether structure is left at all.
//! - [`trace`]: score screening, every candidate of the catalogue scored in the linear
//!   neighbourhood of a fit and ranked.
//! - [`detectable`]: the same screening before anything is measured: from what size on it would
//!   find each effect.
//! - [`close`]: model selection, rounds of fit, screening, adding, testing again.
//! - [`Unexplained`]: structure that no effect explains, its place, and a smooth correction without
//!   a cause.

mod candidates;
mod covariate;
mod data;
mod detection;
mod evidence;
mod fitted;
mod neighbourhood;
mod power;
mod residual_tests;
mod rules;
mod screening;
mod selection;
mod separation;
mod telling_pose;
mod unexplained;
mod witness;

pub use candidates::{HELD_FIXED, NO_ROOM, NOT_FINITE, REFUSED};
pub use covariate::Covariate;
pub use detection::{Detectable, Detection, Size, detectable};
pub use evidence::{Claims, Evidence, Explanation, Hypothesis, Law, Part};
pub use residual_tests::{
    CovariateValues, Findings, FitResidual, Outcome, ResidualTest, Sequence, Test, Untestable,
    test_residual,
};
pub use rules::SelectionRules;
pub use screening::{Ranked, Trace, examine, trace, trace_by};
pub use selection::{
    ClosedLoop, Found, HarmonicPrior, Interval, Round, Status, Verdict, close, close_by,
};
pub use separation::{Separation, Side, separation};
pub use telling_pose::TellingPose;
pub use unexplained::{Correction, Curve, PartialResidual, Unexplained};
pub use witness::{Witness, WitnessVerdict};
