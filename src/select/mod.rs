//! Search for effects that a model lacks, from the residual of its fit.
//!
//! - [`trace`]: score screening, which scores every candidate of the catalogue in the linear
//!   neighbourhood of a fit and ranks the candidates.
//! - [`detectable`]: the same screening before measurement; computes the smallest size at which it
//!   would find each effect.
//! - [`close`]: model selection in rounds of fitting, screening, adding effects and testing.
//! - [`Unexplained`]: structure that no effect explains, its place, and a smooth empirical
//!   correction.

mod candidates;

mod data;
mod detection;
mod evidence;
mod fitted;
mod grammar;
mod harmonic_prior;
mod left_out_gain;
mod neighbourhood;
mod power;

mod reference_check;
mod rules;
mod screening;
mod selection;
mod separating_pose;
mod separation;
mod settings;
mod unexplained;

#[doc(hidden)]
pub use candidates::{HELD_FIXED, NOT_FINITE, REFUSED};
#[doc(hidden)]
pub use detection::{Detectable, Detection, Size, detectable};
#[doc(hidden)]
pub use evidence::{Claims, Evidence, Hypothesis, HypothesisKind, HypothesisSet, Site};
#[doc(hidden)]
pub use harmonic_prior::HarmonicPrior;
#[doc(hidden)]
pub use reference_check::{ReferenceCheck, ReferenceVerdict};
pub use rules::SelectionRules;
#[doc(hidden)]
pub use screening::examine;
pub use screening::{Ranked, Trace, trace, trace_by};
#[doc(hidden)]
pub use selection::Compared;
pub use selection::{ClosedLoop, Found, Interval, Round, Status, Verdict, close, close_by};
#[doc(hidden)]
pub use separating_pose::SeparatingPose;
#[doc(hidden)]
pub use separation::{Separation, Side, separation};
#[doc(hidden)]
pub use unexplained::{Correction, Curve, PartialResidual, Unexplained};
